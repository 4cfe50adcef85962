"""Modules that exported scripts fly by. Numbers come from `flight.json`; nothing of it needs ltlplan.

One core, of the standard library alone, serves these scripts and live links: `checks` before anything spins, `starts` before what is flown next, `watch` in flight, `ending` to hold, land and
stop, by `standing`, which tells when a robot stands. `supervisor` reads the reports of a Crazyflie, and `reports` those of PX4.
`record` writes what happens. With crazyswarm2 `crazyswarm` is all that knows its client, `simulator` its simulator, `paths` reads the CSV files, `before` looks and
`stages` flies. `px4` knows vehicles by MAVLink, and `streaming` sends them set-points under watch.
"""
