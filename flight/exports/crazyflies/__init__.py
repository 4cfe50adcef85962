"""Exports for Crazyflies: their memory's bytes, plain and compressed, and crazyswarm2's files.

Read `crazyflie` (bytes and how they are sent) over `memory` and `fits`, then `compressed`; `crazyswarm` writes a folder for crazyswarm2 with
the configuration in `swarm_settings`: `parameters` are what firmware is told, `inventory` is the user's file.
`radio_addresses` reads and checks addresses by radio.
"""
