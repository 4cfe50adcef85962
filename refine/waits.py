"""Waits in the middle of flights, where no departure times keep the planned precedences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from refine.schedule import GRID
from refine.single import NONE, Ask, Robot, single
from refine.spacing import Spacing, flight_of, idle_others
from refine.spline import Spline
from refine.wishes import Wishes
from verify.data import Infeasible, Plan, Witness


def with_waits(plan: Plan, robots: dict[str, Robot], wishes: Wishes, ask: Ask, spacing: Spacing) -> dict[str, Robot]:
    """Return the team with hovers in the middle of flights, just long enough for the planned precedences.

    Each robot that must wait for another rests where it sets out for the visit concerned. Waits are made longer until all
    precedences hold with everyone departing at once; precedences that go round in a circle never settle.
    """
    stops: dict[str, frozenset[int]] = dict.fromkeys(robots, NONE)
    for precedence in wishes.precedences:
        name, visit = precedence.then
        stops[name] |= {visit}
    resting = {
        name: robot if robot.course is None else single(plan, name, wishes, idle_others(plan, name, spacing), ask, stops[name])
        for name, robot in robots.items()
    }
    waits: dict[tuple[str, int], float] = {}
    for _ in range(4 * len(wishes.precedences) ** 2 + 4):
        held = {name: _holding(robot, waits) for name, robot in resting.items()}
        visits = {name: flight_of(plan, robot).visits for name, robot in held.items()}
        late = False
        for precedence in wishes.precedences:
            (first, left), then = precedence.first, precedence.then
            short = visits[first][left][1] + GRID - visits[then[0]][then[1]][0]
            if short > 0.0:
                waits[then] = waits.get(then, 0.0) + float(np.ceil(short / GRID) * GRID)
                late = True
        if not late:
            return held
    sentence = "The planned precedences go round in a circle: no waits keep them all."
    raise Infeasible(sentence, Witness(claim="formula", sentence=sentence))


def _holding(robot: Robot, waits: dict[tuple[str, int], float]) -> Robot:
    """Return a robot with hover pieces put in where it waits for a visit."""
    path, yaw, cycle = robot.path, robot.yaw, robot.cycle
    for visit, node in sorted(robot.halts.items(), key=lambda item: -item[1]):
        wait = waits.get((robot.name, visit), 0.0)
        if wait > 0.0:
            path, yaw = _hover_at(path, node, wait), None if yaw is None else _hover_at(yaw, node, wait)
            cycle = None if cycle is None else cycle + (node <= cycle)
    return replace(robot, path=path, yaw=yaw, cycle=cycle)


def _hover_at(path: Spline, node: int, duration: float) -> Spline:
    return Spline(np.insert(path.durations, node, duration), np.insert(path.states, node, path.states[node], axis=0))
