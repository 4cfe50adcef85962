"""Splines of degree seven: the value, least snap through points at given times, and float32 at the end.

Read `spline` (the spline as the states at its nodes) and `basis`, then `least_snap` (`snap_family`: the same as a function of durations and nodes, with gradients). `rounding` brings a spline to the
vehicle's own numbers, and `parts` cuts what its memory cannot hold.
"""
