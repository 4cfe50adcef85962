"""Flights of third-party planners: files of other programs, checked for all times at the size of a show.

Read `auditing` (the entry point) and `fleet` (every piece of every drone in a few arrays). Files become a fleet by `importers`, `crazyswarm_folders` and
the subpackage `shows`, which also holds a show's own requirements. `audit_requirements` puts limits together. `distances` checks separation where
`near_pieces` cannot prove pieces to be apart, `extremes` each drone by itself, `joints` how pieces join, `letters` a mission's formula and
obstacles, `columns` and `column_claims` take-off and landing, `yaw` headings. `windows` are the times at which a separation counts,
`fleet_claims` the claims on all drones, and `instants` the tightest times. `audit_proof` states what holds for the kernel, of
`rounded_paths`.
"""
