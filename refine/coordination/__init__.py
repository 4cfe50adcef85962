"""Robots in each other's way: who departs when, who waits where, who gives way to whom.

Read `team_flights`, which tries one means after the other, `alternative_ways` (of flying, where those do not do), and `departures`, the
first of them for few robots (`departing_teams`: with paths clear of others). `avoidance` bends paths around each other, of a few robots or
of all that meet at once, which is the first means for many. `clocks` retimes robots that wait for each other, and `common_clock` hurries
robots that are kept apart. `midway_waits` and `safe_intervals` let robots wait on the way, and `spacing` says how far they keep apart.
`visit_ordering` and `meeting_orders` order visits; `visit_relocation` finds other places for them.
"""
