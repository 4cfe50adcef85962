"""Shapes of regions as mission files name them, compiled once to inequalities that all packages use.

Read `inequalities` (the compiled form), `conditions` (how it is asked exactly), `convex_parts` and `measures` (in floats), then `region`
(a body somewhere in the world) and `region_shapes`, the table of shapes, whose own are in `solids` and `unions`. `covers` joins parts
across faces that they share, `nearest` says how far bodies are from points; `obstacle` and `solid_parts`
are what is solid.
`placed_body` is what regions, hoops and obstacles have in common.
"""
