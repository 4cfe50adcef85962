"""Plans for `team: joint`, where a formula speaks of what all robots show together.

Read `team_words`, then `joint_states` (how far the team is), `conjuncts` (one conjunct, read letter by letter of the team), `heuristic`
and `order_bounds` (what is surely left).
"""
