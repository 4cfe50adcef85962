"""Clocks of all robots of a team that keeps to its paths, by one programme.

The programme is quadratic in the coefficients of the clocks' splines: the last arrival and all others are early, and clocks bend little. At
rests a clock may stand still; elsewhere robots creep. The programme is sparse: a row concerns the clocks of one robot or two, each by a few
coefficients.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.interpolate import BSpline

from refine.coordination.clocks.earliest_times import After, Line
from refine.single_robot.task import RobotFlight
from refine.solvers.sparse_qp import least

Floats = NDArray[np.float64]

_DEGREE = 5
_KNOT = 0.35
"""s of its own time between two knots of a robot's clock, about."""
_FEWEST = 4
_BENDS = 1.5
"""1/s: by how much at most a clock's slowness changes in a second of its own time, where it is 1. Where it is s, it changes by s^3 times as
much for the same acceleration: by the tangent of that, which lies below."""
_POWER, _SLOW = 2.5, 1.3
"""In later rounds bends go with this power of slowness, by which jerk hardly grows, above this slowness, from which on that allows more."""
_CREEPS, _FINEST = 1.5, 0.1
"""Spans between knots that are longer, in s of own time, are halved in later rounds where a clock is slower than this."""
_ROUNDS = 4
"""How often clocks are found again with the limits of their bends taken at those before."""
_SOON = 1.03
"""How much later than if clocks could bend at will the last robot may arrive without that."""
_SLOWEST = 40.0
"""How many times slower than its own time a robot creeps at most."""
_OTHERS = 0.1
"""Weight of the mean arrival against the last one."""
_SMOOTH = 2e-3
"""Weight of squared bends, against s."""


@dataclass(frozen=True, eq=False, slots=True)
class OwnClock:
    """A robot's clock: when it flies what is due at its own times, by a spline.

    Attributes:
        spline: From own times to those that are flown, s, waits at rests left out.
        end: Its last own time, s.
        waits: Own times of rests, and the waits there, s.
    """

    spline: BSpline
    end: float
    waits: tuple[tuple[float, float], ...]

    def flown(self, plan: Floats) -> Floats:
        """Return when own times are flown, s."""
        return self.spline(np.clip(plan, 0.0, self.end))

    def plan(self, flown: Floats) -> Floats:
        """Return the own times at times that are flown, s, about."""
        fine = np.linspace(0.0, self.end, int(self.end / 2e-3) + 2)
        return np.interp(flown, self.spline(fine), fine)

    def rates(self, plan: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the first three derivatives of own time by the flown one. Shapes (times,)."""
        at = np.clip(plan, 0.0, self.end)
        slow, bend, turn = (self.spline(at, order) for order in (1, 2, 3))
        return 1.0 / slow, -bend / slow**3, (3.0 * bend**2 - slow * turn) / slow**5


def halts_of(robot: RobotFlight) -> Floats:
    """Return the own times at which a robot rests on its way and may wait, s.

    Args:
        robot: Its flight.
    """
    knots = robot.path.knots
    return np.array(sorted({float(knots[node]) for node in robot.halts.values() if 0 < node < len(knots) - 1}))


class _Rows:
    """Rows of the programme, written down one after the other."""

    def __init__(self) -> None:
        self.low: list[float] = []
        self.high: list[float] = []
        self._entries: list[tuple[int, NDArray[np.intp], Floats]] = []

    def add(self, columns: NDArray[np.intp], values: Floats, low: float, high: float = np.inf) -> None:
        self._entries.append((len(self.low), columns, values))
        self.low.append(low)
        self.high.append(high)

    def matrix(self, unknowns: int) -> sparse.csc_matrix:
        rows = np.concatenate([np.full(len(columns), row) for row, columns, _ in self._entries])
        columns = np.concatenate([columns for _, columns, _ in self._entries])
        values = np.concatenate([values for _, _, values in self._entries])
        return sparse.csc_matrix((values, (rows, columns)), (len(self.low), unknowns))


class _Unknowns:
    """Layout of one robot's unknowns: when it departs, how long it waits at rests, and the coefficients of its clock."""

    def __init__(self, robot: RobotFlight, offset: int, about: OwnClock | None) -> None:
        self.end = robot.path.duration
        even = np.linspace(0.0, self.end, max(int(np.ceil(self.end / _KNOT)), _FEWEST) + 1)
        inner = even if about is None else _finer(about)
        self.knots = np.concatenate([np.zeros(_DEGREE), inner, np.full(_DEGREE, self.end)])
        self.halts = halts_of(robot)
        self.count = len(inner) - 1 + _DEGREE
        self.departure = offset
        self.waits = offset + 1 + np.arange(len(self.halts))
        self.clock = offset + 1 + len(self.halts) + np.arange(self.count)
        self.total = 1 + len(self.halts) + self.count

    def when(self, line: Line, number: int) -> tuple[NDArray[np.intp], Floats]:
        """Return the row that says when one of a line's times is flown."""
        time = float(line.times[number])
        before = number + 1 < len(line.times) and line.times[number + 1] == time  # where a rest begins
        passed = self.waits[(self.halts < time) | ((self.halts == time) & (not before))]
        first = int(np.clip(np.searchsorted(self.knots, time, side="right") - 1, _DEGREE, self.count - 1))
        basis = BSpline.design_matrix(np.array([min(time, self.end)]), self.knots, _DEGREE).toarray()[0]
        near = np.arange(first - _DEGREE, first + 1)
        columns = np.concatenate([[self.departure], passed, self.clock[near]])
        return columns, np.concatenate([np.ones(1 + len(passed)), basis[near]])


Clocks = dict[str, tuple[OwnClock, float]]
"""Each robot's clock, and its departure in s."""


def last_of(clocks: Clocks) -> float:
    """Return when the last robot arrives, s.

    Args:
        clocks: Of the team.
    """
    return max(
        departure + float(clock.flown(np.array([clock.end]))[0]) + sum(wait for _, wait in clock.waits)
        for clock, departure in clocks.values()
    )


def clocks_of(
    robots: Sequence[RobotFlight], lines: Sequence[Line], differences: Sequence[After], soonest: float = np.inf
) -> Clocks | None:
    """Return each robot's clock and departure; None where the programme has no answer.

    Args:
        robots: Their flights.
        lines: Their cells.
        differences: Who waits for whom.
        soonest: When the last robot would arrive if clocks could bend at will, s. Where it arrives much later, the limits of bends are
            taken at the clocks that were found, by which these are still possible, and those that are sooner become so.

    Raises:
        SolverTimeout: The engine's seconds ran out before its iterations.
    """
    found = _clocks_about(robots, lines, differences, {})
    for _ in range(_ROUNDS):
        if found is None or (last := last_of(found)) <= _SOON * soonest:
            break
        better = _clocks_about(robots, lines, differences, found)
        if better is None or last_of(better) >= last:
            break
        found = better
    return found


def _clocks_about(
    robots: Sequence[RobotFlight], lines: Sequence[Line], differences: Sequence[After], about: Clocks
) -> Clocks | None:
    """Return clocks whose bends are limited by tangents at other ones; at the robots' own times where there are none."""
    unknowns: list[_Unknowns] = []
    for robot in robots:
        offset = unknowns[-1].departure + unknowns[-1].total if unknowns else 0
        unknowns.append(_Unknowns(robot, offset, about[robot.name][0] if about else None))
    last = unknowns[-1].departure + unknowns[-1].total  # the last arrival
    rows, linear, bends = _Rows(), np.zeros(last + 1), list[sparse.csc_matrix]()
    linear[last] = 1.0
    for robot, own, line in zip(robots, unknowns, lines, strict=True):
        rows.add(np.array([own.departure]), np.ones(1), line.earliest)
        for wait in own.waits:
            rows.add(np.array([wait]), np.ones(1), 0.0)
        rows.add(own.clock[:1], np.ones(1), 0.0, 0.0)
        slopes = _DEGREE / (own.knots[_DEGREE + 1 : -1] - own.knots[1 : -_DEGREE - 1])
        for k, slope in enumerate(slopes):
            rows.add(own.clock[k : k + 2], np.array([-slope, slope]), 1.0, _SLOWEST)
        step = (own.knots[_DEGREE + 1 : -2] - own.knots[2 : -_DEGREE - 1]) / (_DEGREE - 1)
        slant, base = _tangents(about[robot.name][0] if about else None, own.knots)
        for k, size in enumerate(step):
            part, change = 0.5 * _BENDS * size, np.array([[-slopes[k], slopes[k], 0.0], [0.0, -slopes[k + 1], slopes[k + 1]]])
            (one, other), low = part * slant[k : k + 2], part * base[k : k + 2].sum()
            rows.add(own.clock[k : k + 3], (one + 1.0) * change[0] + (other - 1.0) * change[1], low)
            rows.add(own.clock[k : k + 3], (one - 1.0) * change[0] + (other + 1.0) * change[1], low)
        columns, values = own.when(line, len(line.times) - 1)
        linear[columns] += _OTHERS / len(robots) * values
        rows.add(np.append(columns, last), np.append(-values, 1.0), 0.0)
        second = _two_diagonals(-slopes, slopes)
        changes = _two_diagonals(-1.0 / step, 1.0 / step) @ second
        bends.append(sparse.csc_matrix(changes.T @ sparse.diags(step) @ changes))
    for after in differences:
        for done, due in zip(after.done.tolist(), after.due.tolist(), strict=True):
            then, first = (
                unknowns[after.then].when(lines[after.then], due),
                unknowns[after.first].when(lines[after.first], done),
            )
            rows.add(np.concatenate([then[0], first[0]]), np.concatenate([then[1], -first[1]]), after.gap)
    squares = sparse.block_diag(
        [
            part
            for own, bend in zip(unknowns, bends, strict=True)
            for part in (sparse.csc_matrix((own.total - own.count,) * 2), bend)
        ]
        + [sparse.csc_matrix((1, 1))],
        format="csc",
    )
    answer = least(2.0 * _SMOOTH * squares, linear, rows.matrix(last + 1), np.array(rows.low), np.array(rows.high))
    if answer is None:
        return None
    found: dict[str, tuple[OwnClock, float]] = {}
    for robot, own in zip(robots, unknowns, strict=True):
        waits = tuple(zip(own.halts.tolist(), np.maximum(answer[own.waits], 0.0).tolist(), strict=True))
        coefficients = answer[own.clock] - answer[own.clock[0]]
        found[robot.name] = OwnClock(BSpline(own.knots, coefficients, _DEGREE), own.end, waits), float(answer[own.departure])
    return found


def _finer(clock: OwnClock) -> Floats:
    """Return a clock's knots, with others in the middle of spans in which it creeps. Shape (knots,)."""
    knots = clock.spline.t[_DEGREE:-_DEGREE]
    middles = 0.5 * (knots[1:] + knots[:-1])
    creeps = (clock.spline(middles, 1) > _CREEPS) & (np.diff(knots) > _FINEST)
    return np.sort(np.concatenate([knots, middles[creeps]]))


def _tangents(about: OwnClock | None, knots: Floats) -> tuple[Floats, Floats]:
    """Return tangents of what limits bends, at a clock's slowness: their slants, and what is taken off. Shapes (slopes,)."""
    middles = np.array([knots[k + 2 : k + _DEGREE + 1].mean() for k in range(len(knots) - _DEGREE - 2)])
    slowness = np.ones(len(middles)) if about is None else np.maximum(about.spline(middles, 1), 1.0)
    later = slowness > _SLOW
    return (
        np.where(later, _POWER * slowness ** (_POWER - 1.0), 3.0),
        np.where(later, (_POWER - 1.0) * slowness**_POWER, 2.0),
    )


def _two_diagonals(here: Floats, next_one: Floats) -> sparse.csc_matrix:
    """Return rows with two entries each, one beside the other. Shape (rows, rows + 1)."""
    rows = np.arange(len(here))
    return sparse.csc_matrix(
        (np.concatenate([here, next_one]), (np.tile(rows, 2), np.append(rows, rows + 1))), (len(rows), len(rows) + 1)
    )
