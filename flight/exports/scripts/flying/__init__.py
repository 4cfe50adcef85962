"""What the exported script beside this folder flies by. Numbers come from `flight.json`; nothing of it needs ltlplan.

`watch` says what robots are asked for before they fly and what must not go on, `record` writes what happens. With crazyswarm2 `crazyswarm` is all that
knows its client, `paths` reads the CSV files, `before` looks, `stages` flies and `ending` brings all to the ground. `px4` knows vehicles by MAVLink.
"""
