"""The kernel: a small checker of proofs about flights, in whole numbers, that uses nothing but Python's standard library.

Read `statement` (what is to be proved), `flights` (what is flown), `polynomials` and `trees` (the rule that most rests on), and `checking`, which
calls the rest for each claim; what is not so is `refused`. `evidence` is the proof. Geometry: `bounds`, `bodies` and `timelines` (regions and visits),
`hoops`, `distances`, `limits`, `rotors`, `joints`, `orders`, `relations`. Words: `formulas` (what is left of a formula after a letter), `places`
(of one robot, from its `labels`), `team` (moves in spans of time), `words` (the invariant), `planned` (of planned words) and `transitions`. `report` prints.
"""

VERSION = 1
"""Raised whenever what is checked changes its meaning."""
