"""The cheapest laps of a team by labels of what was paid so far, of which no dominated one is followed: one sum, or each robot's own cost.

Read `cheapest_laps`, then `lap_search`, the search, over `lap_places`; its bounds are of each robot alone (`lap_shares`) and of what is left of a
lap (`lap_bounds`). An answer is exact: a lap is judged by what it does to the automata's states, whatever these are where it begins.
"""
