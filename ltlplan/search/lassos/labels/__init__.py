"""Laps of a team by labels that keep each robot's own cost apart, of which no dominated one is followed.

Read `dearest_team_laps`, then `dearest_laps`, the search, over `lap_places`; its bounds are of each robot alone (`lap_shares`) and of what is left of a
lap (`lap_bounds`).
"""
