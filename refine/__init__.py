"""Refinement of waypoints and a word to polynomials that a quadrotor can fly.

`refine(plan)` serves missions. For points without a mission there are `minimum_snap` (points and times), `time_optimal` (points and limits) and
`retime` (a path and limits), a heading by `heading_spline` or `least_spin`, and `quantise`; `split` cuts a flight that is too long for the
vehicle's memory.

Read `team` (`laps` for synchronised cycles, over `lap_missions`; `parts` and `team_pauses` for flights that exceed a vehicle's memory), then `single_robot` (one robot
as if alone) and `coordination` (all of them), over `corridor`, `solvers`, `heading`, `limits` and `spline`. `obstacles` and `planes` are what flights
stay out of. `slowing` flies a certified team more slowly where it strays. `rest_to_rest` puts the flights between two hovers on a common clock. `alternatives` tries a plan's own fall-backs in order, `refusals` says why none
does, and `feedback` turns the checker's witnesses into changes of the next attempt.
"""

from __future__ import annotations

from verify.data.names.loading import loaded_at_first_use

TYPE_CHECKING = False  # type checkers take it for True
if TYPE_CHECKING:
    from refine.heading.spin import least_spin, with_least_spin
    from refine.heading.yaw import heading_spline
    from refine.limits.limits import Limits, Rotors
    from refine.limits.stretching import stretch_to_limits
    from refine.solvers.fastest import time_optimal
    from refine.solvers.retiming import retime
    from refine.solvers.timeout import SolverTimeout
    from refine.spline.least_snap import minimum_snap
    from refine.spline.parts import split
    from refine.spline.rounding import jumps, on_grid, quantise
    from refine.spline.spline import Spline
    from refine.team import refine

__all__ = [
    "Limits",
    "Rotors",
    "SolverTimeout",
    "Spline",
    "heading_spline",
    "jumps",
    "least_spin",
    "minimum_snap",
    "on_grid",
    "quantise",
    "refine",
    "retime",
    "split",
    "stretch_to_limits",
    "time_optimal",
    "with_least_spin",
]

if not TYPE_CHECKING:  # which know all names from above, so that a misspelt one is an error to them
    __getattr__, __dir__ = loaded_at_first_use(
        __name__,
        {
            "refine.heading.spin": ("least_spin", "with_least_spin"),
            "refine.heading.yaw": ("heading_spline",),
            "refine.limits.stretching": ("stretch_to_limits",),
            "refine.limits.limits": ("Limits", "Rotors"),
            "refine.solvers.fastest": ("time_optimal",),
            "refine.solvers.retiming": ("retime",),
            "refine.solvers.timeout": ("SolverTimeout",),
            "refine.spline.least_snap": ("minimum_snap",),
            "refine.spline.parts": ("split",),
            "refine.spline.rounding": ("jumps", "on_grid", "quantise"),
            "refine.spline.spline": ("Spline",),
            "refine.team": ("refine",),
        },
    )
