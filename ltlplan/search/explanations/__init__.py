"""Explanations of missions without a plan, and changes that would make one possible.

Read `unsatisfiable_cores` (requirements that cannot hold together, and edges and regions that would have to be there, or be open), then
`reasons` (what stands in their way and what they need, found in `relaxed_systems`; `inquiry` is what they ask about), `relaxation` (what to leave out, the cheapest way) and `max_weight_subset` (which soft parts to keep).
`no_plan` explains a finite mission without a plan, `count_laws` counts that contradict each other, `held_letters` a formula that no precedences help.
"""
