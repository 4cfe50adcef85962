"""Where regions are: shapes as mission files name them, compiled once to inequalities that everyone else asks.

Read `inequalities` (the compiled form), then `region` (a body somewhere in the world), then `region_shapes`, the table through which
packages bring shapes.
"""
