"""MTAC-E, offline (2022 paper, Algorithm 2): who does what, by the costs of the very paths that would be flown.

Read `offline`, then `beam_search` (the walk over the team automaton), `agent_moves` (where each robot is, and its
visits over the graph of regions on which the exact search stands as well, and those that it is given),
`decomposable_task` (the formula as robots read it), `admissible_heuristic` (what is surely left to fly) and `optimality_gap` (how near to
the best, by straight lines). What paths cost is in `priced_paths`. `many_tasks` shares many tasks in tours of the exact search; formulas
that count robots are planned in `counting`.
"""
