"""Engines, one door each, and the programmes that they solve.

`qp` (OSQP) is minimum snap with inequalities, `sparse_qp` (Clarabel) programmes of a whole team, `nlp` frees times and states (`programme` is what it hands to `ipopt_engine`, which is
IPOPT through CasADi), and `retiming` (cvxpy) finds how fast a given path can be flown; `fastest` puts the last two together.
`timeout` ends runs that take too long.
"""
