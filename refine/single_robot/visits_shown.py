"""A path that shows the plan's visits and no others: bent less and less, until at worst it is the planner's own polyline."""

from __future__ import annotations

import numpy as np

from refine.single_robot.pacing import timed
from refine.single_robot.task import NOWHERE, Fitted, Task
from refine.spline.spline import Spline
from verify.data import Infeasible

UNSURE = 5e-4
"""m of margin, more or less, that must not change which visits a path shows."""


def showing_visits(task: Task, halts: frozenset[int]) -> Fitted:
    """Return a motion whose stays are the plan's visits.

    A path may cut back into a region that it has just left. Then the legs concerned never go back, and if that is not
    enough, the flight rests at their ends and is straight between: at worst it is the planner's own polyline. What comes
    back within the task's clearance of that counts as well, if that can be helped: the checker may not be able to tell it apart.

    Args:
        task: The robot's.
        halts: Points at which it rests whatever happens.

    Raises:
        Infeasible: Not even the polyline shows the plan's visits, or its limits cannot be kept.
        SolverTimeout: An engine's seconds ran out before its iterations.
    """
    clearance = UNSURE + task.clearance
    try:
        motion = timed(task, halts)
    except Infeasible:  # the corridors are too tight for a curve; the polyline keeps them
        everywhere = frozenset(range(len(task.corridor) + 1))
        motion = timed(task, everywhere)
        found = task.violations(motion.path)
        if found:
            raise Infeasible(found[0].sentence, found[0]) from None
        return Fitted(motion, everywhere, NOWHERE)
    found = task.violations(motion.path, clearance)
    if not found:
        return Fitted(motion, halts, NOWHERE)
    monotone = legs_about(motion.path, found[0].time)
    try:
        straight = timed(task, halts, monotone)
        if not task.violations(straight.path, clearance):
            return Fitted(straight, halts, monotone)
    except Infeasible:
        pass  # legs that turn sharply cannot both be monotone without a rest
    rest = halts
    while found:
        legs = legs_about(motion.path, found[0].time)
        more = rest | legs | {leg + 1 for leg in legs}
        if more == rest:
            found = task.violations(motion.path)
            if found:
                raise Infeasible(found[0].sentence, found[0])
            break  # no straight leg keeps the clearance as well
        rest = more
        motion = timed(task, rest)
        found = task.violations(motion.path, clearance)
    return Fitted(motion, rest, NOWHERE)


def legs_about(path: Spline, time: float | None) -> frozenset[int]:
    """Return the leg flown at a time (s) and the one before it; all legs where there is no time."""
    if time is None:
        return frozenset(range(len(path)))
    leg = int(np.clip(np.searchsorted(path.knots, time, side="right") - 1, 0, len(path) - 1))
    return frozenset({max(leg - 1, 0), leg})
