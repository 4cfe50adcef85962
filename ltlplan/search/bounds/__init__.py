"""Admissible lower bounds on the cost that is left: they lead a search, and tell when it has the best.

Read `conjunct_graph` (a conjunct's automaton, backwards), `conjunct_bounds` (each conjunct by itself, its landmarks included) and
`spanning_tree` (the cost to show all landmarks); `order_bounds` is for what every order of the robots has to keep.
For cycles `set_orders` bounds what it costs to come to sets of places in any order, `cycle_shares` shares out what a team's cycles are to show, each robot alone,
and `cycle_costs` takes the shortest way over all places of a team.
"""
