"""Many tasks, shared in tours: what grows with tasks and robots, where sets of tasks grow as 2^n.

Read `many_tasks`, then `task_kinds` (the decomposition set, conjunct by conjunct), `shared_tours` (the tasks of each robot, in order) and
`task_tours` (their costs over the graph of the exact search).
"""
