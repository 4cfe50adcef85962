"""The last resort of a team: everyone rests at each point of its way and waits there until the next leg is clear.

Robots are scheduled one after the other, in several orders. The ways are fixed, so what is left to choose is when to set out
on each leg: a search over (point, time) in which a leg or a wait is allowed only where it keeps clear of the robots before
(safe intervals along a path, as in SIPP of Phillips and Likhachev, 2011). Times are on the grid of departures.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from refine.schedule import COARSE, GRID, Conflict, departures, reach_of, wider
from refine.single import Robot
from refine.spacing import Spacing, flight_of
from refine.spline import Spline
from refine.timing import stretch_to_limits
from refine.yaw import heading_spline
from verify.data import Mission, Plan

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

_STEP = 1 / 64
_PER_GRID = round(GRID / _STEP)
_ORDERS = 24
_CLEAR = 2e-3
"""m on top of the distance, so that the schedule's own check finds it kept."""


def stop_and_go(
    plan: Plan, teams: Sequence[dict[str, Robot]], spacing: Spacing, max_pieces: int
) -> tuple[dict[str, Robot], dict[str, float]] | None:
    """Return a team that waits on the way where it has to, and departures; None where no order of the robots works.

    Args:
        plan: Carries the mission.
        teams: Robots that rest at every point, and the same ones on other ways; the first that works is taken.
        spacing: What they keep.
        max_pieces: Pieces that a robot may fly, hovers included.
    """
    for robots in teams:
        gridded = {name: _on_grid(plan.mission, robot) for name, robot in robots.items()}
        for order in itertools.islice(itertools.permutations(gridded), _ORDERS):
            waits = _waits(gridded, order, spacing)
            if waits is None:
                continue
            team = {name: _waiting(gridded[name], waits[name]) for name in robots}
            starts = {name: float(waits[name][0]) for name in robots}
            if any(len(team[name].path) + (starts[name] > 0.0) > max_pieces for name in team):
                continue
            flights = [flight_of(plan, robot) for robot in team.values()]
            found = departures(flights, distance=spacing.distance, z_scale=spacing.z_scale, given=starts)
            if not isinstance(found, Conflict):
                return team, starts
    return None


def _on_grid(mission: Mission, robot: Robot) -> Robot:
    """Return a robot whose legs last whole steps of the grid, at least as long as before."""
    if robot.course is None:
        return robot
    path, rest = robot.path, frozenset(range(len(robot.path) + 1))
    agent, factor = mission.agents[robot.name], 1.0
    while True:
        path = Spline(np.ceil(factor * path.durations / GRID - 1e-9) * GRID, path.states)
        yaw = heading_spline(path, agent.heading, agent.yaw, rest=rest)
        factor = stretch_to_limits(path, yaw, robot.limits)
        if factor <= 1.0:
            return replace(robot, path=path, yaw=yaw, halts={})


def _waits(robots: dict[str, Robot], order: tuple[str, ...], spacing: Spacing) -> dict[str, Floats] | None:
    """Return for each robot how long it waits at each of its points, in s; None where a robot finds no way through."""
    total = sum(robot.path.duration + robot.plan.hold for robot in robots.values())
    steps = int(np.ceil(total / GRID)) + 2
    waits: dict[str, Floats] = {}
    tracks: list[tuple[Floats, Floats]] = []
    for name in order:
        robot = robots[name]
        found = _through(robot, tracks, steps, spacing)
        if found is None:
            return None
        waits[name] = found
        tracks.append(_track(robot, found, steps, spacing))
    return waits


def _legs(robot: Robot, spacing: Spacing) -> list[Floats]:
    """Return the samples of each leg, its end left out, z scaled. Shapes (samples, 3)."""
    legs = []
    for leg, duration in enumerate(robot.path.durations):
        count = round(duration / _STEP)
        points = robot.path.sample(np.arange(count) / count)[leg] if robot.course is not None else np.zeros((0, 3))
        legs.append(points[:, :3] * np.array([1.0, 1.0, spacing.z_scale]))
    return legs


def _track(robot: Robot, waits: Floats, steps: int, spacing: Spacing) -> tuple[Floats, Floats]:
    """Return where a robot is at every sample of the whole time, z scaled, and its reach there. Shapes (samples, 3), (samples,)."""
    legs, scale = _legs(robot, spacing), np.array([1.0, 1.0, spacing.z_scale])
    nodes = robot.path.nodes[:, :3] * scale
    parts: list[Floats] = []
    for leg, wait in zip(legs, waits, strict=True):
        start = nodes[len(parts) // 2]
        parts += [np.repeat(start[None], round(wait / _STEP), axis=0), leg]
    track = np.concatenate([*parts, nodes[-1:]])
    count = steps * _PER_GRID + 1
    track = np.concatenate([track, np.repeat(track[-1:], max(count - len(track), 0), axis=0)])[:count]
    return track, reach_of(track)


def _through(robot: Robot, tracks: list[tuple[Floats, Floats]], steps: int, spacing: Spacing) -> Floats | None:
    """Return a robot's waits at its points so that it ends as early as the others allow; None where they do not."""
    legs = _legs(robot, spacing)
    nodes = robot.path.nodes[:, :3] * np.array([1.0, 1.0, spacing.z_scale])
    hovers = np.array([_hover_clear(node, tracks, steps, spacing.distance) for node in nodes])
    if robot.course is None:
        return np.zeros(len(legs)) if hovers[0].all() else None
    lasts = [round(duration / GRID) for duration in robot.path.durations]
    clears = [_leg_clear(leg, tracks, steps, spacing.distance) for leg in legs]
    arrived = np.zeros((len(nodes), steps + 1), dtype=bool)
    arrived[0, 0] = True
    there = arrived.copy()
    hold = int(np.ceil(robot.plan.hold / GRID - 1e-9))
    for node in range(len(nodes)):
        for time in range(steps):  # whoever may hover during a step is there at its end too
            there[node, time] |= arrived[node, time]
            there[node, time + 1] |= there[node, time] and hovers[node, time]
        if node + 1 < len(nodes):
            last = lasts[node]
            sets_out = there[node, : steps + 1 - last] & clears[node][: steps + 1 - last]
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


def _hover_clear(node: Floats, tracks: list[tuple[Floats, Floats]], steps: int, distance: float) -> Flags:
    """Tell for each step of the grid whether a hover during it keeps the distance. Shape (steps,)."""
    clear = np.ones(steps, dtype=bool)
    for track, reach in tracks:
        far = np.linalg.norm(track - node, axis=1) - reach >= distance + _CLEAR
        clear &= far[:-1].reshape(steps, _PER_GRID).all(axis=1) & far[_PER_GRID::_PER_GRID]
    return clear


def _leg_clear(leg: Floats, tracks: list[tuple[Floats, Floats]], steps: int, distance: float) -> Flags:
    """Tell for each time of the grid whether a leg that sets out then keeps the distance. Shape (steps + 1,)."""
    clear, mine = np.ones(steps + 1, dtype=bool), reach_of(leg)
    for track, reach in tracks:
        points = np.concatenate([track, np.repeat(track[-1:], len(leg), axis=0)])
        reaches = np.concatenate([reach, np.zeros(len(leg))])
        at = sliding_window_view(points, len(leg), axis=0)[: len(track) : _PER_GRID].transpose(0, 2, 1)
        within = sliding_window_view(reaches, len(leg))[: len(track) : _PER_GRID]
        wide = sliding_window_view(wider(reaches), len(leg))[: len(track) : _PER_GRID, ::COARSE]
        gaps = np.linalg.norm(at[:, ::COARSE] - leg[::COARSE], axis=2)  # a coarse look settles most times
        clear &= (gaps - mine[::COARSE] - within[:, ::COARSE]).min(axis=1) >= distance + _CLEAR
        unsure = clear & ((gaps - wider(mine)[::COARSE] - wide).min(axis=1) < distance + _CLEAR)
        if unsure.any():
            finer = np.linalg.norm(at[unsure] - leg, axis=2) - mine - within[unsure]
            clear[unsure] = finer.min(axis=1) >= distance + _CLEAR
    return clear


def _waiting(robot: Robot, waits: Floats) -> Robot:
    """Return a robot with its waits on the way put in as hovers; the one at the start is its departure."""
    if robot.course is None:
        return robot
    where = [node for node in range(1, len(waits)) if waits[node] > 0.0]
    path = Spline(
        np.insert(robot.path.durations, where, waits[where]),
        np.insert(robot.path.states, where, robot.path.states[where], axis=0),
    )
    yaw = robot.yaw
    if yaw is not None:
        yaw = Spline(path.durations, np.insert(yaw.states, where, yaw.states[where], axis=0))
    return replace(robot, path=path, yaw=yaw)
