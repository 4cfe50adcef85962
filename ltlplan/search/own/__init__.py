"""Plans for `team: own`, where each robot's word is read by itself and the formula must hold in every order of the robots.

Read `planning`, then `reading` (the states of the search).
"""
