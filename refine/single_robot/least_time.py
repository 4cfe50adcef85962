"""Least time over minimum-snap splines: durations and the points of visits, by L-BFGS with penalties for all limits.

The unknowns are the logarithms of durations, and for each visit that may lie anywhere in a body the point of a ball that is mapped
onto that body (so that no constraint is left: Wang, Zhou, Xu and Gao, T-RO 2022). Everything else follows as the spline of least snap
(`snap_family`), with the gradient by its adjoint. Penalties leave a little of each breach: whoever calls stretches it away.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from refine.corridor.corridor import Corridor
from refine.corridor.fitting import Rules, fixed_states
from refine.corridor.leg_limits import own_limits
from refine.limits.excess import Motion, Penalty
from refine.limits.stretching import SAFETY
from refine.obstacles.keep_out_bodies import Ball
from refine.single_robot.task import Task
from refine.spline.basis import HERMITE, ORDER, SNAP, bernstein_matrix, power_rows
from refine.spline.snap_family import SnapFamily
from refine.spline.spline import Spline
from verify.data import Infeasible, InternalError

Floats = NDArray[np.float64]

SHORTEST = 5e-2
"""Least duration of a piece, s: shorter ones lose their precision in float32."""
_LONGEST, _LONGER = 50.0, 10.0
"""Greatest duration of a piece, s, or how many times the longest at first where that is more: steps beyond went much too far."""
_INSTANTS = 8
"""Instants a piece at which limits count."""
_BREACH = 1e3
"""Weight of breaches of limits against time, both in units of the whole flight."""
_PLANE = 1.25e3
"""Weight of breaches of planes, in units of `_DEPTH`."""
_DEPTH = 0.05
"""m."""
_SNAP = 1e-3
"""Share of the objective that the snap of the first guess has, where time alone is least: it keeps the search from extremes."""
_STEPS = 150
"""Steps of L-BFGS, which end sooner where they no longer help."""
_MEMORY = 20
_EDGE = 0.99
"""How far towards the edge of its body a point may lie in the first guess: on the edge nothing moves it back."""

_AT = np.linspace(0.0, 1.0, _INSTANTS)
_DERIVATIVES = tuple(power_rows(_AT, order) @ HERMITE for order in (1, 2, 3, 4))
_SHARES = np.where((_AT == 0.0) | (_AT == 1.0), 0.5, 1.0) / (_INSTANTS - 1)
_POINTS = bernstein_matrix() @ HERMITE
_ORDERS = np.tile(np.arange(ORDER), 2)


@dataclass(frozen=True, eq=False, slots=True)
class Guess:
    """Durations and points through which a spline of least snap is nearly as fast as limits allow.

    Attributes:
        durations: s. Shape (pieces,).
        points: m. Shape (pieces + 1, 3).
    """

    durations: Floats
    points: Floats


def least_time(
    task: Task, rest: frozenset[int], rules: Rules, start: Guess, shortest: Floats, *, weight: float | None
) -> Guess:
    """Return durations and points of least time, or of least snap plus weighted time.

    Args:
        task: The robot's; says its limits and corridor.
        rest: Points at which it rests.
        rules: Planes that are written down so far.
        start: First guess.
        shortest: Least durations of the pieces, s. Shape (pieces,).
        weight: Of time against the integral of |snap|^2, m^2/s^7; None for time alone.

    Raises:
        Infeasible: The search came to durations whose sizes are too different for floats.
    """
    search = Search(task, rest, rules, start, weight)
    longest = max(_LONGEST, _LONGER * float(start.durations.max()))
    bounds = [(math.log(max(each, SHORTEST)), math.log(max(each, longest))) for each in shortest]
    bounds += [(None, None)] * (3 * len(search.nodes))
    options = {"maxiter": _STEPS, "maxcor": _MEMORY, "ftol": 1e-9, "gtol": 1e-6}
    with np.errstate(over="ignore", invalid="ignore"):  # of a step that went much too far, and is taken back
        try:
            found = minimize(search, search.packed(start), jac=True, method="L-BFGS-B", bounds=bounds, options=options)
        except InternalError as error:
            raise Infeasible(f"{task.name}: {error}") from error
    return search.unpacked(found.x)


def rooms_of(corridor: Corridor) -> list[tuple[int, Ball]]:
    """Return the nodes that may move, each with its body; a last node that repeats the cycle's moves with it."""
    last = None if corridor.cycle is None else len(corridor)
    return [(node, room) for node, room in enumerate(corridor.rooms) if room is not None and node != last]


class Search:
    """The sum that is made least: time, snap and squared breaches, with its gradient."""

    def __init__(self, task: Task, rest: frozenset[int], rules: Rules, start: Guess, weight: float | None) -> None:
        corridor = task.corridor
        self._start, self._cycle = start, corridor.cycle
        self._family = SnapFamily(fixed_states(corridor, rest), corridor.cycle)
        self._penalty = Penalty(
            task.limits.shrunk(SAFETY), *(each * (1.0 - SAFETY) for each in own_limits(task.mission, task.robot, corridor))
        )
        rooms = rooms_of(corridor)
        self.nodes = np.array([node for node, _ in rooms], dtype=np.int64)
        self._middles = np.array([room.centre for _, room in rooms]).reshape(-1, 3)
        self._maps = np.array([np.linalg.inv(room.root) for _, room in rooms]).reshape(-1, 3, 3)
        planes = [(leg, plane) for (_, leg, _), several in rules.items() for plane in several]
        self._legs = np.array([leg for leg, _ in planes], dtype=np.int64)
        self._normals = np.array([plane.normal for _, plane in planes]).reshape(-1, 3)
        self._offsets = np.array([plane.offset for _, plane in planes])
        self._monotone = np.array([float(plane.monotone) for _, plane in planes])
        self._total = float(start.durations.sum())
        first = self._family.at(start.durations, start.points)
        self._snap = (
            _SNAP / max(_snap_of(first.states, start.durations), 1e-12) if weight is None else 1.0 / (weight * self._total)
        )

    def packed(self, guess: Guess) -> Floats:
        """Return durations and points as unknowns."""
        offset = np.linalg.solve(self._maps, (guess.points[self.nodes] - self._middles)[..., None])[..., 0]
        size = np.linalg.norm(offset, axis=1, keepdims=True)
        offset *= _EDGE / np.maximum(size, _EDGE)
        inner = offset / (1.0 + np.sqrt(1.0 - np.sum(offset**2, axis=1, keepdims=True)))
        return np.append(np.log(guess.durations), inner.ravel())

    def unpacked(self, unknowns: Floats) -> Guess:
        """Return unknowns as durations and points."""
        pieces = len(self._start.durations)
        points, inner = self._start.points.copy(), unknowns[pieces:].reshape(-1, 3)
        offset = 2.0 * inner / (1.0 + np.sum(inner**2, axis=1, keepdims=True))
        points[self.nodes] = self._middles + (self._maps @ offset[..., None])[..., 0]
        if self._cycle is not None:
            points[-1] = points[self._cycle]
        return Guess(np.exp(unknowns[:pieces]), points)

    def __call__(self, unknowns: Floats) -> tuple[float, Floats]:
        """Return the sum and its gradient."""
        guess = self.unpacked(unknowns)
        times, inverse = guess.durations, 1.0 / guess.durations
        member = self._family.at(times, guess.points)
        scale = times[:, None] ** _ORDERS
        unit = np.concatenate([member.states[:-1], member.states[1:]], axis=1) * scale[:, :, None]
        motion = _motion(unit, inverse)
        breach = _BREACH / self._total
        excess, slopes = self._penalty(motion, breach * times[:, None] * _SHARES)
        snap, pull = np.einsum("nia,nia->n", unit, SNAP @ unit), SNAP @ unit
        weigh = self._snap * inverse**7
        value = times.sum() / self._total + excess.sum() + float(weigh @ snap)
        by_unit = 2.0 * weigh[:, None, None] * pull
        by_times = 1.0 / self._total + inverse * (excess - 7.0 * weigh * snap)
        for order, (rows, slope, moved) in enumerate(zip(_DERIVATIVES, slopes, motion, strict=True), start=1):
            by_unit += (rows.T @ slope) * (inverse**order)[:, None, None]
            by_times -= order * inverse * np.einsum("nma,nma->n", slope, moved)
        if len(self._legs):
            value += self._planes(unit, by_unit)
        by_times += inverse * np.einsum("nia,nia,i->n", by_unit, unit, _ORDERS)
        by_states, by_ends = np.zeros_like(member.states), by_unit * scale[:, :, None]
        by_states[:-1] += by_ends[:, :ORDER]
        by_states[1:] += by_ends[:, ORDER:]
        more, by_points = member.gradient(by_states)
        return float(value), self._by_unknowns(unknowns, (by_times + more) * times, by_points)

    def _planes(self, unit: Floats, by_unit: Floats) -> float:
        """Return the breaches of planes, and add their derivatives."""
        heights = np.einsum("kia,ka->ki", (_POINTS @ unit)[self._legs], self._normals)
        before = np.concatenate([heights[:, :1], heights[:, :-1]], axis=1)
        over = np.maximum((self._offsets[:, None] - heights + self._monotone[:, None] * before) / _DEPTH, 0.0)
        weight = _PLANE / self._total
        if over.any():
            slope = -2.0 * weight / _DEPTH * over
            by_heights = slope.copy()
            by_heights[:, :-1] -= self._monotone[:, None] * slope[:, 1:]
            by_heights[:, 0] -= self._monotone * slope[:, 0]
            np.add.at(by_unit, self._legs, _POINTS.T @ (by_heights[:, :, None] * self._normals[:, None, :]))
        return float(weight * np.sum(over**2))

    def _by_unknowns(self, unknowns: Floats, by_logs: Floats, by_points: Floats) -> Floats:
        """Return the gradient by the unknowns."""
        if self._cycle is not None:
            by_points[self._cycle] += by_points[-1]
        inner = unknowns[len(by_logs) :].reshape(-1, 3)
        by_offset = (by_points[self.nodes][:, None, :] @ self._maps)[:, 0]
        size = 1.0 + np.sum(inner**2, axis=1, keepdims=True)
        along = np.sum(inner * by_offset, axis=1, keepdims=True)
        return np.append(by_logs, (2.0 * by_offset / size - 4.0 * inner * along / size**2).ravel())


def _motion(unit: Floats, inverse: Floats) -> Motion:
    velocity, acceleration, jerk, snap = (
        (rows @ unit) * (inverse**order)[:, None, None] for order, rows in enumerate(_DERIVATIVES, start=1)
    )
    return velocity, acceleration, jerk, snap


def _snap_of(states: Floats, durations: Floats) -> float:
    return Spline(durations, states).snap_cost()
