"""Free space among obstacles: visibility graphs, shortest paths, and bottlenecks.

Read `free_space` (the door: a mission's free space for one size of vehicle), then `inflated_obstacles` (a mission's obstacles grown by
the clearance, with openings). Bodies and the roadmap around them are those of `refine.obstacles`.
Everything is in floats, without chance and without a clock.
`bottlenecks` finds the narrowest place of the widest path where none fits.
"""
