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
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from refine.coordination.avoidance.conflict_intervals import (
    NEAR,
    Meeting,
    Mover,
    cut_where_near,
    gaps_of,
    least_gaps,
    part_flown,
    points_of,
)
from refine.corridor.fitting import BUFFER, Rules, fixed_states, rows_of, until_kept
from refine.solvers.qp import Programme, Row, solve
from refine.spline.basis import bernstein_matrix
from refine.spline.spline import Spline
from verify.data import Infeasible

Floats = NDArray[np.float64]

Yielding = Literal["both", "first", "second"]

_SIDES = 8
_ROUNDS = 4
_CLEAR = 1.15
"""Share of the distance at which planes face when they are chosen."""


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
    cut = cut_where_near(pair, distance, scale)
    meeting = Meeting.of(cut, distance, scale)
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
        near = cut_where_near((movers[i], movers[j]), distance, scale)
        for index, finer in ((i, near[0]), (j, near[1])):
            cut[index] = max(cut[index], finer, key=lambda robot: len(robot.path))
    meeting = Meeting.of(tuple(cut), distance, scale)
    for rule in ("right", "left", "above"):
        sides = [_ruled(rule, (cut[i], cut[j]), meeting) for i, j in pairs]
        try:
            yield _all_separated(tuple(cut), pairs, sides, meeting)
        except Infeasible:
            continue  # another rule


def _ruled(rule: str, pair: tuple[Mover, Mover], meeting: Meeting) -> Floats:
    """Return the direction in which a rule moves the first robot of a pair away from the second."""
    if rule == "above":
        return np.array([0.0, 0.0, 1.0])
    gaps = gaps_of(pair, (pair[0].path, pair[1].path), meeting)
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
    meeting: Meeting,
) -> tuple[Spline, ...]:
    """Return paths with planes between all pairs wherever they are near.

    Raises:
        Infeasible: The planes contradict the corridors.
    """
    paths = tuple(robot.path for robot in movers)
    couples = [(movers[i], movers[j]) for i, j in pairs]
    gaps = [gaps_of(couple, (couple[0].path, couple[1].path), meeting) for couple in couples]
    normals = [_facing(gap, side, meeting.distance) for gap, side in zip(gaps, sides, strict=True)]
    active = [{int(k) for k in np.flatnonzero(np.linalg.norm(gap, axis=1) < meeting.distance + NEAR)} for gap in gaps]
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
            least = least_gaps(couples[index], (paths[i], paths[j]), meeting)
            near = {int(k) for k in np.flatnonzero(least < meeting.distance)} - active[index]
            if near:
                after = _facing(gaps_of(couples[index], (paths[i], paths[j]), meeting), sides[index], meeting.distance)
                normals[index][sorted(near)] = after[sorted(near)]
                active[index] |= near
                fresh = True
        if not fresh:
            return paths
    raise Infeasible("The paths still come too near each other.")


def _separated(pair: tuple[Mover, Mover], meeting: Meeting, side: Floats, way: Yielding) -> tuple[Spline, Spline]:
    """Return paths with planes between them wherever they are near, on one side.

    Raises:
        Infeasible: The planes contradict the corridors.
    """
    paths = (pair[0].path, pair[1].path)
    gaps = gaps_of(pair, paths, meeting)
    normals = _facing(gaps, side, meeting.distance)
    active = {int(index) for index in np.flatnonzero(np.linalg.norm(gaps, axis=1) < meeting.distance + NEAR)}
    rules: tuple[Rules, Rules] = ({}, {})
    for _ in range(_ROUNDS):
        rows = _rows(pair, normals, sorted(active), way, meeting)
        paths = (_fitted(pair[0], rows[0], rules[0]), _fitted(pair[1], rows[1], rules[1]))
        after = gaps_of(pair, paths, meeting)
        near = {int(index) for index in np.flatnonzero(least_gaps(pair, paths, meeting) < meeting.distance)} - active
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
    pair: tuple[Mover, Mover], normals: Floats, active: list[int], way: Yielding, meeting: Meeting
) -> tuple[list[Row], list[Row]]:
    """Return both robots' rows: the first is beyond the planes, the second before them."""
    rows: tuple[list[Row], list[Row]] = ([], [])
    spans, distance = meeting.spans, meeting.distance
    for index in active:
        normal = normals[index] * meeting.scale
        at = [part_flown(robot, *spans[index]) for robot in pair]
        along = [points_of(robot.path, robot, *spans[index]) @ normal for robot in pair]
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


def _sides(pair: tuple[Mover, Mover], meeting: Meeting) -> list[Floats]:
    """Return directions across the encounter, the one that the robots already take first."""
    gaps = gaps_of(pair, (pair[0].path, pair[1].path), meeting)
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
