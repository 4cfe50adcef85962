"""Nominal paths and their improvement: where a robot flies to show its word, and cheaper ways to do so.

Read `nominal` (a path for each robot of an allocation), `hoops` (control points, primitives, avoidance), then `path_problem`, `cross_entropy` over `gaussian` and `populations`,
`path_result`, and `improvement`, which joins them. Sampled paths are judged as arrays in `sampled_paths`, by `costs`, through `least_snap_spline`; `quantile` draws
samples, and `final_hover` sets a closing hover aside.
"""
