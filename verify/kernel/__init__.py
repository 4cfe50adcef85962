"""The kernel: a small checker of proofs about flights, in whole numbers, that uses nothing but Python's standard library.

Read `statement` (what is to be proved), `flights` (what is flown), `polynomials` and `trees` (the rule that most rests on), and `checking`, which
calls the rest for each claim. Geometry: `zones` (regions, obstacles, hoops), `timelines` (visits, passages, waits),
`limits`, `distances`. Words: `formulas` (what is left of a formula after a letter), `places` (of one robot), `team` (moves in spans of
time) and `words` (the invariant). `report` prints.
"""

VERSION = 4
"""Raised whenever what is checked, or how it is written down, changes its meaning."""
