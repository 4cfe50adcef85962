"""MTAC-E, offline (2022 paper, Algorithm 2): who does what, by the costs of the very paths that would be flown.

Read `offline`, then `beam_search` (the walk over the team automaton), `agent_states` (where each robot is), `agent_moves` (its
visits over the graph of regions on which the exact search stands as well), `robot_tasks` (the visits that it is given),
`task_reader` (the formula as robots read it), `admissible_heuristic` (what is surely left to fly) and `optimality_gap` (how near to
the best, by straight lines). Many tasks are shared in tours: `many_tasks`, then `task_kinds`, `shared_tours`, `task_tours`, `cheapest_legs`. What
paths cost is in `priced_paths`. Formulas that count robots: `counted_tasks`, then `counted_courses` (visits put into courses), `counted_parts` (who takes
which part) and `counted_bounds`.
"""
