"""Who does what, exactly: the cheapest words that satisfy the formula, or why there are none.

Read `exact` (the door, which answers with an `assignment` of `itineraries`), `relevant_places` (which regions need visits at all),
`reduced_graph` (a team's systems with only the places that matter) and `team_search`, a `best_first` search over `team_states`, led by
`bounds`. `makespan` is `objective: longest` (many tasks are shared by `insertion`; `weighted_sums` where only sums are searched for), `endurance` a limit on it, and `refusals` says why
there is no plan and which parts to keep. Words that hold under precedences are in `interleavings`, infinite words in `lassos`, joint
formulas in `joint`, those that count in `counts`, and `method` offers all this as a planning method.
"""
