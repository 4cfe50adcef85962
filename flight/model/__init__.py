"""Vehicles and the world they fly in, for any number of vehicles at once.

Read `airframe` (parameters) and `dynamics` (how a vehicle moves), over rotations in `attitude`; `disturbances` are wind and
battery, `sensing` is what is known of a flight, and `reference` is the flight that was planned, sampled.
"""
