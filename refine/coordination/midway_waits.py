"""Waits in the middle of flights, where no departure times keep the planned precedences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from refine.coordination.departures import GRID
from refine.coordination.spacing import flight_of, idle_others
from refine.feedback import Wishes
from refine.single import NONE, Ask, Robot, single
from refine.spline.values import Spline
from verify.data import Infeasible, Plan, Witness
from verify.data.rules.spacing import Spacing


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
    sentence = (
        "No waits keep all planned precedences: they go round in a circle, or a robot would have to wait within a region "
        "that it is to have left by then."
    )
    raise Infeasible(sentence, Witness(claim="formula", sentence=sentence))


def _holding(robot: Robot, waits: dict[tuple[str, int], float]) -> Robot:
    """Return a robot that hovers where it waits for a visit."""
    return with_hovers(robot, {node: waits.get((robot.name, visit), 0.0) for visit, node in robot.halts.items()})


def with_hovers(robot: Robot, waits: dict[int, float]) -> Robot:
    """Return a robot that rests longer at some of its points, with a leg of its own for each hover.

    Args:
        robot: It does move.
        waits: Point at which it rests: s that it waits there, or 0.
    """
    nodes = sorted(node for node, wait in waits.items() if wait > 0.0)
    course, cycle = robot.course, robot.cycle
    if not nodes or course is None:
        return robot
    longer = [waits[node] for node in nodes]
    leaving = [min(node, len(course) - 1) for node in nodes]
    hovering = replace(
        course,
        points=np.insert(course.points, nodes, course.points[nodes], axis=0),
        durations=np.insert(course.durations, nodes, longer),
        legs=_inserted(course.legs, nodes, [replace(course.legs[leg], tube=None, bays=()) for leg in leaving]),
        needed=_inserted(course.needed, nodes, [True] * len(nodes)),
        rooms=_inserted(course.rooms, nodes, [None] * len(nodes)),
        cycle=None if course.cycle is None else course.cycle + sum(node <= course.cycle for node in nodes),
    )
    return replace(
        robot,
        course=hovering,
        path=_resting(robot.path, nodes, longer),
        yaw=None if robot.yaw is None else _resting(robot.yaw, nodes, longer),
        cycle=None if cycle is None else cycle + sum(node <= cycle for node in nodes),
        halts={visit: node + sum(other <= node for other in nodes) for visit, node in robot.halts.items()},
    )


def _inserted(values: Sequence[Any], nodes: list[int], more: Sequence[Any]) -> tuple[Any, ...]:
    """Return values with others put in before these places."""
    found = list(values)
    for node, value in reversed(list(zip(nodes, more, strict=True))):
        found.insert(node, value)
    return tuple(found)


def _resting(path: Spline, nodes: list[int], longer: list[float]) -> Spline:
    return Spline(np.insert(path.durations, nodes, longer), np.insert(path.states, nodes, path.states[nodes], axis=0))
