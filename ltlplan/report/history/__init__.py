"""Histories of sampled flights: letters, bounds in seconds, and what is left of the formula over time.

Read `letters` (what each robot shows, and which sub-formulas hold), `bounds` (the same of bounds in seconds, with slack), and `to_do` (what is still to do).
"""
