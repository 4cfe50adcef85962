"""Bodies that a path stays out of, and the roadmap around them, for planning and refinement alike.

Read `keep_out_bodies` (ellipsoids, rings and parts of regions, grown, with planes that part them from a leg) and `solid_body` (a convex
part of an obstacle, grown); `inflated_bodies` (each of them as a polyhedron or quadrics, many at a time, and segments that meet them); `gaps` (how wide they are between two bodies) and
`narrow_places` (where two robots cannot pass each other);
`visibility_graph` (a roadmap in three dimensions), `graph_vertices` (points where a way may turn around a body) and
`path_shortcutting` (shorter ways, with room at the corners where there is some).
"""
