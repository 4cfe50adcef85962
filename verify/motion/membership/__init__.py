"""Membership: in which regions a robot must, may or must not be, for all times.

Read `statuses` (the door), then `polynomials` (a region's inequalities along a path), `subdivision` (how they are sorted), `boundary_crossings`
(crossings at margin 0, exactly) and `bodies` (what the inequalities' answers come to for a region).
"""
