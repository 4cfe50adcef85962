"""Planned position of a robot at any instant: its certified polynomials evaluated with proved errors.

Recorded flights are compared with these values, at times that are floats: what evaluation loses, what the float of a time is off,
and the jumps where pieces meet are all bounded.
"""

from __future__ import annotations

import bisect
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from verify.arithmetic.balls import Balls
from verify.data.mission import Mission
from verify.data.trajectory import Trajectory
from verify.motion.paths import TeamPaths, read_team
from verify.motion.separation import step_length

Floats = NDArray[np.float64]

_EPSILON = 2.0**-53


@dataclass(frozen=True, eq=False)
class PlannedPath:
    """One robot's planned path, from time 0; it hovers after its end.

    Attributes:
        robot: Name.
        knots: Start of each piece and end of the last, s (rounded). Shape (pieces + 1,).
        coefficients: x, y, z; ascending powers. Shape (pieces, 3, 8).
        fastest: Bound on the speed over all times, m/s.
        acceleration: Bound on |r''| over all times, m/s^2.
        joints: Times at which pieces meet, s (rounded), in order. Shape (joints,).
        jumps: Bounds on how far the position jumps there, m. Shape (joints,).
        turns: Bounds on how far the velocity does, m/s. Shape (joints,).
    """

    robot: str
    knots: Floats
    coefficients: Floats
    fastest: float
    acceleration: float
    joints: Floats
    jumps: Floats
    turns: Floats

    @property
    def end(self) -> float:
        """Time at which the path ends, s (rounded)."""
        return float(self.knots[-1])

    def position(self, times: Floats, off: Floats) -> tuple[Floats, Floats]:
        """Return positions, m, shape (n, 3), and bounds on what they are off, m, shape (n,).

        Args:
            times: s; before the start it is the start's place. Shape (n,).
            off: How far each time may be from the one that is meant, s. Shape (n,).
        """
        values, size = self._placed(times)
        speed = self.speed(times, off)
        rounding = off + 4 * np.spacing(np.abs(times) + self.end)
        return values, 64 * _EPSILON * size.sum(axis=1) + speed * rounding + 1e-15

    def places(self, times: Floats) -> Floats:
        """Return positions in plain floats, m. Shape (n, 3)."""
        return self._placed(times)[0]

    def velocity(self, times: Floats) -> Floats:
        """Return velocities, m/s, in plain floats. Shape (n, 3)."""
        piece, local = self._local(times)
        slopes = self.coefficients[..., 1:] * np.arange(1, self.coefficients.shape[-1])
        moving = (times >= 0) & (times <= self.end)
        return np.where(moving[:, None], self._evaluated(slopes[piece], local)[0], 0.0)

    def speed(self, times: Floats, reach: Floats) -> Floats:
        """Bound the speed within `reach` seconds of each time, m/s. Shapes (n,)."""
        speed = np.linalg.norm(self.velocity(times), axis=1) * (1 + 1e-9) + 1e-9
        return speed + self.acceleration * (reach + 1e-9) + self.turned(times - reach, times + reach)

    def jumped(self, start: Floats, stop: Floats) -> Floats:
        """Bound how far the position jumps in all from `start` to `stop`, m. Shapes (n,)."""
        return self._summed(self.jumps, start, stop)

    def turned(self, start: Floats, stop: Floats) -> Floats:
        """Bound how far the velocity jumps in all from `start` to `stop`, m/s. Shapes (n,)."""
        return self._summed(self.turns, start, stop)

    @cached_property
    def _totals(self) -> tuple[list[float], list[float], list[float]]:
        """Joints, and the jumps and turns summed up to each, as Python's numbers."""
        return self.joints.tolist(), _sums(self.jumps).tolist(), _sums(self.turns).tolist()

    def strayed(self, start: float, stop: float) -> tuple[float, float]:
        """Return what `jumped` and `turned` bound, of one stretch of time: m and m/s.

        Args:
            start: s.
            stop: s.
        """
        joints, *totals = self._totals
        first, last = bisect.bisect_left(joints, start - 1e-6), bisect.bisect_right(joints, stop + 1e-6)
        jumped, turned = (max(total[last] - total[first], 0.0) + 1e-12 * (last > first) for total in totals)
        return jumped, turned

    def _summed(self, values: Floats, start: Floats, stop: Floats) -> Floats:
        total = _sums(values)
        first = np.searchsorted(self.joints, start - 1e-6, side="left")
        last = np.searchsorted(self.joints, stop + 1e-6, side="right")
        return np.asarray(np.maximum(total[last] - total[first], 0.0) + 1e-12 * (last > first), np.float64)

    def _local(self, times: Floats) -> tuple[NDArray[np.intp], Floats]:
        piece = np.clip(np.searchsorted(self.knots, times, side="right") - 1, 0, len(self.knots) - 2)
        return piece, np.clip(times - self.knots[piece], 0.0, np.diff(self.knots)[piece])

    def _placed(self, times: Floats) -> tuple[Floats, Floats]:
        piece, local = self._local(times)
        return self._evaluated(self.coefficients[piece], local)

    @staticmethod
    def _evaluated(coefficients: Floats, local: Floats) -> tuple[Floats, Floats]:
        """Evaluate by Horner's rule; the second value is the sum of the terms' sizes, which bounds the rounding."""
        values, size = np.zeros(coefficients.shape[:2]), np.zeros(coefficients.shape[:2])
        for power in range(coefficients.shape[-1] - 1, -1, -1):
            values = values * local[:, None] + coefficients[..., power]
            size = size * local[:, None] + np.abs(coefficients[..., power])
        return values, size


def _sums(values: Floats) -> Floats:
    """Return upper bounds of the sums of the first values, none to all. Shape (n,) to (n + 1,)."""
    return np.r_[0.0, np.cumsum(values)] * (1 + 1e-12)


@np.errstate(all="ignore")
def planned_paths(mission: Mission, team: Mapping[str, Trajectory]) -> dict[str, PlannedPath]:
    """Read what a team is to fly, all laps of a cycle included.

    Raises:
        BadInput: The robots are not the mission's agents.
    """
    finite = mission.spec.model_copy(update={"trace": "finite"})
    flown = {name: trajectory.flattened(mission.spec.repeat) for name, trajectory in team.items()}
    paths = read_team(mission.model_copy(update={"spec": finite}), flown)
    return {name: _path(paths, index) for index, name in enumerate(paths.robots)}


def _path(paths: TeamPaths, robot: int) -> PlannedPath:
    trajectory = paths.trajectories[robot]
    rows = paths.piece_owner == robot
    first, second = paths.derivative(1)[rows, :3], paths.derivative(2)[rows, :3]
    steps = [i for i, s in enumerate(paths.segments) if s.robot == robot and s.kind == "step"]
    joints = np.array([float(paths.segments[i].start) for i in steps])
    before = np.concatenate([np.zeros((1, 3)), first.mid[:, :, -1]])
    after = np.concatenate([first.mid[:, :, 0], np.zeros((1, 3))])
    lost = np.abs(first.rad).max() * 4
    turns = np.linalg.norm(after - before, axis=1) * (1 + 1e-9) + lost
    joints, jumps = np.r_[joints, float(paths.knots[robot][-1])], np.array([step_length(paths, i) for i in steps] + [0.0])
    knots = np.array([float(knot) for knot in paths.knots[robot]])
    return PlannedPath(
        paths.robots[robot], knots, trajectory.coefficients[:, :3], _greatest(first), _greatest(second), joints, jumps, turns
    )


def _greatest(vectors: Balls) -> float:
    """Bound the length of vectors in Bernstein form over all pieces. Shape (pieces, 3, degree + 1)."""
    ends = np.maximum(np.abs(vectors.low), np.abs(vectors.high)).max(axis=-1)
    return float(np.linalg.norm(ends, axis=1).max() * (1 + 1e-9))
