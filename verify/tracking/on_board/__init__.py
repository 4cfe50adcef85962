"""The proof of tracking for `mellinger` on the filter on board.

Read `slopes` and `rotations`, the numbers, then `onboard_model` and `onboard_filter`, the laws in them, which `onboard_laws` gathers. `onboard_loop` is a linear loop near
a hover, `onboard_responses` its outputs, and `onboard_plan` follows a plan with them, without disturbances. `onboard_course` has the linear loops along that flight, `onboard_sums`
sums what inputs do in them, `onboard_remainders` is what laws are beside them, and `onboard_proof` closes the bounds.
"""
