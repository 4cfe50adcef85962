"""What the exported script beside this folder flies by. Numbers come from `flight.json`; nothing of it needs ltlplan.

`checks` looks at robots before they fly, `standing` says when one that lands stands, `watch` what must not go on in flight, `record` writes what happens. With crazyswarm2
`crazyswarm` is all that knows its client, `simulator` its simulator, `paths` reads the CSV files, `before` looks, `stages` flies and `ending` brings all to the ground.
`supervisor` reads a Crazyflie's reports; `px4` knows vehicles by MAVLink, `reports` what they say.
`streaming` sends set-points to PX4 vehicles under watch.
"""
