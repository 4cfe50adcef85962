"""Limits of flight, and how far a spline uses them.

`limits` are the limits in SI units; `flatness` turns a path and a heading into thrust, attitude, rates and rotor thrusts.
`usage` samples how much of each limit is used, `excess` penalises what exceeds them, and `stretching` slows a flight down until all are kept.
"""
