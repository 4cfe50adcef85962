"""Why there is no plan, and what would make one possible.

Read `unsatisfiable_cores` (requirements that cannot hold together), then `altered_systems` (what stands in their way), `relaxation` (what
to leave out, the cheapest way) and `most_weight` (which soft parts to keep).
"""
