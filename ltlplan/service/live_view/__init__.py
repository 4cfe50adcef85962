"""Flights in the air as they are seen: `messages` is what a flight sends ten times a second, `hub` hands it to viewers, and stop orders back.

`pictures` draws the world and the tubes that are flown, and `foretelling` says what an event will do, both in a worker. `flight_recorder` keeps what was sent, for a flight to be replayed.
"""
