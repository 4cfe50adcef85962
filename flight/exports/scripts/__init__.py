"""Scripts that exports carry along, for machines without ltlplan: each is copied as it stands, and reads its numbers from `flight.json`.

`fly_mission` flies Crazyflies with crazyswarm2, `stream_setpoints` streams to PX4 vehicles. Both look before they fly, and in flight, and write what happened, by modules
of `flying` beside them, with Python 3.10 of ROS 2 Humble. Modules of `flying` that import each other by a dot are the core of every flight: live links go by them, too.
"""
