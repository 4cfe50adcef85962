"""Missions and trajectories as files: YAML and CSV in, values out, every fault at once and each at its line.

Read `mission_file`, then `mission_tree` (what a file says, as plain values) and `mission_rooms` (what it includes); `key_synonyms` are other words for keys, `trajectory_csv` is
what vehicles are given.
"""
