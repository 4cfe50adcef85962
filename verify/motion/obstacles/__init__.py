"""Distances of paths to solid bodies, for all times.

Read `half_spaces` (what a plane proves of a stretch of a path beside a convex part; `tangents`: of quadrics), `openings`, then `part_tables`
and `bodies` (many at once) and `approaches`, the branch and bound over time. `points` refutes: one instant and one solid point.
"""
