"""Robots inside their tubes at every time, as far as samples can decide it in flight.

Between two samples `gap` seconds apart a robot strays from the chord of its tracking error by at most A gap^2 / 8, A being
a bound on its acceleration relative to the plan; a measured distance is off by at most the measurement's bound. Where pieces of
the plan meet, its position may jump and its velocity turn a little: the error strays by the jumps, and by a quarter of the turn times
the gap. So it is below max(e1, e2) + bound + A gap^2 / 8 + jumps + turns gap / 4 at every time between. Before the first sample and
after the last one it grows as fast as the samples beside allow.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal

from verify.data import GRAVITY, Mission, Vehicle
from verify.motion.continuity import JUMPS
from verify.recordings.planned_paths import PlannedPath

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


def stray_at_joints(path: PlannedPath | None, start: float, stop: float, paused: float = 0.0) -> float:
    """Bound how far the plan's joints move the error off its chord from `start` to `stop`, m.

    Without the path that is what a certificate allows at one joint: its pieces are taken to be longer than the gaps between samples.

    Args:
        path: The plan, or None.
        start: s of the plan's clock.
        stop: s of the plan's clock.
        paused: s in between in which the plan's clock stood still.
    """
    gap = stop - start + paused
    if path is None:
        return JUMPS[0] + JUMPS[1] * gap / 4
    jumped, turned = path.strayed(start, stop)
    return jumped + turned * gap / 4


def stray_between_steps(mission: Mission, paths: Mapping[str, PlannedPath], step: float) -> float:
    """Return how much farther from its plan any robot may be between two steps of a simulation than at them, m.

    It strays from the chord of its error by at most A h^2 / 8, and where pieces meet.

    Args:
        mission: Says what they fly.
        paths: The plan of each robot.
        step: h, s.
    """
    planned = max(path.acceleration for path in paths.values())
    pushed = max(relative_acceleration(mission.vehicle_of(robot), planned) for robot in paths) * step * step / 8.0
    return pushed + max(stray_at_joints(path, time - step, time + step) for path in paths.values() for time in path.joints)


class Tube:
    """One robot's tube, sample by sample.

    Attributes:
        verdict: `inside` while it is proved for all times from the flight's start to the last sample; `unknown` once it
            cannot be; `outside` once a sample proves the contrary. It never goes back.
        bound: The largest error, m, that cannot be ruled out at any time so far.
    """

    def __init__(self, margin: float, measurement: float, acceleration: float, path: PlannedPath | None = None) -> None:
        self._margin, self._measurement, self._acceleration, self._path = margin, measurement, acceleration, path
        self._time: float | None = None
        self._paused = 0.0
        self._error, self._rate = 0.0, math.inf
        self._late = 0.0
        self.verdict: TubeVerdict = "inside"
        self.bound = 0.0

    def see(self, time: float, error: float, paused: float = 0.0) -> TubeVerdict:
        """Take one sample.

        Args:
            time: s.
            error: The measured distance from the plan, m; NaN where the robot was not seen.
            paused: s up to it in which the plan's clock stood still, all pauses between parts together.
        """
        if math.isnan(error):
            # Whatever the next sample will say, the gap may be too long already; and before the first nothing is known.
            if self._time is None:
                self._raise_bound(math.inf)
            else:
                self._raise_bound(self._error + self._along_chord(time - self._time, self._stray(self._time, time, paused)))
            return self.verdict
        if self._time is None:
            self._late = max(time, 0.0)
            self._raise_bound(error + self._measurement)
        elif time > self._time:
            gap, stray = time - self._time, self._stray(self._time, time, paused)
            self._raise_bound(max(error, self._error) + self._along_chord(gap, stray))
            turn = self._acceleration * gap + 4 * stray / gap
            self._rate = (error + self._error + 2 * self._measurement) / gap + turn
            if self._late > 0:
                self._raise_bound(self._error + self._beyond(0.0, self._late))
                self._late = 0.0
        self._time, self._error, self._paused = time, error, paused
        if error - self._measurement >= self._margin:
            self.verdict = "outside"
        return self.verdict

    def end(self, time: float) -> TubeVerdict:
        """Take the flight as over at a time, s: what no sample covers cannot be told."""
        if self._time is None or self._late > 0:
            self._raise_bound(math.inf)
        elif time > self._time:
            self._raise_bound(self._error + self._beyond(self._time, time))
        return self.verdict

    def _stray(self, start: float, stop: float, paused: float) -> float:
        """Bound what the plan's joints do from the last sample to another one."""
        return stray_at_joints(self._path, start - self._paused, stop - paused, paused - self._paused)

    def _along_chord(self, gap: float, stray: float) -> float:
        return self._measurement + self._acceleration * gap * gap / 8.0 + stray

    def _beyond(self, start: float, stop: float) -> float:
        """Bound what the error grows by where samples lie on one side only, going by its rate between the two next to it."""
        gap = stop - start
        grown = self._rate * gap + self._acceleration * gap * gap / 2.0
        return self._measurement + grown + 4 * stray_at_joints(self._path, start - self._paused, stop - self._paused)

    def _raise_bound(self, bound: float) -> None:
        self.bound = max(self.bound, bound)
        if self.verdict == "inside" and not bound < self._margin:
            self.verdict = "unknown"
