"""Robots that are read one at a time, followed apart from each other instead of all together.

Read `breaking_words` (what breaks a formula), `robots_apart` (the search over it, and why its answer is exact) with `robot_nodes`
(where one robot may be) and `mattering` (which robots count at all). `single_flights` puts a flight of each robot to a
counterexample, and `team_answers` asks Spot for a second opinion.
"""
