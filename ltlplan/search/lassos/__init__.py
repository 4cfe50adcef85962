"""The cheapest way to satisfy a formula for ever: a prefix and a cycle, of one robot or of a team whose laps begin together.

Read `laps` (the door) and `lasso`; `rounds` finds the cheapest cycle that shows every mark, and `word_lasso` is for automata that choose.
For teams read `team_lassos`: the product of all robots (`team_system`), how it is read (`team_readers`), with few of them flying first
(`few_flying`), and what may be done at the same time (`team_stages`); `shared_parts` needs no product where the formula's parts can be given to one robot each.
"""
