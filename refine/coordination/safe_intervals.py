"""The last resort of a team: everyone rests at each point of its way and waits there until the next leg is clear.

Robots are scheduled one after the other, in several orders. The ways are fixed, so what is left to choose is when to set out
on each leg: a search over (point, time) in which a leg or a wait is allowed only where it keeps clear of the robots before
(safe intervals along a path, as in SIPP of Phillips and Likhachev, 2011). Times are on the grid of departures.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from refine.coordination.departures import (
    COARSE,
    GRID,
    STEP,
    DepartureConflict,
    Orders,
    departures,
    lag_of,
    most_nearby,
    reach_of,
    wider,
)
from refine.coordination.spacing import flight_of
from refine.heading.yaw import heading_spline
from refine.limits.stretching import stretch_to_limits
from refine.single_robot.hovers import with_hovers
from refine.single_robot.task import RobotFlight
from refine.spline.spline import Spline
from verify.data import Mission, Plan
from verify.data.validation.spacing import Spacing

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Track = tuple[Floats, Floats, Floats]
"""Where a robot is at every sample of the whole time, m, z scaled, its reach there, and how far it flies in the clocks' error.
Shapes (samples, 3), (samples,), (samples,)."""

_PER_GRID = round(GRID / STEP)
_ORDERS = 24
_NUMBERS = 1_000_000
"""Points that are compared at once, for the memory's sake."""
SCHEDULE_CLEARANCE = 2e-3
"""m on top of the distance, so that the schedule's own check finds it kept."""


def schedule_safe_intervals(
    plan: Plan, teams: Iterable[dict[str, RobotFlight]], spacing: Spacing, max_pieces: int | None
) -> tuple[dict[str, RobotFlight], dict[str, float]] | None:
    """Return a team that waits on the way where it has to, and departures; None where no order of the robots works.

    Args:
        plan: Carries the mission.
        teams: Robots that rest at every point, and the same ones on other ways; the first that works is taken.
        spacing: What they keep.
        max_pieces: Pieces that a robot may fly, hovers included; None for any number.

    Raises:
        Infeasible: A robot's limits cannot be kept at any pace.
    """
    for robots in teams:
        gridded = {name: on_time_grid(plan.mission, robot) for name, robot in robots.items()}
        timetable = _Timetable(gridded, spacing)
        still = tuple(name for name, robot in gridded.items() if robot.corridor is None)  # whoever never moves comes first
        orders = Orders(tuple(name for name in gridded if name not in still), _ORDERS)
        for order in orders:
            waits = timetable.waits((*still, *order))
            if isinstance(waits, str):
                orders.stuck(order, waits)
                continue
            team = {name: with_hovers(robot, dict(enumerate([0.0, *waits[name][1:]]))) for name, robot in gridded.items()}
            starts = {name: float(waits[name][0]) for name in robots}
            if max_pieces is not None and any(len(team[name].path) + (starts[name] > 0.0) > max_pieces for name in team):
                continue
            flights = [flight_of(plan, robot) for robot in team.values()]
            found = departures(flights, distance=spacing.distance, z_scale=spacing.z_scale, skew=spacing.skew, given=starts)
            if not isinstance(found, DepartureConflict):
                return team, starts
    return None


def on_time_grid(mission: Mission, robot: RobotFlight) -> RobotFlight:
    """Return a robot whose legs last whole steps of the grid, at least as long as before.

    Raises:
        Infeasible: Its limits cannot be kept at any pace.
    """
    if robot.corridor is None:
        return robot
    path, rest = robot.path, frozenset(range(len(robot.path) + 1))
    agent, factor = mission.agents[robot.name], 1.0
    while True:
        path = Spline(np.ceil(factor * path.durations / GRID - 1e-9) * GRID, path.states)
        yaw = heading_spline(path, agent.heading, agent.yaw, rest=rest)
        factor = stretch_to_limits(path, yaw, robot.limits)
        if factor <= 1.0:
            return replace(robot, path=path, yaw=yaw, halts={})


class _Timetable:
    """Departures of robots on their legs, one after the other; flights of robots that go first are worked out once."""

    def __init__(self, robots: dict[str, RobotFlight], spacing: Spacing) -> None:
        total = sum(robot.path.duration + robot.plan.hold for robot in robots.values())
        self._robots, self._spacing, self._steps = robots, spacing, int(np.ceil(total / GRID)) + 2
        self._known: dict[tuple[str, ...], tuple[Floats, Track] | None] = {}

    def waits(self, order: tuple[str, ...]) -> dict[str, Floats] | str:
        """Return for each robot how long it waits at each of its points, in s, or who finds no way through."""
        waits: dict[str, Floats] = {}
        tracks: list[Track] = []
        for count, name in enumerate(order, start=1):
            first = order[:count]
            if first not in self._known:
                self._known[first] = self._next(self._robots[name], tracks)
            found = self._known[first]
            if found is None:
                return name
            waits[name] = found[0]
            tracks.append(found[1])
        return waits

    def _next(self, robot: RobotFlight, tracks: list[Track]) -> tuple[Floats, Track] | None:
        waits = earliest_waits(robot, tracks, self._steps, self._spacing)
        return None if waits is None else (waits, track_of(robot, waits, self._steps, self._spacing))


def _legs(robot: RobotFlight, spacing: Spacing) -> list[Floats]:
    """Return the samples of each leg, its end left out, z scaled. Shapes (samples, 3)."""
    if robot.corridor is None:
        return [np.zeros((0, 3)) for _ in robot.path.durations]
    counts = [round(duration / STEP) for duration in robot.path.durations]
    sampled = {count: robot.path.sample(np.arange(count) / count) for count in set(counts)}
    return [sampled[count][leg][:, :3] * np.array([1.0, 1.0, spacing.z_scale]) for leg, count in enumerate(counts)]


def track_of(robot: RobotFlight, waits: Floats, steps: int, spacing: Spacing) -> Track:
    """Return the track of a robot that waits at its points.

    Args:
        robot: Whose legs last whole steps of the grid.
        waits: At its points, s. Shape (legs,).
        steps: Of the grid, over the whole time.
        spacing: How z counts.
    """
    legs, scale = _legs(robot, spacing), np.array([1.0, 1.0, spacing.z_scale])
    nodes = robot.path.nodes[:, :3] * scale
    parts: list[Floats] = []
    for leg, wait in zip(legs, waits, strict=True):
        start = nodes[len(parts) // 2]
        parts += [np.repeat(start[None], round(wait / STEP), axis=0), leg]
    track = np.concatenate([*parts, nodes[-1:]])
    count = steps * _PER_GRID + 1
    track = np.concatenate([track, np.repeat(track[-1:], max(count - len(track), 0), axis=0)])[:count]
    return track, reach_of(track), lag_of(track, spacing.skew)


def earliest_waits(robot: RobotFlight, tracks: list[Track], steps: int, spacing: Spacing) -> Floats | None:
    """Return a robot's waits at its points so that it ends as early as the others allow; None where they do not.

    Args:
        robot: Whose legs last whole steps of the grid.
        tracks: The robots' that go first.
        steps: Of the grid, over the whole time.
        spacing: What is kept.
    """
    legs = _legs(robot, spacing)
    nodes = robot.path.nodes[:, :3] * np.array([1.0, 1.0, spacing.z_scale])
    hovers = np.array([_hover_clear(node, tracks, steps, spacing.distance) for node in nodes])
    hold = int(np.ceil(robot.plan.hold / GRID - 1e-9))
    if robot.corridor is None:
        return np.append(hold * GRID, np.zeros(len(legs) - 1)) if hovers[0].all() else None
    lasts = [round(duration / GRID) for duration in robot.path.durations]
    clears = [_leg_clear(leg, tracks, steps, spacing) for leg in legs]
    arrived = np.zeros((len(nodes), steps + 1), dtype=bool)
    arrived[0, 0] = True
    for node, clear in enumerate(clears):
        last, there = lasts[node], _there(arrived[node], hovers[node])
        sets_out = there[: steps + 1 - last] & clear[: steps + 1 - last]
        if node == 0:
            sets_out[:hold] = False
        arrived[node + 1, last:] = sets_out
    stays = np.append(np.flip(np.logical_and.accumulate(np.flip(hovers[-1]))), True)
    ends = np.flatnonzero(arrived[-1] & stays)
    if not len(ends):
        return None
    waits, time = np.zeros(len(legs)), int(ends[0])
    for node in range(len(legs) - 1, -1, -1):
        time -= lasts[node]
        came = int(np.flatnonzero(arrived[node, : time + 1])[-1])  # the last arrival from which waiting leads here
        waits[node], time = (time - came) * GRID, came
    return waits


def _there(arrived: Flags, hovers: Flags) -> Flags:
    """Return when a robot may be at a point, where it may wait: shapes (steps + 1,), (steps,) to (steps + 1,)."""
    steps = np.arange(len(arrived))
    came = np.maximum.accumulate(np.where(arrived, steps, -1))
    blocked = np.append(-1, np.maximum.accumulate(np.where(hovers, -1, steps[:-1])))
    return (came >= 0) & (came > blocked)


def _hover_clear(node: Floats, tracks: list[Track], steps: int, distance: float) -> Flags:
    """Tell for each step of the grid whether a hover during it keeps the distance. Shape (steps,)."""
    clear = np.ones(steps, dtype=bool)
    for track, reach, _ in tracks:
        if _stands(track):
            clear &= bool(np.linalg.norm(track[0] - node) >= distance + SCHEDULE_CLEARANCE)
            continue
        far = np.linalg.norm(track - node, axis=1) - reach >= distance + SCHEDULE_CLEARANCE
        clear &= far[:-1].reshape(steps, _PER_GRID).all(axis=1) & far[_PER_GRID::_PER_GRID]
    return clear


def _leg_clear(leg: Floats, tracks: list[Track], steps: int, spacing: Spacing) -> Flags:
    """Tell for each time of the grid whether a leg that sets out then keeps the distance. Shape (steps + 1,)."""
    clear, mine, lag = np.ones(steps + 1, dtype=bool), reach_of(leg), lag_of(leg, spacing.skew)
    wanted = spacing.distance + SCHEDULE_CLEARANCE
    look = np.unique(np.append(np.arange(0, len(leg), COARSE), len(leg) - 1))
    rows = max(1, _NUMBERS // len(leg))
    for track, reach, lags in tracks:
        if _stands(track):
            clear &= bool((np.linalg.norm(track[0] - leg, axis=1) - mine).min() >= wanted)
            continue
        points = np.concatenate([track, np.repeat(track[-1:], len(leg), axis=0)])
        reaches = np.concatenate([reach, np.zeros(len(leg))])
        at = sliding_window_view(points, len(leg), axis=0)[: len(track) : _PER_GRID].transpose(0, 2, 1)
        within = sliding_window_view(reaches, len(leg))[: len(track) : _PER_GRID]
        wide = sliding_window_view(wider(reaches), len(leg))[: len(track) : _PER_GRID]
        late = np.concatenate([lags, np.zeros(len(leg))])
        behind, most = (sliding_window_view(each, len(leg))[: len(track) : _PER_GRID] for each in (late, most_nearby(late)))
        for some in _blocks(steps + 1, rows):
            gaps = np.linalg.norm(at[some][:, look] - leg[look], axis=2)  # a coarse look settles most times
            drift = np.minimum(lag[look], behind[some][:, look])
            clear[some] &= (gaps - drift - mine[look] - within[some][:, look]).min(axis=1) >= wanted
            drift = np.minimum(most_nearby(lag)[look], most[some][:, look])
            sure = (gaps - drift - wider(mine)[look] - wide[some][:, look]).min(axis=1) >= wanted
            unsure = some.start + np.flatnonzero(clear[some] & ~sure)
            if len(unsure):
                finer = np.linalg.norm(at[unsure] - leg, axis=2) - np.minimum(lag, behind[unsure]) - mine - within[unsure]
                clear[unsure] = finer.min(axis=1) >= wanted
    return clear


def _stands(track: Floats) -> bool:
    """Return whether a robot never moves, so that one look is as good as many."""
    return bool((track == track[0]).all())


def _blocks(count: int, size: int) -> Iterator[slice]:
    for start in range(0, count, size):
        yield slice(start, min(start + size, count))
