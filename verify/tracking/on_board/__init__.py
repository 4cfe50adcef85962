"""The proof of tracking for `mellinger` on the filter on board.

Read `slopes` and `rotations`, the numbers, then `onboard_model` and `onboard_filter`, the laws in them. `onboard_loop` is a linear loop near these,
`onboard_responses` its sums, and `onboard_laws` holds what is beside it. `onboard_plan` follows a plan without disturbances, and `onboard_proof` closes the bounds.
"""
