"""Nominal paths and their improvement: where a robot flies to show its word, and cheaper ways to do so.

Read `nominal` (a path for each robot of an allocation) and `hoops` (control points, primitives, avoidance). Then `improvement`,
which joins the rest: `path_problem` (a path as a search problem), `cross_entropy` over `gaussian` and `populations`, and
`path_result` (back to waypoints). Many paths at once are splines in `least_snap_spline`, cost what `costs` says (its terms are in
`cost_terms`) and are sifted in `word_filter` by the word that they show (`sampled_paths` labels them and runs automata). `quantile`
is what online sharing draws by, and `final_hover` sets a closing hover aside.
"""
