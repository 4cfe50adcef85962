"""Exact task assignment: the cheapest words that satisfy the formula, or why there are none.

Read `exact` (the door, which lists what is tried for a `problem` and answers with `itineraries`), then the one search:
`label_setting`, and `team_reading` (what it asks of each reading of a team, whose states `numbering` numbers, and whose answers `memoization` keeps); `lawler` goes on to the next
cheapest answers. Each reading has a folder, with `planning` and `reading` in it:
`own` (each robot's word by itself) and `joint` (all robots together) follow robots one after another (`sequential_reading`) and look for
plans that hold in every order of them (`team_planning`); where the highest cost counts, many tasks are shared in `tours`. `counting` counts robots, `orders` puts events in order, and `cycles` are
infinite words. `bounds` lead the searches. They walk over a `reduced_graph`, with only the places that matter, made of the
`relevant_places` (and what a formula may gain by). `endurance` is a limit on plans, `explanations` says why there is none, and which parts to keep. `exact` offers all this as
a planning method. `least_cost_matching` assigns tasks to robots, `every_order` holds fixed words
against every order of the robots, and `shared_walls` tells what may be shown at a wall that two rooms share.
"""
