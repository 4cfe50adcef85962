"""Plans for `team: own`, where each robot's word is read by itself and the formula must hold in every order of the robots.

Read `planning`, then `reading` (the states of the search). `insertion` shares many tasks where the highest cost of a robot counts, over
`task_paths` (what tasks cost single robots).
"""
