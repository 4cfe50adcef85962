"""A path's times: the plan's own ones, longer where the limits of a leg or of the flight ask for it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from refine.corridor.fitting import fit
from refine.corridor.leg_limits import slow_legs, slower_on_ways
from refine.heading.yaw import CORNER, heading_spline
from refine.limits.limits import Limits
from refine.limits.stretching import stretch_to_limits
from refine.single_robot.task import NOWHERE, Motion, Task
from refine.spline.spline import Spline
from verify.data import Infeasible
from verify.data.sections import Agent

Floats = NDArray[np.float64]

_LEG_ROUNDS = 8
_SHARED = 0.5
"""Power of a leg's factor by which the legs beside it last longer."""
_UNEVEN = 1.1
"""How much longer than planned a flight may become before other shares of its time are tried."""
_CORNERS = (CORNER, 0.2, 0.3)
"""Shares of a mean leg's duration over which the heading of a fast flight turns a corner, tried in this order."""
_NEARLY = 1.01
"""How much longer than without a heading a flight may last for no rounder corners to be tried."""
_WORTH = 0.95
"""Share of a flight's duration that rounder corners have to bring it down to."""
_SHARES = (1.0, 0.5)
"""Powers of the legs' lengths that the other shares go by."""


def timed(task: Task, rest: frozenset[int], monotone: frozenset[int] = NOWHERE) -> Motion:
    """Return a motion with durations long enough for the limits: the plan's own ones where they do.

    A plan may give a leg far less time than its neighbours; slowing such a flight as a whole keeps the uneven shares, and the
    swings that come from them. Then shares that go by the legs' lengths are tried as well, and the shortest flight is taken.

    Args:
        task: The robot's.
        rest: Points at which it rests.
        monotone: Legs that never go back along their own direction.

    Raises:
        Infeasible: The corridor's rules contradict each other, or no pace keeps the limits.
        SolverTimeout: An engine's seconds ran out before its iterations.
    """
    corridor = task.corridor
    first = _paced(task, rest, monotone, corridor.durations)
    total = float(corridor.durations.sum())
    if not task.options.even or first.path.duration <= _UNEVEN * total:
        return first
    found = [first]
    lengths = np.linalg.norm(np.diff(corridor.points, axis=0), axis=1)
    for power in _SHARES:
        shares = lengths**power
        try:
            found.append(_paced(task, rest, monotone, total * shares / shares.sum()))
        except Infeasible:
            continue  # the plan's own times stand
    return min(found, key=lambda motion: motion.path.duration)


def _paced(task: Task, rest: frozenset[int], monotone: frozenset[int], durations: Floats) -> Motion:
    """Return a motion with at least these durations, made longer where a leg's or the flight's limits ask for it.

    Giving only its own legs more time may swing the path in them and ask for still more. Each such path is therefore slowed as
    a whole, and the shortest of these flights is taken.
    """
    best: Motion | None = None
    for _ in range(_LEG_ROUNDS):
        try:
            path = fit(task.corridor, durations, buffer=task.buffer, rest=rest, monotone=monotone)
            slow = slow_legs(task.mission, task.robot, task.corridor, path)
            motion = slowed(task, path, rest)
        except Infeasible:
            if best is None:
                raise
            break
        if best is None or motion.path.duration < best.path.duration:
            best = motion
        durations = durations * np.maximum(slow, _beside(slow))
        if np.all(slow <= 1.0) or durations.sum() >= best.path.duration:
            break
    assert best is not None
    return best


def _beside(slow: Floats) -> Floats:
    """Return how much longer legs last beside slower ones: with what speed these are entered and left, legs share. Shape (legs,)."""
    ends = np.pad(slow, 1, constant_values=1.0)
    return np.maximum(ends[:-2], ends[2:]) ** _SHARED


def headed(
    agent: Agent, path: Spline, limits: Limits, *, cycle: int | None = None, rest: frozenset[int] = NOWHERE
) -> tuple[Spline | None, float]:
    """Return the heading of a path that is flown as fast as limits allow, and by how much both must be slowed; below 1 to speed up.

    It turns corners as sharply as at the plan's own times, and less sharply where that costs time.

    Args:
        agent: Says how to look.
        path: Three axes.
        limits: What must hold.
        cycle: Node where the cycle begins.
        rest: Nodes at which the heading rests, too.

    Raises:
        Infeasible: No pace keeps the limits.
    """
    alone = 0.0 if agent.heading == "fixed" else stretch_to_limits(path, None, limits, faster=True)
    best: tuple[Spline | None, float] | None = None
    refused: Infeasible | None = None
    for corner in (CORNER,) if agent.heading == "fixed" else _CORNERS:
        yaw = heading_spline(path, agent.heading, agent.yaw, cycle=cycle, rest=rest, corner=corner)
        try:
            factor = stretch_to_limits(path, yaw, limits, faster=True)
        except Infeasible as error:
            refused = refused or error
            continue
        if best is None or factor < _WORTH * best[1]:
            best = yaw, factor
        if factor <= _NEARLY * alone:
            break
    if best is None:
        assert refused is not None
        raise refused
    return best


def slowed(task: Task, path: Spline, rest: frozenset[int], *, faster: bool = False) -> Motion:
    """Return the path with its yaw, both slowed until all limits hold.

    Args:
        task: The robot's.
        path: Three axes, along the task's corridor.
        rest: Points at which it rests.
        faster: Whether both may be sped up instead, as far as limits allow.

    Raises:
        Infeasible: No pace keeps the limits.
    """
    agent, cycle = task.mission.agents[task.name], task.corridor.cycle
    lap = 0 if task.options.closes else cycle
    if faster:
        yaw, factor = headed(agent, path, task.limits, cycle=lap, rest=rest)
    else:
        yaw = heading_spline(path, agent.heading, agent.yaw, cycle=lap, rest=rest)
        factor = stretch_to_limits(path, yaw, task.limits)
    factor *= float(np.max(slow_legs(task.mission, task.robot, task.corridor, path.stretched(factor)), initial=1.0))
    if cycle is None:
        factor *= slower_on_ways(task.mission, task.robot, path.stretched(factor))
    return Motion(path, yaw).stretched(factor)
