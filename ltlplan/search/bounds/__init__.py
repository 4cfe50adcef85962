"""Admissible lower bounds on the cost that is left: they lead a search, and tell when it has the best.

Read `conjunct_graph` (a conjunct's automaton, backwards), `conjunct_bounds` (each conjunct by itself, its landmarks included) and
`spanning_tree` (the cost to show all landmarks); `order_bounds` is for what every order of the robots has to keep.
"""
