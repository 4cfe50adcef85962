"""Proofs of certificates, written down for the kernel (`verify.kernel`) to check.

`formula_tree` writes a formula, and `words` finds what proves it.
"""
