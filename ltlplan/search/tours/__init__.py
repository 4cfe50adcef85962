"""Many tasks, shared in tours: what grows with tasks and robots, where sets of tasks grow as 2^n.

Read `task_kinds` (the decomposition set, conjunct by conjunct), then `shared_tours` (the tasks of each robot, in order) and
`task_tours` (their costs over the graph of the exact search). MTAC-E and the exact search for the robot with the highest cost share tasks so.
"""
