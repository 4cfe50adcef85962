"""MTAC-E, offline (2022 paper, Algorithm 2): who does what, by the costs of the very paths that would be flown.

Read `offline`, then `beam_search` (the walk over the team automaton), `task_reader` (the formula as robots read it) and
`allocation` (where each robot is, what it can do, and what is surely left to fly).
"""
