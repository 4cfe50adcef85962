"""Robots that are read one at a time, followed apart from each other instead of all together.

Read `violation_automaton` (what breaks a formula), `compositional_check` (the search over it, and why its answer is exact) with `robot_nodes`
(where one robot may be) and `relevant_robots` (which robots count at all). `counterexample_assembly` puts a flight of each robot to a
counterexample, and `team_answers` asks Spot for a second opinion.
"""
