"""Certified online flight over a link, in real time.

Read `live_online_flight`, which leads the team from event to event; `flight_session` is its present state. `stopping` brings the team to
rest after an event, and `segment_handover` starts the next segment; `segment_monitor` watches one whose words are not proved yet.
`executors` answer queries beside the flight. `joining` and `leaving` change who is in the air. `measured_result` is the result, from
measurements.
"""
