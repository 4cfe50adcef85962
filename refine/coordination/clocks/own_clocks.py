"""A team on paths that stay as they are, each robot by a clock of its own: who would come too near another one flies more slowly before.

Who passes first is decided by `passing_orders`; then the clocks of all robots follow from one programme, in `clock_programme`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from refine.coordination.avoidance.conflict_resolution import Together, along, departures_of, paced
from refine.coordination.clocks.clock_programme import OwnClock, clocks_of, halts_of
from refine.coordination.clocks.earliest_times import GAP, After, Line
from refine.coordination.clocks.passing_orders import Orders, Stuck, passing_orders, zones_of
from refine.coordination.common_clock import retimed
from refine.coordination.departures import GRID, STEP, DepartureConflict
from refine.coordination.spacing import flight_of, hovers_of, idle_others
from refine.corridor.sampled_stays import violations
from refine.single_robot.flight import robot_flight
from refine.single_robot.hovers import hovering
from refine.single_robot.task import Problem, RobotFlight
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
_ROUNDING = 1e-9
"""s by which numbers of one time may differ."""
_MOST_ZONES = 500
"""Where robots are too near each other, at most: to decide who passes first takes time that goes by their square."""
_MOST_SOONER = 8
"""Paths that are laid around for the last arrival."""
_LATE = 1.05
"""How much later than the longest flight alone it may be without that."""
_REPAIRS = 4
"""How often robots that are too near each other on their clocks get more of a distance."""
_MOST_TRIES = 40
"""Paths that are laid around where another robot hovers."""


@dataclass(frozen=True, eq=False)
class _Team:
    """Robots on their paths, and who passes first.

    Attributes:
        robots: Their flights.
        clear_of: For each robot whose hovers its path keeps clear of.
        lines: Their cells.
        orders: Who passes first; else robots that leave each other no way, or None where not even waits can be kept.
    """

    robots: dict[str, RobotFlight]
    clear_of: dict[str, tuple[str, ...]]
    lines: list[Line]
    orders: Orders | Stuck | None

    def names(self, pair: tuple[int, int]) -> tuple[str, str]:
        """Return two robots' names."""
        names = list(self.robots)
        return names[pair[0]], names[pair[1]]


def on_own_clocks(problem: Problem, robots: dict[str, RobotFlight]) -> Together | None:
    """Return the team kept apart by clocks, waiting for each other as is asked; None where that is not found.

    Of two robots that leave each other no way, one gets a path that keeps clear of where the other one starts, waits and ends. So does one of
    two that have to pass in one order for that, where the last arrival is later for it.

    Args:
        problem: What is refined.
        robots: The team's flights without waits; they rest where they may have to wait.

    Raises:
        SolverTimeout: An engine's seconds ran out before its iterations.
    """
    if any(robot.cycle is not None for robot in robots.values()):
        return None
    team = _ordered(problem, robots, dict.fromkeys(robots, ()))
    tried: set[tuple[str, str]] = set()
    while team is not None and isinstance(team.orders, Stuck):
        team = _unstuck(problem, team, team.orders, tried)
    if team is None or team.orders is None:
        return None
    return _timed(problem, _less_in_the_way(problem, team))


def _unstuck(problem: Problem, team: _Team, stuck: Stuck, tried: set[tuple[str, str]]) -> _Team | None:
    """Return the team with another path for one of two robots; None where that was tried, or there is none."""
    for pair in map(team.names, stuck.pairs):
        for name, other in (pair, pair[::-1]):
            if (name, other) not in tried and len(tried) < _MOST_TRIES:
                tried.add((name, other))
                around = _around(problem, team, name, other)
                if around is not None:
                    return around
    return None


def _less_in_the_way(problem: Problem, team: _Team) -> _Team:
    """Return the team with other paths for robots that have to pass before others where these hover, if it arrives sooner for them."""
    tried: set[tuple[str, str]] = set()
    longest = max(line.earliest + float(line.times[-1]) for line in team.lines)
    while isinstance(team.orders, Orders) and team.orders.times.arrivals[0] > _LATE * longest:
        pairs = [names for pair in map(team.names, team.orders.firm) for names in (pair, pair[::-1]) if names not in tried]
        for name, other in pairs[: max(_MOST_SOONER - len(tried), 0)]:
            tried.add((name, other))
            trial = _around(problem, team, name, other)
            if (
                trial is not None
                and isinstance(trial.orders, Orders)
                and trial.orders.times.arrivals < team.orders.times.arrivals
            ):
                team = trial
                break
        else:
            break
    return team


def _around(problem: Problem, team: _Team, name: str, other: str) -> _Team | None:
    """Return the team with one robot's flight clear of where another one starts, waits and ends, by what cells do not see where that is possible."""
    robots = team.robots
    clear_of = {**team.clear_of, name: tuple(dict.fromkeys((*team.clear_of[name], other)))}
    idle, reach = idle_others(problem, name), float(_line(problem, robots[name]).reach.max())
    for more in (reach, 0.0):
        spacing = replace(problem.spacing, distance=problem.spacing.distance + more)
        places = [place for each in clear_of[name] for place in hovers_of(robots[each], spacing, problem.plan.meetings)]
        try:
            return _ordered(problem, {**robots, name: robot_flight(problem, name, (*idle, *places))}, clear_of)
        except Infeasible:
            continue
    return None


def _ordered(
    problem: Problem,
    robots: dict[str, RobotFlight],
    clear_of: dict[str, tuple[str, ...]],
    wider: Mapping[tuple[int, int], float] = MappingProxyType({}),
    slack: float = GAP,
) -> _Team | None:
    """Return the team with who passes first, waits kept by some slack, in s; None where robots are in each other's way too often."""
    lines = [_line(problem, robot) for robot in robots.values()]
    zones = zones_of(lines, problem.spacing.distance + _CLEARANCE, wider)
    if len(zones) > _MOST_ZONES:
        return None
    return _Team(robots, clear_of, lines, passing_orders(lines, zones, _waits(problem, robots, lines, slack)))


def _timed(problem: Problem, team: _Team) -> Together | None:
    """Return the team on its paths; None where no clocks keep all waits and limits."""
    robots, wider, slack = team.robots, dict[tuple[int, int], float](), GAP
    again: _Team | None = team
    for _ in range(_REPAIRS):
        if again is None or not isinstance(again.orders, Orders):
            return None
        clocks = clocks_of(list(robots.values()), again.lines, again.orders.differences, again.orders.times.arrivals[0])
        flown = None if clocks is None else _flown(problem, robots, clocks)
        if not isinstance(flown, DepartureConflict):
            return flown
        one, other = sorted(map(list(robots).index, flown.pair))
        if one == other:  # a wait is not kept
            slack += GRID
        else:
            short = max(problem.spacing.distance - flown.distance, 0.0) + _CLEARANCE
            wider[one, other] = wider.get((one, other), 0.0) + short
        again = _ordered(problem, robots, team.clear_of, wider, slack)
    return None


def _line(problem: Problem, robot: RobotFlight) -> Line:
    """Return a robot's cells."""
    path, spacing = robot.path, problem.spacing
    even = np.linspace(0.0, path.duration, max(int(np.ceil(path.duration / _CELL)), 1) + 1)
    times = np.sort(np.concatenate([even[:1], even, even[-1:], *[halts_of(robot)] * 2]))
    scale = np.array([1.0, 1.0, spacing.z_scale])
    borders, middles = _at(path, times) * scale, _at(path, 0.5 * (times[1:] + times[:-1])) * scale
    reach = np.maximum(*(np.linalg.norm(middles - each, axis=1) for each in (borders[:-1], borders[1:])))
    speeds = 2.0 * reach / np.maximum(np.diff(times), 1e-9)
    return Line(times, middles, _BULGE * reach + spacing.skew * speeds, robot.plan.hold)


def _at(path: Spline, times: Floats) -> Floats:
    piece = np.clip(np.searchsorted(path.knots, times, side="right") - 1, 0, len(path) - 1)
    local = np.minimum(times - path.knots[piece], path.durations[piece])
    found = np.zeros((len(times), 3))
    for power in range(path.coefficients.shape[2] - 1, -1, -1):
        found = found * local[:, None] + path.coefficients[piece, :3, power]
    return found


def _waits(problem: Problem, robots: Mapping[str, RobotFlight], lines: Sequence[Line], slack: float) -> list[After]:
    """Return the plan's waits and those of witnesses as differences of times, kept by some slack, s."""
    index = {name: number for number, name in enumerate(robots)}
    flights = {name: flight_of(problem.plan, robot) for name, robot in robots.items()}
    late = max(GRID / 2, 2 * (problem.spacing.skew + STEP)) + slack
    found: list[After] = []
    for wait in problem.feedback.precedences:
        first, then = wait.first[0], wait.then[0]
        arriving = GRID if isinstance(wait, Meeting) else 0.0
        over = flights[first].done(wait) - arriving
        done = np.searchsorted(lines[index[first]].times, over - _ROUNDING)
        due = np.searchsorted(lines[index[then]].times, flights[then].due(wait) + _ROUNDING, side="right") - 1
        done = min(int(done), len(lines[index[first]].times) - 1)
        found.append(After(index[first], np.array([done]), index[then], np.array([max(int(due), 0)]), late + arriving))
    return found


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
