"""The kernel: a small checker of proofs about flights, in whole numbers, that uses nothing but Python's standard library.

Of words: `formulas` (what is left of a formula after a letter), `places` (of one robot, from its `labels`), `team` (moves in spans of time),
`words` (the invariant) and `transitions`. `statement` is what is to be proved, `evidence` the proof; what is not so is `refused`.
"""
