"""MTAC-E, offline (2022 paper, Algorithm 2): who does what, by the costs of the very paths that would be flown.

Read `offline`, then `beam_search` (the walk over the team automaton), `agent_moves` (where each robot is and what it can do),
`task_reader` (the formula as robots read it), `admissible_heuristic` (what is
surely left to fly) and `optimality_gap` (how near to the best, by straight lines).
"""
