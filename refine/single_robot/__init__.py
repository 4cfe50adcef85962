"""One robot's flight, as if it were alone: a smooth path that shows the plan's visits, its pace and its heading.

Read `task` (what travels), then `flight`, which puts the stages together: `visits_shown` looks for a path that shows the planned
visits, `pacing` gives it times that its limits allow, and `time_optimised` makes it as fast as they allow, from the durations that `least_time` finds.
`hovers` puts rests into it.
"""
