"""Candidates of a search as arrays of sampled points: what they are, what they show, which keep the word.

Read `path_problem` (points of a path as candidates), then `least_snap_spline` (the curve through them), `sampled_paths` (labels and runs)
and `word_filter`; for the search, never a claim.
"""
