"""Whether a robot is inside its tube at every time, as far as samples can tell.

Between two samples `gap` seconds apart a robot strays from the chord of its tracking error by at most A gap^2 / 8, A being
a bound on its acceleration relative to the plan; a measured distance is off by at most the measurement's bound. So
the error is below max(e1, e2) + bound + A gap^2 / 8 at every time between.
"""

from __future__ import annotations

import math
from typing import Literal

from verify.data import GRAVITY, Vehicle

TubeVerdict = Literal["inside", "unknown", "outside"]

_DRAG = 2.0
_DRAG_PER_SPEED = 0.05
"""m/s^2, and 1/m times the square of the greatest speed: more than the air's drag on any shipped airframe."""


def relative_acceleration(vehicle: Vehicle, planned: float) -> float:
    """Return a bound on the acceleration of a flown path relative to its plan, m/s^2.

    Args:
        vehicle: Its four rotors at their greatest are the most that can push it.
        planned: A bound on the planned acceleration, m/s^2.
    """
    drag = _DRAG + _DRAG_PER_SPEED * vehicle.speed**2
    return 4.0 * vehicle.rotor_thrust_max / vehicle.mass + GRAVITY + drag + planned


class Tube:
    """One robot's tube, sample by sample.

    Attributes:
        verdict: `inside` while it is proved for all times up to the last sample; `unknown` once it cannot be;
            `outside` once a sample proves the contrary. It never goes back.
        bound: The largest error, m, that cannot be ruled out at any time so far.
    """

    def __init__(self, margin: float, measurement: float, acceleration: float) -> None:
        self._margin, self._measurement, self._acceleration = margin, measurement, acceleration
        self._time: float | None = None
        self._error = 0.0
        self.verdict: TubeVerdict = "inside"
        self.bound = 0.0

    def see(self, time: float, error: float) -> TubeVerdict:
        """Take one sample: the measured distance from the plan, m; NaN where the robot was not seen."""
        if math.isnan(error):
            # Whatever the next sample will say, the gap may be too long already; and before the first nothing is known.
            self._raise_bound(math.inf if self._time is None else self._error + self._between(time - self._time))
            return self.verdict
        gap = 0.0 if self._time is None else time - self._time
        worst = error if self._time is None else max(error, self._error)
        self._time, self._error = time, error
        self._raise_bound(worst + self._between(gap))
        if error - self._measurement >= self._margin:
            self.verdict = "outside"
        return self.verdict

    def _between(self, gap: float) -> float:
        return self._measurement + self._acceleration * gap * gap / 8.0

    def _raise_bound(self, bound: float) -> None:
        self.bound = max(self.bound, bound)
        if self.verdict == "inside" and not bound < self._margin:
            self.verdict = "unknown"
