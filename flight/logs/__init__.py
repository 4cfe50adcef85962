"""Flights on disk: logs that we write and read back, and recordings that others made.

`log` is the value and `tables` its files (`mcap_file` for viewers, `own_logs` has them as recordings; `large_logs` keeps those of many
robots small). `importers` is the door to what others recorded: plain tables (`recordings`), exports of `motion_capture`, ROS 2 `bags` (`chunks`
keeps them small), PX4's `ulog`, and folders of `robot_files`, which `clocks` brings together. `import_options` is what a person says of a
recording, `units` what no file says, and `placed` brings what was measured to the mission's frame.
"""
