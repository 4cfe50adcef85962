"""Robots in each other's way: who departs when, who waits where, who gives way to whom.

Read `team_flights`, which tries one means after the other, `alternative_ways` (of flying, where those do not do), and `departures`, the first of them for few robots (`departing_teams`: with paths clear of others); the first for many is
`joint_avoidance`, which bends the paths of all that meet at once (`joint_bending`). `own_clocks` retimes robots that wait for each other, after `passing_orders` has decided who passes first (by
`earliest_times`), by `clock_programme`. `conflict_resolution` and
`reciprocal_avoidance` bend paths around each other (`conflict_intervals`: when and how near they come), `midway_waits` and `safe_intervals`
let robots wait on the way, `common_clock` hurries robots that are kept apart, and `spacing` says how far they keep apart.
`visit_ordering` and `meeting_orders` order visits; `visit_relocation` finds other places for them.
"""
