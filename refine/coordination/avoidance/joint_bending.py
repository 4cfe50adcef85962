"""Paths of many robots that are bent apart all at once, before any rule or order is asked for.

A spline of least snap through given points at given times is linear in those points, so where all robots are at all samples of time is
one sparse matrix times the free points of all of them. What is sought is the least of one sum: how far points are drawn from where they
are now, and by how much any two robots are nearer than they should be, or a robot is inside a body or outside its box, at any sample.
The weight of the latter grows from stage to stage (a penalty method, by L-BFGS). Who is near whom is looked up in a tree over
places and times now and then, so that the cost goes by encounters and not by pairs.

The sum only knows samples and asks for a few centimetres more than is needed: whoever calls makes the splines, and checks them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.optimize import minimize

from refine.coordination.avoidance.conflict_intervals import Mover
from refine.obstacles.keep_out_bodies import Obstacle, within
from refine.spline.least_snap import banded_problem, solve_banded
from verify.data.validation.spacing import Spacing

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

CLEARANCE = 0.05
"""m on top of the distance that bending aims at: what the last stage's weight leaves of a breach, and what samples cannot see."""
_BODY_BUFFER = 0.02
"""m that bending aims at between a path and a body, or the box."""
_PER_DISTANCE = 4.0
"""Samples while two robots fly past each other by the distance, both at the speed that is thought usual."""
_SWERVING = 1.5
"""How much faster than now robots may fly on bent paths, for the number of samples."""
_MOST_SAMPLES = 1200
_WEIGHTS = (1e3, 1e4, 1e5, 1e6)
"""Of breaches, m^2 of which are weighed against m^2 that points are moved by, from stage to stage."""
_LOOKS = 4
"""How often a stage looks up who is near whom."""
_STEPS = 25
"""Steps of L-BFGS between two looks."""
_SKIN = 0.5
"""m on top of the distance within which robots are looked up as near."""
_PROBE = 1e-5
"""m over which a body's distance is differentiated."""


@dataclass(frozen=True, slots=True)
class Beginning:
    """Initial guess of the search for bent paths: straight paths that meet in one point have no direction to part in.

    Attributes:
        swirl: Share of its length by which each path swings to one side, all turning one way as in a roundabout; 0.5 is half a circle.
        layers: Heights among which robots are shared out in turn.
        height: m between the lowest and the highest of them.
    """

    swirl: float
    layers: int
    height: float


@dataclass(frozen=True, eq=False, slots=True)
class Bent:
    """Points through which robots keep apart, as far as samples show.

    Attributes:
        points: One array a robot, m. Shape (points, 3).
        least: The least sampled distance of two robots, less what clocks may take of it, m as it counts; no more than what was aimed at.
        nearest: The two robots of it.
        time: s, when that is.
        evaluations: How often the sum was evaluated to find them.
    """

    points: tuple[Floats, ...]
    least: float
    nearest: tuple[int, int]
    time: float
    evaluations: int = 0


def bend_apart(movers: Sequence[Mover], spacing: Spacing, beginning: Beginning) -> Iterator[Bent]:
    """Yield points for robots that keep apart at the times of their present paths: turning to one side, and to the other one.

    Which comes first owes nothing to left and right.

    Args:
        movers: The robots; points that are not free stay where they are.
        spacing: What they keep, and by how much their clocks differ.
        beginning: Where the search begins.
    """
    space = _Space(movers, spacing)
    sides = (space.begun(replace(beginning, swirl=turn * beginning.swirl)) for turn in (1.0, -1.0))
    for points in sorted(sides, key=space.rounded_sum):
        yield bent_from(space, points, spacing.distance)


def bent_from(space: _Space, points: Floats, distance: float) -> Bent:
    """Return what is found from some points on.

    Args:
        space: The robots.
        points: Shape (points, 3).
        distance: m that robots keep.
    """
    bent, evaluations = space.bent(points), 0
    for weight in _WEIGHTS:
        for _ in range(_LOOKS):
            near = space.near(points, _SKIN)
            found = minimize(
                space.sum_and_slope,
                points[space.free].ravel(),
                args=(near, weight),
                jac=True,
                method="L-BFGS-B",
                options={"maxiter": _STEPS, "maxcor": 12},
            )
            points, evaluations = space.with_free(found.x), evaluations + found.nfev
            if found.nit < _STEPS:
                break
        bent = space.bent(points)
        if bent.least >= distance + CLEARANCE / 2:
            break
    return replace(bent, evaluations=evaluations)


@dataclass(frozen=True, eq=False, slots=True)
class _Near:
    """Pairs that may be too near each other, and robots too near bodies, until points have moved far.

    Attributes:
        pairs: Rows of the samples of two robots at one time. Shape (pairs, 2).
        drifts: What the slower one flies in the clocks' error, m. Shape (pairs,).
        bodies: Bodies, and rows of the samples that may meet them.
    """

    pairs: Indices
    drifts: Floats
    bodies: tuple[tuple[Obstacle, Indices], ...]


class _Space:
    """All robots' points, and where these put the robots at all samples of time: one row a robot and time, robot by robot."""

    def __init__(self, movers: Sequence[Mover], spacing: Spacing) -> None:
        self._movers, self._aim, self._skew = movers, spacing.distance + CLEARANCE, spacing.skew
        self._scale = np.array([1.0, 1.0, spacing.z_scale])
        self._times = _sample_times(movers, self._aim, self._scale)
        maps = [_sampled(robot, self._times) for robot in movers]
        count = len(self._times)
        self._places = sparse.block_diag(maps, format="csr")
        self._back = self._places.T.tocsr()
        steps = [np.diff(each, axis=0) for each in maps]
        self._stiffness = sparse.block_diag([(count - 1) * each.T @ each for each in steps], format="csr")
        self._points = np.concatenate([robot.path.nodes for robot in movers])
        self._bounds = np.cumsum([0, *(len(robot.path.nodes) for robot in movers)])
        self.free = np.concatenate([robot.free for robot in movers])
        boxes = [_box(robot) for robot in movers]
        self._low, self._high = (np.repeat([box[side] for box in boxes], count, axis=0) for side in (0, 1))

    def with_free(self, flat: Floats) -> Floats:
        """Return all points with the free ones moved. Shape (free points * 3,) to (points, 3)."""
        points = self._points.copy()
        points[self.free] = flat.reshape(-1, 3)
        return points

    def begun(self, beginning: Beginning) -> Floats:
        """Return the points from which the search begins. Shape (points, 3)."""
        points = self._points.copy()
        for index, robot in enumerate(self._movers):
            own = slice(self._bounds[index], self._bounds[index + 1])
            points[own] += _swing(points[own], beginning, index)
            points[own] = np.clip(points[own], robot.corridor.low, robot.corridor.high)
        points[~self.free] = self._points[~self.free]
        return points

    def rounded_sum(self, points: Floats) -> float:
        """Return what is made least, rounded so that it is the same on any processor where sides are alike."""
        total, _ = self.sum_and_slope(points[self.free].ravel(), self.near(points, _SKIN), _WEIGHTS[0])
        return float(f"{total:.6g}")

    def near(self, points: Floats, skin: float) -> _Near:
        """Return who may come too near whom or what while points move less than half of `skin` m."""
        from scipy.spatial import KDTree  # here: it takes long to load, and few teams need it

        places, count = self._places @ points, len(self._times)
        lags = self._lags(places)
        reach = self._aim + skin + float(lags.max())
        when = np.tile(np.arange(count) * 2.0 * reach, len(self._movers))
        pairs = KDTree(np.column_stack([places * self._scale, when])).query_pairs(reach, output_type="ndarray")
        pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]  # the tree's own order is nobody's promise
        bodies: dict[int, tuple[Obstacle, list[Indices]]] = {}  # each once, for all legs that it stands beside
        for index, robot in enumerate(self._movers):
            flown = np.searchsorted(robot.start + robot.path.knots, self._times, side="right") - 1
            for leg, rules in enumerate(robot.corridor.legs):
                rows = np.flatnonzero(flown == leg) + index * count
                if not len(rows) or not rules.obstacles:
                    continue
                own = places[rows]
                for number in within(rules.obstacles, own.min(axis=0) - skin, own.max(axis=0) + skin):
                    body = rules.obstacles[number]
                    met = rows[body.signed_distance(own) < skin]
                    if len(met):
                        bodies.setdefault(id(body), (body, []))[1].append(met)
        met_by = tuple((body, np.concatenate(met)) for body, met in bodies.values())
        return _Near(pairs, np.minimum(lags[pairs[:, 0]], lags[pairs[:, 1]]), met_by)

    def _lags(self, places: Floats) -> Floats:
        """Return how far each robot flies in the clocks' error, at its speed at each sample, m. Shape (rows, 3) to (rows,)."""
        count = len(self._times)
        speeds = np.gradient((places * self._scale).reshape(-1, count, 3), self._times[1], axis=1)
        return self._skew * np.linalg.norm(speeds, axis=2).ravel()

    def sum_and_slope(self, flat: Floats, near: _Near, weight: float) -> tuple[float, Floats]:
        """Return what is made least, and its slope by the free points. Shapes (free points * 3,)."""
        points = self.with_free(flat)
        places = self._places @ points
        breach, pull = self._breaches(places, near)
        weight /= len(self._times)
        moved = points - self._points
        drawn = self._stiffness @ moved
        slope = self._back @ (weight * pull) + 2.0 * drawn
        return weight * breach + float(np.sum(moved * drawn)), slope[self.free].ravel()

    def _breaches(self, places: Floats, near: _Near) -> tuple[float, Floats]:
        """Return the sum of all squared breaches, m^2, and its slope by all places, m. Shape (rows, 3)."""
        first, second = near.pairs[:, 0], near.pairs[:, 1]
        gaps = (places[first] - places[second]) * self._scale
        sizes = np.sqrt(np.sum(gaps**2, axis=1))
        aim = self._aim + near.drifts
        met = np.flatnonzero(sizes < aim)
        short, sizes = aim[met] - sizes[met], np.maximum(sizes[met], 1e-9)
        total = float(np.sum(short**2))
        push = (-2.0 * short / sizes)[:, None] * gaps[met] * self._scale
        out = np.minimum(places - self._low, 0.0) + np.maximum(places - self._high, 0.0)
        total += float(np.sum(out**2))
        pull = 2.0 * out
        for axis in range(3):
            pull[:, axis] += np.bincount(first[met], push[:, axis], len(places))
            pull[:, axis] -= np.bincount(second[met], push[:, axis], len(places))
        for body, rows in near.bodies:
            deep = _BODY_BUFFER - body.signed_distance(places[rows])
            rows, deep = rows[deep > 0.0], deep[deep > 0.0]
            if len(rows):
                beyond = body.signed_distance(places[rows] + _PROBE * np.eye(3)[:, None]).T
                total += float(np.sum(deep**2))
                pull[rows] -= 2.0 * deep[:, None] * (beyond - (_BODY_BUFFER - deep)[:, None]) / _PROBE
        return total, pull

    def bent(self, points: Floats) -> Bent:
        """Return the points, one array a robot, and who is nearest to whom."""
        near = self.near(points, 0.0)
        pairs = near.pairs
        own = tuple(points[a:b] for a, b in zip(self._bounds[:-1], self._bounds[1:], strict=True))
        if not len(pairs):
            return Bent(own, self._aim, (0, 0), 0.0)
        places = (self._places @ points) * self._scale
        sizes = np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1) - near.drifts
        least = int(np.argmin(sizes))
        one, other = (int(row) // len(self._times) for row in pairs[least])
        return Bent(
            own, min(float(sizes[least]), self._aim), (one, other), float(self._times[pairs[least, 0] % len(self._times)])
        )


def _sample_times(movers: Sequence[Mover], aim: float, scale: Floats) -> Floats:
    """Return times from the start to the last arrival, set by the greatest speed, s. Shape (samples,)."""
    until = max(robot.start + robot.path.duration for robot in movers)
    shares = np.linspace(0.0, 1.0, 17)
    fastest = max(float(np.linalg.norm(robot.path.sample(shares, 1) * scale, axis=-1).max()) for robot in movers)
    wanted = until * 2.0 * _SWERVING * fastest * _PER_DISTANCE / (2.0 * aim)
    return np.linspace(0.0, until, int(np.clip(np.ceil(wanted), 32, _MOST_SAMPLES)) + 1)


def _sampled(robot: Mover, times: Floats) -> Floats:
    """Return how a robot's places depend on its points. Shape (samples, points)."""
    path, nodes = robot.path, len(robot.path.nodes)
    known = np.full((nodes, 3, nodes), np.nan)
    known[[0, -1, *sorted(robot.rest)]] = 0.0
    unit = solve_banded(banded_problem(np.eye(nodes), path.durations, known if robot.rest - {0, nodes - 1} else None))
    local = np.clip(times - robot.start, 0.0, path.duration)
    piece = np.clip(np.searchsorted(path.knots, local, side="right") - 1, 0, len(path) - 1)
    local = np.clip(local - path.knots[piece], 0.0, path.durations[piece])
    found = np.zeros((len(times), nodes))
    for power in range(unit.coefficients.shape[2] - 1, -1, -1):
        found = found * local[:, None] + unit.coefficients[piece, :, power]
    return found


def _box(robot: Mover) -> tuple[Floats, Floats]:
    """Return the corners of the box that a robot is to stay in: what it is given, and the points that it must go through."""
    fixed = robot.path.nodes[~robot.free]
    low = np.minimum(robot.corridor.low + _BODY_BUFFER, fixed.min(axis=0))
    high = np.maximum(robot.corridor.high - _BODY_BUFFER, fixed.max(axis=0))
    return low, high


def _swing(points: Floats, beginning: Beginning, number: int) -> Floats:
    """Return by how much the points of one path swing aside at the beginning, m. Shape (points, 3)."""
    step = points[-1] - points[0]
    length = float(np.linalg.norm(step[:2]))
    if length < 1e-6:
        return np.zeros_like(points)
    share = np.clip((points - points[0]) @ step / (step @ step), 0.0, 1.0)
    right = np.array([step[1], -step[0], 0.0]) / length
    level = (number % beginning.layers) / max(beginning.layers - 1, 1) - 0.5
    aside = 2.0 * beginning.swirl * length * np.sqrt(share * (1.0 - share))
    up = 4.0 * beginning.height * level * share * (1.0 - share)
    return aside[:, None] * right + up[:, None] * np.array([0.0, 0.0, 1.0])
