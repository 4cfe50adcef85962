"""Candidates of a search as arrays of sampled points: what they are, what they show, which keep the word.

Read `path_problem` (points of a path as candidates, and which paths keep the word), then `least_snap_spline` (the curve through them); for the search, never a claim.
"""
