"""Who does what, exactly: the cheapest words that satisfy the formula, or why there are none.

Read `exact` (the door), `relevant_places` (which regions need visits at all), `reduced_graph` (a team's systems with only the places
that matter) and `team_search`, a `best_first` search over `team_states`, led by `bounds`. `makespan` is `objective: longest` (many
tasks are shared by `insertion`), `endurance` a limit on it, and `refusals` says why there is no plan and which parts to keep. Infinite
words are in `lassos`, joint formulas in `joint`, and `method` offers all this as a planning method.
"""
