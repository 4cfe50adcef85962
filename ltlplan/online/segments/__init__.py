"""Certified flight segments of a team whose tasks are reassigned: proved before they are flown, and left only by proved stops.

Read `certified_team`, the team that flies nothing else. It is a `segmented_flight`: its present segment, those before, and what of them is
proved. `braking` brings it to rest, and `segment_planning` finds the next segment. `time_left` is what is left of bounds in seconds,
`deadlines` what can no longer be met.
"""
