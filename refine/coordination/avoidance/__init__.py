"""Robots that keep apart by bending their paths around each other.

Read `conflict_resolution`, the way in for two or a few robots that meet: `reciprocal_avoidance` fits their paths. `joint_avoidance` is the
way in for many: it bends all paths at once (`joint_bending`). Both begin with when and how near robots come, `conflict_intervals`.
"""
