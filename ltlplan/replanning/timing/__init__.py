"""Times of flights that formulas bound in seconds: how fast a team flies, and where it hovers for how long.

`presence` reads from a certificate what a refined flight shows when, and how that moves with pace and hovers; `requirements` writes a formula
as a mixed-integer programme over these, with chains of `stays` for what has to come again and again; `timetable` solves it (`alternatives` puts the hovers into the plan).
"""
