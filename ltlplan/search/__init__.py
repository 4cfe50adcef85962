"""Who does what, exactly: the cheapest words that satisfy the formula, or why there are none.

Read `exact` (the door, which answers with an `assignment` of `itineraries`), `relevant_places` (which regions need visits at all),
`reduced_graph` (a team's systems with only the places that matter) and `team_search` over `team_states`, led by `heuristics`. `label_setting` is the
one search, `team_reading` what it asks of each reading of a team. `makespan` is `objective: longest` (many tasks are shared by `insertion`; `lagrangian_bounds` where only sums are searched for), `endurance` a limit on it, and `explanations` says why
there is no plan and which parts to keep. Words that hold under precedences are in `partial_orders`, infinite words in `lassos`, joint
formulas in `joint`, those that count in `counting` (their lower bounds in `bounds`), and `method` offers all this as a planning method.
`task_paths` tables the cost of tasks for single robots, `robot_paths` searches their paths, and `least_cost_matching` assigns tasks to them.
`shared_walls` tells what may be shown at a wall that two rooms share.
"""
