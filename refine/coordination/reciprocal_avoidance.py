"""Robots that cannot keep apart by departures alone: their paths are fitted again, each on its side of moving planes.

At every instant of an encounter a plane is put between each two, whose normal turns with the encounter: first it faces along
the line between them, then aside, then along the line again. Each robot's part is a row for each Bernstein point of a short
interval, so that the distance holds at all times and not at samples. The plane may run midway (both give way) or along one
robot's path (only the other does); where more than two meet, all give way by one rule. Nothing here knows limits: the caller
slows the whole encounter, which keeps it as it is.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from refine.corridor.fitting import BUFFER, Rules, fixed_states, rows_of, until_kept
from refine.corridor.values import Corridor
from refine.solvers.qp import Programme, Row, solve
from refine.spline.basis import SIZE, bernstein_matrix
from refine.spline.values import Spline
from verify.data import Infeasible

Floats = NDArray[np.float64]

Yielding = Literal["both", "first", "second"]

_STEP = 0.25
"""s of the longest interval with one plane."""
_NEAR = 0.3
"""m on top of the distance within which planes are put between the robots from the start."""
_SIDES = 8
_ROUNDS = 4
_PARTS = 6
"""Pieces that an encounter is flown in, about: fewer leave no freedom, more leave no room in the vehicle's memory."""
_CLEAR = 1.15
"""Share of the distance at which planes face when they are chosen."""


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
class _Meeting:
    """When robots meet, and what they keep.

    Attributes:
        spans: Intervals of time, s.
        distance: m between centres.
        scale: Of the axes in that distance. Shape (3,).
    """

    spans: list[tuple[float, float]]
    distance: float
    scale: Floats


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


def avoid_in_pair(
    pair: tuple[Mover, Mover], distance: float, z_scale: float, ways: tuple[Yielding, ...]
) -> Iterator[tuple[Spline, Spline]]:
    """Yield pairs of paths that keep a distance at all times, at the times of the present ones.

    Args:
        pair: The two robots; neither flies a lasso.
        distance: m between centres.
        z_scale: Distances in z count this many times.
        ways: Who may give way, in order of preference.

    Raises:
        SolverTimeout: An engine's seconds ran out before its iterations.
    """
    scale = np.array([1.0, 1.0, z_scale])
    cut = _cut_where_near(pair, distance, scale)
    meeting = _Meeting(_spans(cut), distance, scale)
    for way in ways:
        for side in _sides(cut, meeting):
            try:
                yield _separated(cut, meeting, side, way)
            except Infeasible:
                continue  # another side, or another one gives way


def avoid_by_rule(movers: tuple[Mover, ...], distance: float, z_scale: float) -> Iterator[tuple[Spline, ...]]:
    """Yield paths of several robots that all give way to each other, at the times of the present ones.

    With one rule for all pairs the sides never contradict each other: everyone keeps right of the others (or left) along
    the relative motion, as in a roundabout, or robots pass above each other in their order.

    Args:
        movers: Two robots or more; none flies a lasso.
        distance: m between centres.
        z_scale: Distances in z count this many times.

    Raises:
        SolverTimeout: An engine's seconds ran out before its iterations.
    """
    scale = np.array([1.0, 1.0, z_scale])
    pairs = list(itertools.combinations(range(len(movers)), 2))
    cut = list(movers)
    for i, j in pairs:
        near = _cut_where_near((movers[i], movers[j]), distance, scale)
        for index, finer in ((i, near[0]), (j, near[1])):
            cut[index] = max(cut[index], finer, key=lambda robot: len(robot.path))
    meeting = _Meeting(_spans(tuple(cut)), distance, scale)
    for rule in ("right", "left", "above"):
        sides = [_ruled(rule, (cut[i], cut[j]), meeting) for i, j in pairs]
        try:
            yield _all_separated(tuple(cut), pairs, sides, meeting)
        except Infeasible:
            continue  # another rule


def _ruled(rule: str, pair: tuple[Mover, Mover], meeting: _Meeting) -> Floats:
    """Return the direction in which a rule moves the first robot of a pair away from the second."""
    if rule == "above":
        return np.array([0.0, 0.0, 1.0])
    gaps = _gaps(pair, (pair[0].path, pair[1].path), meeting)
    nearest = int(np.argmin(np.linalg.norm(gaps, axis=1)))
    axis = gaps[min(nearest + 1, len(gaps) - 1)] - gaps[max(nearest - 1, 0)]
    side = np.cross(axis, [0.0, 0.0, 1.0])
    if np.linalg.norm(side) < 1e-9:
        side = np.array([1.0, 0.0, 0.0])
    return side / np.linalg.norm(side) * (1.0 if rule == "right" else -1.0)


def _all_separated(
    movers: tuple[Mover, ...],
    pairs: list[tuple[int, int]],
    sides: list[Floats],
    meeting: _Meeting,
) -> tuple[Spline, ...]:
    """Return paths with planes between all pairs wherever they are near.

    Raises:
        Infeasible: The planes contradict the corridors.
    """
    paths = tuple(robot.path for robot in movers)
    couples = [(movers[i], movers[j]) for i, j in pairs]
    gaps = [_gaps(couple, (couple[0].path, couple[1].path), meeting) for couple in couples]
    normals = [_facing(gap, side, meeting.distance) for gap, side in zip(gaps, sides, strict=True)]
    active = [{int(k) for k in np.flatnonzero(np.linalg.norm(gap, axis=1) < meeting.distance + _NEAR)} for gap in gaps]
    rules: tuple[Rules, ...] = tuple({} for _ in movers)
    for _ in range(_ROUNDS):
        rows: list[list[Row]] = [[] for _ in movers]
        for (i, j), couple, normal, near in zip(pairs, couples, normals, active, strict=True):
            first, second = _rows(couple, normal, sorted(near), "both", meeting)
            rows[i] += first
            rows[j] += second
        paths = tuple(_fitted(*each) for each in zip(movers, rows, rules, strict=True))
        fresh = False
        for index, (i, j) in enumerate(pairs):
            least = _least(couples[index], (paths[i], paths[j]), meeting)
            near = {int(k) for k in np.flatnonzero(least < meeting.distance)} - active[index]
            if near:
                after = _facing(_gaps(couples[index], (paths[i], paths[j]), meeting), sides[index], meeting.distance)
                normals[index][sorted(near)] = after[sorted(near)]
                active[index] |= near
                fresh = True
        if not fresh:
            return paths
    raise Infeasible("The paths still come too near each other.")


def _separated(pair: tuple[Mover, Mover], meeting: _Meeting, side: Floats, way: Yielding) -> tuple[Spline, Spline]:
    """Return paths with planes between them wherever they are near, on one side.

    Raises:
        Infeasible: The planes contradict the corridors.
    """
    paths = (pair[0].path, pair[1].path)
    gaps = _gaps(pair, paths, meeting)
    normals = _facing(gaps, side, meeting.distance)
    active = {int(index) for index in np.flatnonzero(np.linalg.norm(gaps, axis=1) < meeting.distance + _NEAR)}
    rules: tuple[Rules, Rules] = ({}, {})
    for _ in range(_ROUNDS):
        rows = _rows(pair, normals, sorted(active), way, meeting)
        paths = (_fitted(pair[0], rows[0], rules[0]), _fitted(pair[1], rows[1], rules[1]))
        after = _gaps(pair, paths, meeting)
        near = {int(index) for index in np.flatnonzero(_least(pair, paths, meeting) < meeting.distance)} - active
        if not near:
            return paths
        active |= near
        normals[sorted(near)] = _facing(after, side, meeting.distance)[sorted(near)]
    raise Infeasible("The two paths still come too near each other.")


def _fitted(robot: Mover, rows: list[Row], rules: Rules) -> Spline:
    if not rows:
        return robot.path
    fixed = fixed_states(robot.corridor, robot.rest)
    fixed[robot.free, 0] = np.nan

    def attempt() -> Spline:
        kept = [row for (_, leg, _), planes in rules.items() for plane in planes for row in rows_of(leg, plane)]
        return solve(Programme(robot.path.durations, fixed, (*rows, *kept)))

    return until_kept(robot.corridor, rules, attempt, buffer=BUFFER)


def _rows(
    pair: tuple[Mover, Mover], normals: Floats, active: list[int], way: Yielding, meeting: _Meeting
) -> tuple[list[Row], list[Row]]:
    """Return both robots' rows: the first is beyond the planes, the second before them."""
    rows: tuple[list[Row], list[Row]] = ([], [])
    spans, distance = meeting.spans, meeting.distance
    for index in active:
        normal = normals[index] * meeting.scale
        at = [_at(robot, *spans[index]) for robot in pair]
        along = [_points(robot.path, robot, *spans[index]) @ normal for robot in pair]
        moves = (at[0] is not None and way != "second", at[1] is not None and way != "first")
        if moves[0] and moves[1]:
            middle = 0.5 * (along[0] + along[1])
            bounds = (middle + 0.5 * distance, middle - 0.5 * distance)
        else:
            bounds = (along[1] + distance, along[0] - distance)
        for robot, sign in ((0, 1.0), (1, -1.0)):
            place = at[robot]
            if moves[robot] and place is not None:
                piece, low, high = place
                weights = bernstein_matrix(low, high)
                rows[robot].extend(
                    Row(piece, weights[k], sign * normal, float(sign * bounds[robot][k])) for k in range(len(weights))
                )
    return rows


def _facing(gaps: Floats, side: Floats, distance: float) -> Floats:
    """Return unit normals along the gaps, which are pushed aside until they are as long as they have to be."""
    wanted = _CLEAR * distance
    along = gaps @ side
    short = np.maximum(wanted**2 - np.sum(gaps**2, axis=1), 0.0)
    pushed = gaps + (np.sqrt(along**2 + short) - along)[:, None] * side
    return pushed / np.linalg.norm(pushed, axis=1, keepdims=True)


def _sides(pair: tuple[Mover, Mover], meeting: _Meeting) -> list[Floats]:
    """Return directions across the encounter, the one that the robots already take first."""
    gaps = _gaps(pair, (pair[0].path, pair[1].path), meeting)
    nearest = int(np.argmin(np.linalg.norm(gaps, axis=1)))
    axis = gaps[min(nearest + 1, len(gaps) - 1)] - gaps[max(nearest - 1, 0)]
    size = float(np.linalg.norm(axis))
    axis = axis / size if size > 1e-9 else np.array([1.0, 0.0, 0.0])
    first = gaps[nearest] - (gaps[nearest] @ axis) * axis
    if np.linalg.norm(first) < 1e-3:
        first = np.cross(axis, [0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
    first = first / np.linalg.norm(first)
    second = np.cross(axis, first)
    angles = [0.0, *(sign * k * 2 * np.pi / _SIDES for k in range(1, _SIDES // 2) for sign in (1, -1)), np.pi]
    return [np.cos(angle) * first + np.sin(angle) * second for angle in angles]


def _spans(robots: tuple[Mover, ...]) -> list[tuple[float, float]]:
    """Return intervals in which each robot flies one piece or hovers, none longer than _STEP."""
    knots = np.unique(np.concatenate([[0.0], *(robot.start + robot.path.knots for robot in robots)]))
    knots = knots[np.concatenate([[True], np.diff(knots) > 1e-9])]
    spans: list[tuple[float, float]] = []
    for begin, end in itertools.pairwise(knots):
        inner = np.linspace(begin, end, int(np.ceil((end - begin) / _STEP)) + 1)
        spans += [(float(a), float(b)) for a, b in itertools.pairwise(inner)]
    return spans


def _at(robot: Mover, begin: float, end: float) -> tuple[int, float, float] | None:
    """Return the piece that is flown in an interval and which part of it; None where the robot hovers."""
    knots = robot.start + robot.path.knots
    middle = 0.5 * (begin + end)
    if not knots[0] < middle < knots[-1]:
        return None
    piece = int(np.searchsorted(knots, middle, side="right") - 1)
    duration = robot.path.durations[piece]
    low, high = (begin - knots[piece]) / duration, (end - knots[piece]) / duration
    return piece, float(np.clip(low, 0.0, 1.0)), float(np.clip(high, 0.0, 1.0))


def _points(path: Spline, robot: Mover, begin: float, end: float) -> Floats:
    """Return the Bernstein points of a robot's path over an interval. Shape (8, 3)."""
    place = _at(robot, begin, end)
    if place is None:
        node = 0 if 0.5 * (begin + end) <= robot.start else -1
        return np.repeat(path.nodes[node][None], 8, axis=0)
    piece, low, high = place
    unit = path.coefficients[piece] * path.durations[piece] ** np.arange(SIZE)
    return bernstein_matrix(low, high) @ unit.T


def _gaps(pair: tuple[Mover, Mover], paths: tuple[Spline, Spline], meeting: _Meeting) -> Floats:
    """Return from the second robot to the first in the middle of each interval, z scaled. Shape (spans, 3)."""
    half = bernstein_matrix(0.0, 1.0)
    middle = np.linalg.solve(half.T, 0.5 ** np.arange(8))
    gaps = [middle @ (_points(paths[0], pair[0], *span) - _points(paths[1], pair[1], *span)) for span in meeting.spans]
    return np.array(gaps) * meeting.scale


def _least(pair: tuple[Mover, Mover], paths: tuple[Spline, Spline], meeting: _Meeting) -> Floats:
    """Return a sampled least distance in each interval. Shape (spans,)."""
    half = bernstein_matrix(0.0, 1.0)
    sampled = np.linalg.solve(half.T, np.linspace(0.0, 1.0, 9) ** np.arange(8)[:, None]).T
    gaps = [
        sampled @ (_points(paths[0], pair[0], *span) - _points(paths[1], pair[1], *span)) * meeting.scale
        for span in meeting.spans
    ]
    return np.array([np.linalg.norm(gap, axis=1).min() for gap in gaps])


def _cut_where_near(pair: tuple[Mover, Mover], distance: float, scale: Floats) -> tuple[Mover, Mover]:
    """Return the robots with the legs of their encounter cut finer, so that the paths have something to give."""
    spans = _spans(pair)
    near = np.flatnonzero(_least(pair, (pair[0].path, pair[1].path), _Meeting(spans, distance, scale)) < 2 * distance + _NEAR)
    if not len(near):
        return pair
    begin, end = spans[near[0]][0], spans[near[-1]][1]
    longest = max((end - begin) / _PARTS, _STEP)
    return _finer(pair[0], begin, end, longest), _finer(pair[1], begin, end, longest)


def _finer(robot: Mover, begin: float, end: float, longest: float) -> Mover:
    """Cut the legs flown between two times into parts that last no longer than `longest`, with free points between them."""
    corridor, knots = robot.corridor, robot.start + robot.path.knots
    points, durations, legs, needed, free, states = [corridor.points[0]], [], [], [corridor.needed[0]], [robot.free[0]], []
    rest: set[int] = {0} & robot.rest
    for index, leg in enumerate(corridor.legs):
        met = knots[index] < end and knots[index + 1] > begin
        parts = min(_PARTS, int(np.ceil(robot.path.durations[index] / longest))) if met else 1
        shares = np.arange(1, parts + 1) / parts
        points += [corridor.points[index] + share * (corridor.points[index + 1] - corridor.points[index]) for share in shares]
        durations += [corridor.durations[index] / parts] * parts
        legs += [leg] * parts
        needed += [False] * (parts - 1) + [corridor.needed[index + 1]]
        free += [True] * (parts - 1) + [robot.free[index + 1]]
        piece = Spline(robot.path.durations[index : index + 1], robot.path.states[index : index + 2]).split(parts)
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
