"""Engines, one door each, and the programmes that they solve.

`qp` (OSQP) is minimum snap with inequalities, `nlp` (IPOPT through CasADi) frees times and states, and `retiming` (cvxpy) finds
how fast a given path can be flown; `fastest` puts the last two together. `timeout` ends runs that take too long.
"""
