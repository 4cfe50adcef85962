"""How much is surely left: bounds from below that tell a search where to go, and when it has the best.

Read `heuristic` (each conjunct by itself), then `landmarks` (what every way to acceptance shows) and `spanning_tree` (what it takes to
reach all that); `order_bounds` is for what every order of the robots has to keep.
"""
