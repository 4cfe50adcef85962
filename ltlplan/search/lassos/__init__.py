"""The cheapest way to satisfy a formula for ever: a prefix and a cycle, of one robot or of a team whose laps begin together.

For one robot read `laps` (the door) and `lasso`; `rounds` finds the cheapest cycle that shows every mark, with bounds by `order_bounds`, and `word_lasso`
is for automata that choose. For teams `team_laps` is the door. By the sum of costs read `team_lassos`: the product of all robots (`team_system`), how it is
read (`team_readers`), with few of them flying first (`few_flying`), and what may be done at the same time (`team_stages`); `shared_parts` needs no product
where the formula's parts can be given to one robot each. By the dearest robot read `labels`, a search with each
robot's cost kept apart; what a lap does to an automaton is its effect (`lap_effects`).
"""
