"""A team on paths that stay as they are, each robot by a clock of its own: who would come too near another one flies more slowly before.

Who passes first is decided by `passing_orders`. Then the clocks of all robots follow from one quadratic programme in the coefficients of
their splines: the last arrival and all others are early, and clocks bend little. At rests a clock may stand still; elsewhere robots creep.
The programme is sparse: a row concerns the clocks of one robot or two, each by a few coefficients.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.interpolate import BSpline

from refine.coordination.common_clock import retimed
from refine.coordination.conflict_resolution import Together, along, departures_of, paced
from refine.coordination.departures import GRID, STEP, DepartureConflict
from refine.coordination.midway_waits import hovering
from refine.coordination.passing_orders import GAP, After, Line, passing_orders, zones_of
from refine.coordination.spacing import flight_of, hovers_of, idle_others
from refine.corridor.sampled_stays import violations
from refine.single_robot.flight import robot_flight
from refine.single_robot.task import Problem, RobotFlight
from refine.solvers.sparse_qp import least
from refine.spline.spline import Spline
from verify.data import Infeasible
from verify.data.plan import Meeting

Floats = NDArray[np.float64]

_CELL = 0.1
"""s of its own time that a cell of a path lasts at most."""
_BULGE = 1.1
"""How much farther a robot may be from the middle of a cell than at the cell's ends."""
_CLEARANCE = 0.01
"""m on top of the distance: what cells do not see."""
_DEGREE = 5
_KNOT = 0.35
"""s of its own time between two knots of a robot's clock, about."""
_FEWEST = 4
_BENDS = 1.5
"""1/s: by how much at most a clock's slowness changes in a second of its own time, where it is 1. Where it is s, it changes by s^3 times as
much for the same acceleration: by the tangent of that, which lies below."""
_SLOWEST = 40.0
"""How many times slower than its own time a robot creeps at most."""
_OTHERS = 0.1
"""Weight of the mean arrival against the last one."""
_SMOOTH = 2e-3
"""Weight of squared bends, against s."""
_MOST_ZONES = 500
"""Where robots are too near each other, at most: to decide who passes first takes time that goes by their square."""
_REPAIRS = 4
"""How often robots that are too near each other on their clocks get more of a distance."""
_MOST_TRIES = 40
"""Paths that are laid around where another robot hovers."""


@dataclass(frozen=True, slots=True)
class _Stuck:
    pair: tuple[str, str]
    """Two robots that leave each other no way."""


def on_own_clocks(problem: Problem, robots: dict[str, RobotFlight]) -> Together | None:
    """Return the team kept apart by clocks, waiting for each other as is asked; None where that is not found.

    Of two robots that leave each other no way, one gets a path that keeps clear of where the other one starts, waits and ends.

    Args:
        problem: What is refined.
        robots: The team's flights without waits; they rest where they may have to wait.

    Raises:
        SolverTimeout: An engine's seconds ran out before its iterations.
    """
    if any(robot.cycle is not None for robot in robots.values()):
        return None
    clear_of: dict[str, tuple[str, ...]] = dict.fromkeys(robots, ())
    tried: set[tuple[str, str]] = set()
    while isinstance(found := _timed(problem, robots), _Stuck):
        for name, other in (found.pair, found.pair[::-1]):
            if (name, other) in tried or len(tried) >= _MOST_TRIES:
                continue
            tried.add((name, other))
            clear_of[name] = tuple(dict.fromkeys((*clear_of[name], other)))
            around = _around(problem, robots, name, clear_of[name])
            if around is not None:
                robots = {**robots, name: around}
                break
        else:
            return None
    return found


def _around(problem: Problem, robots: Mapping[str, RobotFlight], name: str, others: Sequence[str]) -> RobotFlight | None:
    """Return a robot's flight clear of where others start, wait and end, by what cells do not see where that is possible; None where there is none."""
    idle, reach = idle_others(problem, name), float(_line(problem, robots[name]).reach.max())
    for more in (reach, 0.0):
        spacing = replace(problem.spacing, distance=problem.spacing.distance + more)
        places = [place for other in others for place in hovers_of(robots[other], spacing, problem.plan.meetings)]
        try:
            return robot_flight(problem, name, (*idle, *places))
        except Infeasible:
            continue
    return None


def _timed(problem: Problem, robots: dict[str, RobotFlight]) -> Together | _Stuck | None:
    """Return the team on its paths; or two robots that leave each other no way, or None where no clocks keep all waits and limits."""
    names, lines = list(robots), [_line(problem, robot) for robot in robots.values()]
    wider: dict[tuple[int, int], float] = {}
    for _ in range(_REPAIRS):
        zones = zones_of(lines, problem.spacing.distance + _CLEARANCE, wider)
        if len(zones) > _MOST_ZONES:
            return None
        orders = passing_orders(lines, zones, _waits(problem, robots, lines))
        if orders is None:
            return None
        if isinstance(orders, tuple):
            return _Stuck((names[orders[0]], names[orders[1]]))
        clocks = _clocks(list(robots.values()), lines, orders)
        flown = None if clocks is None else _flown(problem, robots, clocks)
        if not isinstance(flown, DepartureConflict):
            return flown
        one, other = sorted(map(names.index, flown.pair))
        if one == other:
            return None
        short = max(problem.spacing.distance - flown.distance, 0.0) + _CLEARANCE
        wider[one, other] = wider.get((one, other), 0.0) + short
    return None


def _line(problem: Problem, robot: RobotFlight) -> Line:
    """Return a robot's cells."""
    path, spacing = robot.path, problem.spacing
    even = np.linspace(0.0, path.duration, max(int(np.ceil(path.duration / _CELL)), 1) + 1)
    times = np.sort(np.concatenate([even[:1], even, even[-1:], *[_halts(robot)] * 2]))
    scale = np.array([1.0, 1.0, spacing.z_scale])
    borders, middles = _at(path, times) * scale, _at(path, 0.5 * (times[1:] + times[:-1])) * scale
    reach = np.maximum(*(np.linalg.norm(middles - each, axis=1) for each in (borders[:-1], borders[1:])))
    speeds = 2.0 * reach / np.maximum(np.diff(times), 1e-9)
    return Line(times, middles, _BULGE * reach + spacing.skew * speeds, robot.plan.hold)


def _halts(robot: RobotFlight) -> Floats:
    """Return the own times at which a robot rests on its way and may wait, s."""
    knots = robot.path.knots
    return np.array(sorted({float(knots[node]) for node in robot.halts.values() if 0 < node < len(knots) - 1}))


def _at(path: Spline, times: Floats) -> Floats:
    piece = np.clip(np.searchsorted(path.knots, times, side="right") - 1, 0, len(path) - 1)
    local = np.minimum(times - path.knots[piece], path.durations[piece])
    found = np.zeros((len(times), 3))
    for power in range(path.coefficients.shape[2] - 1, -1, -1):
        found = found * local[:, None] + path.coefficients[piece, :3, power]
    return found


def _waits(problem: Problem, robots: Mapping[str, RobotFlight], lines: Sequence[Line]) -> list[After]:
    """Return the plan's waits and those of witnesses as differences of times."""
    index = {name: number for number, name in enumerate(robots)}
    flights = {name: flight_of(problem.plan, robot) for name, robot in robots.items()}
    late = max(GRID / 2, 2 * (problem.spacing.skew + STEP)) + GRID
    found: list[After] = []
    for wait in problem.feedback.precedences:
        first, then = wait.first[0], wait.then[0]
        done = np.searchsorted(
            lines[index[first]].times, flights[first].done(wait) - (GRID if isinstance(wait, Meeting) else 0.0)
        )
        due = np.searchsorted(lines[index[then]].times, flights[then].due(wait), side="right") - 1
        done = min(int(done), len(lines[index[first]].times) - 1)
        found.append(After(index[first], np.array([done]), index[then], np.array([max(int(due), 0)]), late + GRID))
    return found


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

    def __init__(self, robot: RobotFlight, offset: int) -> None:
        self.end = robot.path.duration
        spans = max(int(np.ceil(self.end / _KNOT)), _FEWEST)
        self.knots = np.concatenate([np.zeros(_DEGREE), np.linspace(0.0, self.end, spans + 1), np.full(_DEGREE, self.end)])
        self.halts = _halts(robot)
        self.count = spans + _DEGREE
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


def _clocks(
    robots: Sequence[RobotFlight], lines: Sequence[Line], differences: Sequence[After]
) -> dict[str, tuple[OwnClock, float]] | None:
    """Return each robot's clock and departure; None where the programme has no answer."""
    unknowns: list[_Unknowns] = []
    for robot in robots:
        unknowns.append(_Unknowns(robot, unknowns[-1].departure + unknowns[-1].total if unknowns else 0))
    last = unknowns[-1].departure + unknowns[-1].total  # the last arrival
    rows, linear, bends = _Rows(), np.zeros(last + 1), list[sparse.csc_matrix]()
    linear[last] = 1.0
    for own, line in zip(unknowns, lines, strict=True):
        rows.add(np.array([own.departure]), np.ones(1), line.earliest)
        for wait in own.waits:
            rows.add(np.array([wait]), np.ones(1), 0.0)
        rows.add(own.clock[:1], np.ones(1), 0.0, 0.0)
        slopes = _DEGREE / (own.knots[_DEGREE + 1 : -1] - own.knots[1 : -_DEGREE - 1])
        for k, slope in enumerate(slopes):
            rows.add(own.clock[k : k + 2], np.array([-slope, slope]), 1.0, _SLOWEST)
        step = (own.knots[_DEGREE + 1 : -2] - own.knots[2 : -_DEGREE - 1]) / (_DEGREE - 1)
        for k, size in enumerate(step):
            part, change = 0.5 * _BENDS * size, np.array([[-slopes[k], slopes[k], 0.0], [0.0, -slopes[k + 1], slopes[k + 1]]])
            rows.add(own.clock[k : k + 3], (3.0 * part + 1.0) * change[0] + (3.0 * part - 1.0) * change[1], 4.0 * part)
            rows.add(own.clock[k : k + 3], (3.0 * part - 1.0) * change[0] + (3.0 * part + 1.0) * change[1], 4.0 * part)
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


def _two_diagonals(here: Floats, next_one: Floats) -> sparse.csc_matrix:
    """Return rows with two entries each, one beside the other. Shape (rows, rows + 1)."""
    rows = np.arange(len(here))
    return sparse.csc_matrix(
        (np.concatenate([here, next_one]), (np.tile(rows, 2), np.append(rows, rows + 1))), (len(rows), len(rows) + 1)
    )


def _flown(
    problem: Problem, robots: dict[str, RobotFlight], clocks: Mapping[str, tuple[OwnClock, float]]
) -> Together | DepartureConflict | None:
    """Return the team on its clocks, slowed as a whole where limits ask for it; else who is too near whom, or None where a label is not kept."""
    plan, flown, slower = problem.plan, dict[str, RobotFlight](), 1.0
    for name, robot in robots.items():
        clock, _ = clocks[name]
        if robot.corridor is None:
            flown[name] = robot
            continue
        held = problem.options.held(plan.mission, name)
        path = retimed(
            robot.path, 0.0, clock, None if held is None else held - 1 - sum(wait > GAP / 2 for _, wait in clock.waits)
        )
        times = clock.flown(robot.path.knots)
        try:
            turned, factor = along(problem, robot, path)
        except Infeasible:
            return None
        slower = max(slower, factor)
        halts = {visit: int(np.argmin(np.abs(path.knots - times[node]))) for visit, node in robot.halts.items()}
        flown[name] = replace(turned, halts=halts)
    team: dict[str, RobotFlight] = {}
    for name, robot in flown.items():
        clock, _ = clocks[name]
        waits = {int(np.argmin(np.abs(robot.path.knots - clock.flown(np.array([at]))[0]))): wait for at, wait in clock.waits}
        team[name] = hovering(paced(robot, slower), {node: slower * wait for node, wait in waits.items() if wait > GAP / 2})
    starts = {name: slower * departure for name, (_, departure) in clocks.items()}
    if any(violations(robot.path, plan.mission, name, plan.robots[name]) for name, robot in team.items()):
        return None
    found = departures_of(problem, team, starts)
    return found if isinstance(found, DepartureConflict) else (team, starts)
