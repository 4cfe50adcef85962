"""Free space among obstacles, and its bottlenecks.

Read `free_space` (the entry point: a mission's free space for one size of vehicle), then `inflated_obstacles` (a mission's obstacles, inflated by the
clearance, with openings). Bodies and the roadmap around them are those of `refine.obstacles`. `staying_inside` keeps ways in rooms with corners. `bottlenecks` finds the narrowest place of the
widest path where none fits. All is in floats, without random draws and without a clock.
"""
