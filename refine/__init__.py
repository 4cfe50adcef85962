"""From waypoints and a word to polynomials that a quadrotor can fly.

`refine(plan)` serves missions. Whoever has points and no mission takes `minimum_snap` (points and times), `time_optimal`
(points and limits) or `retime` (a path and limits), a heading from `heading_spline` or `least_spin`, and `quantise`; `split`
cuts a flight that is too long for the vehicle's memory.
"""

from refine.clock import ClockRanOut
from refine.fastest import time_optimal
from refine.limits import Limits, Rotors
from refine.minimum_snap import minimum_snap
from refine.parts import split
from refine.quantise import jumps, on_grid, quantise
from refine.retiming import retime
from refine.spline import Spline
from refine.team import refine
from refine.timing import stretch_to_limits
from refine.turning import least_spin, with_least_spin
from refine.yaw import heading_spline

__all__ = [
    "ClockRanOut",
    "Limits",
    "Rotors",
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
