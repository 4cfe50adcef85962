"""Nominal paths and their improvement: where a robot flies to show its word, and cheaper ways to do so.

Read `nominal` (a path for each robot of an allocation) and `hoops` (control points, primitives, avoidance). Then `improvement`,
which joins the rest: `sampling` (a path as a search problem, its candidates as arrays), `cross_entropy` (cross-entropy) and `path_result`
(back to waypoints). Many paths at once cost what `costs` says (its terms are in `cost_terms`); `k_best_words` says what
words cost before there are paths, `flight_times` what they take, and `final_hover` sets a closing hover aside.
`team_laps` lays the paths of a team's cycles, and `unnamed_regions` leaves out what the formula does not name where it is in nobody's way.
`optimiser` is an earlier place of `cross_entropy`.
"""
