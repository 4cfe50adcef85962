"""Lower bounds on what is left to pay, which never exceed it: the searches over a team take them to find cheapest plans (A*).

For formulas that count robots, read `counted_conjuncts` (each conjunct by itself), `counted_landmarks` (propositions that must still become true or
false) and `goal_cover` (the routes that reach them, shared out among the robots).
"""
