"""Times of flights that formulas bound in seconds: in which order visits are made, how fast a team flies, and where it hovers for how long.

Before any flight, `horizons` finds windows that no flight fits. `visit_orders` finds the orders of the visits that a formula asks for which may be in
time by straight ways. `plans_in_time` plans words that are, and `returns` finds returns that no lap can make in time. `presence` reads from a
certificate what a refined flight shows when, and how that moves with pace and hovers. `requirements` writes a formula as a mixed-integer programme
over these, with chains of `stays` for what has to come again and again. `timetable` solves it (`alternatives` puts the hovers into the plan).
`other_orders` is what comes next where no times help.
"""
