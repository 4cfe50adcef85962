"""Scripts that exports carry along, for machines without ltlplan: each is copied as it stands, and reads its numbers from `flight.json`.

`fly_mission` flies Crazyflies with crazyswarm2 (`crazyswarm_robots` is all that knows its client), `stream_setpoints` streams to PX4 vehicles
(`px4_robots`). Both look before they fly, and in flight, by `flight_watch`, and write what happened by `flight_record`. They find each other by
their file names, where they lie side by side, and run with Python 3.10 of ROS 2 Humble.
"""
