"""Plans for `team: joint`, where a formula speaks of what all robots show together.

Read `team_words`, then `conjuncts` (one conjunct, read letter by letter of the team) and `heuristic` (what is surely left).
"""
