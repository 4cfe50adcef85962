"""Identification: what an airframe weighs, how much its rotors push and drag, and how late its cameras are, from a recorded flight.

Read `identify`; `recorded` reads the table, `least_squares` fits it and says how sure that is, `profile` writes what was found.
"""
