"""Admissible lower bounds on the cost that is left: they lead a search, and tell when it has the best.

Read `conjunct_graph` (a conjunct's automaton, backwards), `conjunct_bounds` (each conjunct by itself, its landmarks included, and the cost to
show all of these); `order_bounds` is for what every order of the robots has to keep. For formulas that
count robots there is `goal_cover` (propositions that must still become true or
false, and the paths that reach them, shared out among the robots, beside what the formula asks of single robots: `own_progress`). For cycles `set_orders` bounds what it costs to come to sets of places
in any order, `cycle_shares` shares out what a team's cycles are to show, each robot alone, beside the shortest path over all
places of a team.
"""
