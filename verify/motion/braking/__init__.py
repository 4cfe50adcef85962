"""Braking to a hover from any instant of a flight, for all instants and all of the braking at once.

Read `braking_polynomials` (where braking leads, as polynomials), `patches` (the same over a part of a flight and a part of the braking, to be
halved in both) and `branching`, then what is asked of them: `pairs`, how near robots come to one another (`swept_boxes`: whose braking can meet), and
`surroundings`, how near to what stands around them, which `targets` and `closed_regions` tell.
"""
