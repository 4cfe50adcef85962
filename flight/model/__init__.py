"""Vehicles and the world they fly in, for any number of vehicles at once.

Read `airframe` (parameters), then `plant`: what an airframe model is, and the list of them; `full` and `paper` are ours. `full` is made of
`dynamics` (how a body with rotors moves) and `autopilot` (the loop on board), over rotations in `attitude`, and compiled for few
vehicles by `compiled`; `disturbances` are wind and battery, `sensing` is what is known of a flight, `ekf` the filter that vehicles carry,
`reference` is the flight that was planned, sampled, and `timing` the clock.
`numbers` says what counts as a number where a caller gives one.
"""
