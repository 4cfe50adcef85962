"""Robots on paths that stay as they are, each on a clock of its own.

Read `own_clocks`, the way in: it retimes a team after `passing_orders` has decided who passes first. Times come from `earliest_times` while
orders are sought, and from one programme at the end, in `clock_programme`.
"""
