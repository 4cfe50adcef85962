"""Motion of a team's polynomials for all times: positions, speeds, distances to each other, to rims and to obstacles.

Read `paths` (coefficients as they are exported, and the instants they cover) and the room `membership` (in which regions a robot
must, may or must not be), then one module a subject: `limits`, `rotors` (over `turned_frame`), `tilt`, `separation`, `passages`, `visits`, `continuity`, and
the room `obstacles` for obstacles, the room `braking` for what comes of holding at any instant; `planned_words` holds what a plan says against what is flown.
`regions` relates regions to each other (`convex_bodies`: of any shape); `leg_windows` says when a flight may be on its way to a visit,
`cutting` what is left of one from a time on.
`broad_phase` leaves out what is provably apart; `shifted_distances` bounds distances under clocks that differ. `standing` says when a path stands still.
"""
