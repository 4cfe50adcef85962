"""Hovers put into one robot's flight at points at which it rests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from refine.single_robot.task import RobotFlight
from refine.spline.spline import Spline


def hovering_longer(robot: RobotFlight, seconds: float) -> RobotFlight:
    """Return a robot that never moves, and hovers for longer.

    Args:
        robot: Its flight.
        seconds: By how much.
    """
    durations = robot.path.durations.copy()
    durations[-1] += seconds
    return replace(robot, path=Spline(durations, robot.path.states))


def with_hovers(robot: RobotFlight, waits: dict[int, float]) -> RobotFlight:
    """Return a robot that rests longer at some of its points, with a leg of its own for each hover.

    Args:
        robot: It does move.
        waits: Point at which it rests: s that it waits there, or 0.
    """
    nodes = sorted(node for node, wait in waits.items() if wait > 0.0)
    corridor = robot.corridor
    if not nodes or corridor is None:
        return robot
    longer = [waits[node] for node in nodes]
    leaving = [min(node, len(corridor) - 1) for node in nodes]
    led = replace(
        corridor,
        points=np.insert(corridor.points, nodes, corridor.points[nodes], axis=0),
        durations=np.insert(corridor.durations, nodes, longer),
        legs=_inserted(corridor.legs, nodes, [replace(corridor.legs[leg], cylinder=None, approaches=()) for leg in leaving]),
        needed=_inserted(corridor.needed, nodes, [True] * len(nodes)),
        rooms=_inserted(corridor.rooms, nodes, [None] * len(nodes)),
        cycle=None if corridor.cycle is None else corridor.cycle + sum(node <= corridor.cycle for node in nodes),
    )
    return replace(hovering(robot, waits), corridor=led)


def hovering(robot: RobotFlight, waits: dict[int, float]) -> RobotFlight:
    """Return a robot that rests longer at some of its points, with pieces for the hovers but no legs.

    Args:
        robot: Its flight.
        waits: Point at which it rests: s that it waits there, or 0.
    """
    nodes = sorted(node for node, wait in waits.items() if wait > 0.0)
    longer, cycle = [waits[node] for node in nodes], robot.cycle
    return replace(
        robot,
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
