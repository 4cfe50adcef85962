"""Ways through a world with obstacles: roadmaps of free space, shortest ways on them, and what shuts a way.

Read `roadmap` (a visibility graph in three dimensions), then `bends` (where a way may turn around a body), `solid_bodies` (convex bodies grown by the clearance, and segments that meet them) and `straightening`
(shorter ways, with room at the corners where there is some). Everything is in floats, without chance and without a clock.
"""
