"""Flights that others planned: files of other programs, judged for all times at the size of a show.

Read `auditing` (the door: what is asked, what is claimed), `fleet` (every piece of every drone in a few arrays), then how files become one:
`importers`, `crazyswarm_folders`, and the room `shows`. `distances` judges separation on what `near_pieces` cannot prove to
be apart, `extremes` everything that one drone does by itself, `fences` a geofence's polygons, `joints` how pieces join, `letters` a mission's formula and obstacles. What a show requires of itself is read in `shows`.
`audit_requirements` puts limits together, `fleet_claims` says what is claimed of all drones, and `instants` finds the tightest times. `columns` and `column_claims` judge take-off and landing, `windows`
where a separation counts, and `yaw` headings.
"""
