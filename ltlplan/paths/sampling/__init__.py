"""Candidates of a search as arrays of sampled points: what they are, what they show, which keep the word.

Read `path_problem` (points of a path as candidates), then `least_snap_spline` (the curve through them) and `word_filter` (which
paths keep the word); for the search, never a claim.
"""
