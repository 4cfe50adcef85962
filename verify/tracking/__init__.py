"""The proof that a stated controller keeps a vehicle near its plan under stated disturbances (docs/tracking.md).

Read `sampled_loop` (kernels of linear loops, every rounding counted) and `loops` (those of the geometric controller). `plan_samples` samples a path,
`flatness` what is fed forward, and `given` set-points as they are sent. `error_model` holds the values. `tilts`, `circumstances` and `remainders` bound what
drives the loops, and `nominal` what is known of it. `proof` closes the bounds.

`mellinger` on the filter on board is in `on_board`.
"""
