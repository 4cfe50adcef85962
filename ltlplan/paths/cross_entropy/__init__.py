"""Cross-entropy optimisation of a nominal path (Algorithm 2 of the 2019 paper).

Read `cross_entropy` (a whole round at a time), then `gaussian` (what candidates are drawn from, one or several that compete) and
`quantile` (the threshold).
"""
