"""Ways through a world with obstacles: free space, roadmaps, shortest ways, and what shuts a way.

Read `free_space` (the door: a mission's free space for one size of vehicle), then `visibility_graph` (a visibility graph in three dimensions), `graph_vertices`
(where a way may turn around a body), `inflated_bodies` (convex bodies grown by the clearance, and segments that meet them), `inflated_obstacles` (a
mission's obstacles as such bodies, with openings) and `path_shortcutting` (shorter ways, with room at the corners where there is some).
Everything is in floats, without chance and without a clock.
`bottlenecks` finds the narrowest place of the widest path where none fits.
"""
