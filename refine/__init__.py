"""From waypoints and a word to polynomials that a quadrotor can fly.

`refine(plan)` serves missions; `minimum_snap` serves whoever has points and times and no mission.
"""

from refine.fastest import time_optimal
from refine.limits import Limits, Rotors
from refine.minimum_snap import minimum_snap
from refine.quantise import jumps, quantise
from refine.spline import Spline
from refine.team import refine

__all__ = ["Limits", "Rotors", "Spline", "jumps", "minimum_snap", "quantise", "refine", "time_optimal"]
