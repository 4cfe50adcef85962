"""Proofs of certificates, written down for the kernel (`verify.kernel`) to check.

`proof_folder` is the door: the files of a proof, and their check. `statement` writes what is to be proved (`formula_tree` its formula). `finder`
finds the proof by `proposed_roots` and `proposed_limits` (trees, in floats), `search` (what floats leave open), `half_space_sums` (obstacles) and
`words` (formulas).
"""
