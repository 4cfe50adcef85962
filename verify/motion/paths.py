"""The checker's own reading of a team's trajectories: exact coefficients, exact clocks, and every instant covered.

A robot's path is a row of segments without gaps: the step from its start pose to where its first polynomial begins,
its pieces, between them the steps from one piece's end to the next one's start (float32 leaves some), and the hover
from its own end to the team's. A lasso ends with the step back to the start of its cycle.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import accumulate
from typing import Literal

import numpy as np
from flint import fmpq_poly

from verify.arithmetic.balls import Balls, Floats, from_power
from verify.arithmetic.exact import polynomial, rational
from verify.data.errors import BadInput
from verify.data.mission import Mission
from verify.data.trajectory import DEGREE, Trajectory, check_trajectories

SegmentKind = Literal["piece", "step", "hover"]


@dataclass(frozen=True, slots=True)
class Segment:
    """One part of one robot's path.

    Attributes:
        robot: Index of the robot.
        kind: A polynomial piece; a step, which takes no time; or a hover.
        piece: Index of the piece; of the piece before a step (-1: the start pose); of the last one before a hover.
        after: For a step: index of the piece that follows.
        start: Exact time, in s.
        stop: Exact time, in s; equal to `start` for a step.
    """

    robot: int
    kind: SegmentKind
    piece: int
    after: int
    start: Fraction
    stop: Fraction

    def time(self, place: Fraction | float) -> Fraction:
        """Return the exact time at a place of the segment, from 0 to 1."""
        return self.start + (self.stop - self.start) * Fraction(place)


@dataclass(frozen=True, eq=False)
class TeamPaths:
    """The paths of a whole team.

    Attributes:
        mission: Whose agents they are.
        robots: Names, in the mission's order.
        trajectories: One for each robot.
        knots: Exact start of each piece and end of the last, in s, for each robot.
        end: T, the exact end of the team's mission, in s.
        segments: Robot by robot, in order of time.
    """

    mission: Mission
    robots: tuple[str, ...]
    trajectories: tuple[Trajectory, ...]
    knots: tuple[tuple[Fraction, ...], ...]
    end: Fraction
    segments: tuple[Segment, ...]

    @cached_property
    def owner(self) -> np.ndarray:
        """Robot of each segment. Shape (segments,)."""
        return np.array([segment.robot for segment in self.segments], dtype=np.intp)

    @cached_property
    def piece_segments(self) -> np.ndarray:
        """Indices of the segments that are pieces, in order: row k of `derivative` belongs to the k-th of them."""
        return np.array([i for i, segment in enumerate(self.segments) if segment.kind == "piece"], dtype=np.intp)

    @cached_property
    def piece_owner(self) -> np.ndarray:
        """Robot of each piece. Shape (pieces,)."""
        return self.owner[self.piece_segments]

    @cached_property
    def durations(self) -> Floats:
        """Lengths of all pieces, in s. Shape (pieces,)."""
        return np.concatenate([t.durations for t in self.trajectories])

    @cached_property
    def coefficients(self) -> Floats:
        """Coefficients of all pieces. Shape (pieces, 4, 8)."""
        return np.concatenate([t.coefficients for t in self.trajectories])

    def derivative(self, order: int) -> Balls:
        """Return a time derivative of x, y, z and yaw on each piece. Shape (pieces, 4, 8 - order)."""
        values = self.coefficients
        for _ in range(order):  # at most 4 integer factors, the first product of each is exact for float32 values
            values = values[..., 1:] * np.arange(1, values.shape[-1])
        return from_power(values, self.durations[:, None])

    @cached_property
    def positions(self) -> Balls:
        """x, y and z on every segment. Shape (segments, 3, 8)."""
        count = len(self.segments)
        mid, rad = np.empty((count, 3, DEGREE + 1)), np.empty((count, 3, DEGREE + 1))
        pieces = self.derivative(0)[:, :3]
        index = self.piece_segments
        mid[index], rad[index] = pieces.mid, pieces.rad
        row_of = {(s.robot, s.piece): row for row, s in enumerate(self.segments[i] for i in index)}
        share = np.arange(DEGREE + 1) / DEGREE
        for i, segment in enumerate(self.segments):
            if segment.kind == "piece":
                continue
            if segment.piece < 0:
                start, error = np.array(self.mission.agents[self.robots[segment.robot]].start), np.zeros(3)
            else:
                row = row_of[segment.robot, segment.piece]
                start, error = pieces.mid[row, :, -1], pieces.rad[row, :, -1]
            stop = start if segment.kind == "hover" else self.coefficients[row_of[segment.robot, segment.after], :3, 0]
            step = (stop - start)[:, None]
            mid[i] = start[:, None] + step * share
            # the line's own rounding: a difference, a quotient, a product and a sum
            rad[i] = (error[:, None] + 8 * 2.0**-53 * (np.abs(start) + np.abs(stop))[:, None]) * (1 + 2.0**-40) + 1e-290
        return Balls(mid, rad)

    def exact_position(self, index: int) -> tuple[fmpq_poly, fmpq_poly, fmpq_poly]:
        """Return x, y and z on a segment as exact polynomials in u, from 0 to 1."""
        segment = self.segments[index]
        trajectory = self.trajectories[segment.robot]

        def piece(number: int, axis: int) -> fmpq_poly:
            scale = fmpq_poly([0, rational(float(trajectory.durations[number]))])
            return polynomial(trajectory.coefficients[number, axis])(scale)

        result = []
        for axis in range(3):
            if segment.kind == "piece":
                result.append(piece(segment.piece, axis))
                continue
            if segment.piece < 0:
                start = rational(self.mission.agents[self.robots[segment.robot]].start[axis])
            else:
                start = piece(segment.piece, axis)(1)
            stop = start if segment.kind == "hover" else rational(float(trajectory.coefficients[segment.after, axis, 0]))
            result.append(fmpq_poly([start, stop - start]))
        return result[0], result[1], result[2]


def read_team(mission: Mission, team: Mapping[str, Trajectory]) -> TeamPaths:
    """Read a team's trajectories for judging.

    Raises:
        BadInput: The robots are not the mission's agents, a cycle is missing or not wanted, laps do not begin and end together,
            or a number is too large to be a flight.
    """
    robots = tuple(mission.agents)
    team = check_trajectories(team)
    if set(team) != set(robots):
        raise BadInput(f"The team has robots {', '.join(sorted(team)) or '(none)'}; the mission has {', '.join(robots)}.")
    lasso = mission.spec.trace == "infinite"
    for name in robots:
        trajectory = team[name]
        if lasso and trajectory.cycle is None:
            raise BadInput(f"{name}: the mission's trace is infinite, so its trajectory needs a cycle.")
        if not lasso and trajectory.cycle is not None:
            raise BadInput(f"{name}: the mission's trace is finite, so its trajectory cannot have a cycle.")
    trajectories = tuple(team[name] for name in robots)
    knots = tuple(tuple(accumulate(map(Fraction, t.durations.tolist()), initial=Fraction(0))) for t in trajectories)
    if lasso:
        _require_common_laps(robots, trajectories, knots)
    end = max(k[-1] for k in knots)
    segments: list[Segment] = []
    for robot, (trajectory, times) in enumerate(zip(trajectories, knots, strict=True)):
        for piece in range(len(trajectory)):
            segments.append(Segment(robot, "step", piece - 1, piece, times[piece], times[piece]))
            segments.append(Segment(robot, "piece", piece, piece, times[piece], times[piece + 1]))
        if trajectory.cycle is not None:
            segments.append(Segment(robot, "step", len(trajectory) - 1, trajectory.cycle, times[-1], times[-1]))
        elif times[-1] < end:
            segments.append(Segment(robot, "hover", len(trajectory) - 1, -1, times[-1], end))
    return TeamPaths(mission, robots, trajectories, knots, end, tuple(segments))


def _require_common_laps(
    robots: tuple[str, ...], trajectories: tuple[Trajectory, ...], knots: tuple[tuple[Fraction, ...], ...]
) -> None:
    """Reject laps of a team that do not begin and end at the same exact times."""
    laps = [(times[t.cycle or 0], times[-1]) for t, times in zip(trajectories, knots, strict=True)]
    for name, (start, stop) in zip(robots, laps, strict=True):
        if (start, stop) != laps[0]:
            raise BadInput(
                f"{name}'s lap lasts from {float(start):.9g} to {float(stop):.9g} s, {robots[0]}'s from {float(laps[0][0]):.9g} to "
                f"{float(laps[0][1]):.9g} s. The laps of a team begin and end together, to the last bit: let whoever has arrived hover."
            )
