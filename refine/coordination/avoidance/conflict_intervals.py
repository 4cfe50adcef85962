"""Robots that meet: in which intervals of time, how far they are from each other in each, and their legs cut finer there.

What they then do about it is said by `reciprocal_avoidance`.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from refine.corridor.corridor import Corridor
from refine.spline.basis import SIZE, bernstein_matrix
from refine.spline.spline import Spline

Floats = NDArray[np.float64]

NEAR = 0.3
"""m on top of the distance within which planes are put between the robots from the start."""
_STEP = 0.25
"""s of the longest interval with one plane."""
_PARTS = 6
"""Pieces that an encounter is flown in, about: fewer leave no freedom, more leave no room in the vehicle's memory."""


@dataclass(frozen=True, eq=False)
class Mover:
    """One of the robots.

    Attributes:
        corridor: Its points and rules.
        path: What it flies now, one piece for each leg of the corridor.
        start: Departure, s.
        rest: Points at which it rests.
        free: Points that it need not go through. Shape (points,).
    """

    corridor: Corridor
    path: Spline
    start: float
    rest: frozenset[int]
    free: NDArray[np.bool_]


@dataclass(frozen=True, eq=False, slots=True)
class Meeting:
    """Time interval in which robots meet, and the distance that they keep.

    Attributes:
        spans: Intervals of time, s.
        distance: m between centres.
        scale: Of the axes in that distance. Shape (3,).
    """

    spans: list[tuple[float, float]]
    distance: float
    scale: Floats

    @classmethod
    def of(cls, robots: tuple[Mover, ...], distance: float, scale: Floats) -> Meeting:
        """Return when some robots meet: intervals in which each flies one piece or hovers.

        Args:
            robots: Those that meet.
            distance: m between centres.
            scale: Of the axes in that distance. Shape (3,).
        """
        return cls(_spans(robots), distance, scale)


def mover(corridor: Corridor, path: Spline, start: float, rest: frozenset[int]) -> Mover:
    """Return a robot that goes through what its corridor needs.

    Args:
        corridor: Its points and rules.
        path: What it flies now.
        start: Departure, s.
        rest: Points at which it rests.
    """
    free = ~np.array(corridor.needed)
    free[[0, -1, *rest]] = False
    return Mover(corridor, path, start, rest, free)


def cut_where_near(pair: tuple[Mover, Mover], distance: float, scale: Floats) -> tuple[Mover, Mover]:
    """Return the robots with the legs of their encounter cut finer, so that the paths have something to give.

    Args:
        pair: Two robots.
        distance: m between centres.
        scale: Of the axes in that distance. Shape (3,).
    """
    meeting = Meeting.of(pair, distance, scale)
    near = np.flatnonzero(least_gaps(pair, (pair[0].path, pair[1].path), meeting) < 2 * distance + NEAR)
    if not len(near):
        return pair
    begin, end = meeting.spans[near[0]][0], meeting.spans[near[-1]][1]
    longest = max((end - begin) / _PARTS, _STEP)
    return _finer(pair[0], begin, end, longest), _finer(pair[1], begin, end, longest)


def gaps_of(pair: tuple[Mover, Mover], paths: tuple[Spline, Spline], meeting: Meeting) -> Floats:
    """Return from the second robot to the first in the middle of each interval, m, z scaled. Shape (spans, 3).

    Args:
        pair: Two robots.
        paths: What they fly, at the times of their present paths.
        meeting: The intervals.
    """
    half = bernstein_matrix(0.0, 1.0)
    middle = np.linalg.solve(half.T, 0.5 ** np.arange(8))
    gaps = [middle @ (points_of(paths[0], pair[0], *span) - points_of(paths[1], pair[1], *span)) for span in meeting.spans]
    return np.array(gaps) * meeting.scale


def least_gaps(pair: tuple[Mover, Mover], paths: tuple[Spline, Spline], meeting: Meeting) -> Floats:
    """Return a sampled least distance in each interval, m. Shape (spans,).

    Args:
        pair: Two robots.
        paths: What they fly, at the times of their present paths.
        meeting: The intervals.
    """
    half = bernstein_matrix(0.0, 1.0)
    sampled = np.linalg.solve(half.T, np.linspace(0.0, 1.0, 9) ** np.arange(8)[:, None]).T
    gaps = [
        sampled @ (points_of(paths[0], pair[0], *span) - points_of(paths[1], pair[1], *span)) * meeting.scale
        for span in meeting.spans
    ]
    return np.array([np.linalg.norm(gap, axis=1).min() for gap in gaps])


def points_of(path: Spline, robot: Mover, begin: float, end: float) -> Floats:
    """Return the Bernstein points of a robot's path over an interval, m. Shape (8, 3).

    Args:
        path: What it flies, at the times of its present path.
        robot: Who flies it.
        begin: s.
        end: s.
    """
    place = part_flown(robot, begin, end)
    if place is None:
        node = 0 if 0.5 * (begin + end) <= robot.start else -1
        return np.repeat(path.nodes[node][None], 8, axis=0)
    piece, low, high = place
    unit = path.coefficients[piece] * path.durations[piece] ** np.arange(SIZE)
    return bernstein_matrix(low, high) @ unit.T


def part_flown(robot: Mover, begin: float, end: float) -> tuple[int, float, float] | None:
    """Return the piece that is flown in an interval and which part of it, 0 to 1; None where the robot hovers.

    Args:
        robot: Whose path.
        begin: s.
        end: s.
    """
    knots = robot.start + robot.path.knots
    middle = 0.5 * (begin + end)
    if not knots[0] < middle < knots[-1]:
        return None
    piece = int(np.searchsorted(knots, middle, side="right") - 1)
    duration = robot.path.durations[piece]
    low, high = (begin - knots[piece]) / duration, (end - knots[piece]) / duration
    return piece, float(np.clip(low, 0.0, 1.0)), float(np.clip(high, 0.0, 1.0))


def _spans(robots: tuple[Mover, ...]) -> list[tuple[float, float]]:
    """Return intervals in which each robot flies one piece or hovers, none longer than _STEP."""
    knots = np.unique(np.concatenate([[0.0], *(robot.start + robot.path.knots for robot in robots)]))
    knots = knots[np.concatenate([[True], np.diff(knots) > 1e-9])]
    spans: list[tuple[float, float]] = []
    for begin, end in itertools.pairwise(knots):
        inner = np.linspace(begin, end, int(np.ceil((end - begin) / _STEP)) + 1)
        spans += [(float(a), float(b)) for a, b in itertools.pairwise(inner)]
    return spans


def _finer(robot: Mover, begin: float, end: float, longest: float) -> Mover:
    """Cut the legs flown between two times into parts that last no longer than `longest`, with free points between them."""
    knots = robot.start + robot.path.knots
    met = (knots[:-1] < end) & (knots[1:] > begin)
    parts = np.where(met, np.minimum(_PARTS, np.ceil(robot.path.durations / longest)), 1)
    return cut_legs(robot, [int(part) for part in parts])


def cut_legs(robot: Mover, parts: Sequence[int]) -> Mover:
    """Return a robot with each leg cut into so many equal parts, with free points between them.

    Args:
        robot: It flies one piece for each leg.
        parts: For each leg.
    """
    corridor = robot.corridor
    points, durations, legs, needed, free, states = [corridor.points[0]], [], [], [corridor.needed[0]], [robot.free[0]], []
    rest: set[int] = {0} & robot.rest
    for index, (leg, count) in enumerate(zip(corridor.legs, parts, strict=True)):
        shares = np.arange(1, count + 1) / count
        points += [corridor.points[index] + share * (corridor.points[index + 1] - corridor.points[index]) for share in shares]
        durations += [corridor.durations[index] / count] * count
        legs += [leg] * count
        needed += [False] * (count - 1) + [corridor.needed[index + 1]]
        free += [True] * (count - 1) + [robot.free[index + 1]]
        piece = Spline(robot.path.durations[index : index + 1], robot.path.states[index : index + 2]).split(count)
        states.append((piece.durations, piece.states))
        if index + 1 in robot.rest:
            rest.add(len(legs))
    path = Spline(
        np.concatenate([part for part, _ in states]),
        np.concatenate([states[0][1], *(part[1:] for _, part in states[1:])]),
    )
    finer = replace(
        corridor,
        points=np.array(points),
        durations=np.array(durations),
        legs=tuple(legs),
        needed=tuple(needed),
        rooms=(None,) * len(points),
        cycle=None,
    )
    return Mover(finer, path, robot.start, frozenset(rest), np.array(free))
