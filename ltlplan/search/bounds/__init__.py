"""Lower bounds on what is left to pay, which never exceed it: the searches over a team take them to find cheapest plans (A*).

`conjunct_graph` is the one protocol: a conjunct's states, walked backwards from its goals. For formulas that count robots, read
`counted_conjuncts` (each conjunct by itself), `counted_landmarks` (propositions that must still become true or false) and `goal_cover` (the
paths that reach them, shared out among the robots).
"""
