"""Plans for `team: joint`, where a formula speaks of what all robots show together.

Read `planning`, then `reading` (the states of the search) and `conjuncts` (one conjunct, read letter by letter of the team).
"""
