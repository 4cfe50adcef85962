"""A faster flight in the same corridor: free times first, then the points of visits free in their rooms as well."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from refine.corridor.fitting import Rules, fixed_states, monotone_rules, until_kept
from refine.corridor.leg_limits import leg_speeds
from refine.limits.limits import Limits
from refine.limits.stretching import stretch_to_limits
from refine.obstacles.keep_out_bodies import Ball
from refine.single_robot.pacing import slowed
from refine.single_robot.task import Fitted, Motion, RefinementOptions, Task
from refine.single_robot.visits_shown import legs_about
from refine.solvers.nlp import Timing, optimise
from refine.solvers.programme import Steps
from refine.spline.spline import Spline
from verify.data import Infeasible

Floats = NDArray[np.float64]

_TIME_WEIGHT = 3e4
"""Weight of time over snap for `pace="time"`, in units of the uniformly stretched path's snap over its duration."""
_OTHER_WEIGHTS = (0.1, 10.0, 0.01)
"""Weights of time, in units of the one that is asked for, whose answers are other starts of a programme that did not
converge from the nominal path."""
_ROOM = 1.03
"""Stretch of such an answer, so that the programme starts away from its limits."""
_INSTANTS = 12
"""Instants a piece at which these programmes keep the limits: what they miss is stretched away, and the dearer programmes
of more instants do not end in shorter flights."""
_STRETCHED = 1.02
"""Stretch of an answer from which on rotor thrusts, which the first programmes leave out, are worth more programmes."""
_LIGHTER = (0.1, 0.01)
"""Shares of the weight of time that these take for `pace="time"`: more regard for snap makes the path a little longer before it
is stretched and leaves rotors far more room; with rotor thrusts in it, a programme takes several times as long and often does not
converge."""
_PROGRAMMES = 24
"""Programmes that one time-optimised flight may take, each with a budget of iterations of its own."""


def time_optimised(task: Task, fitted: Fitted) -> Motion:
    """Return a faster motion: free times on the same corridor, then the points of visits free in their rooms.

    Args:
        task: The robot's; its options say what is least.
        fitted: What it flies at the plan's own times.

    Raises:
        Infeasible: No start led to a path that keeps the corridor and its labels.
        SolverTimeout: An engine's seconds ran out before its iterations.
    """
    options = task.options
    start = fitted.motion.path.stretched(stretch_to_limits(fitted.motion.path, None, _plain(task.limits), faster=True))
    weight = options.weight if options.pace == "blend" else _TIME_WEIGHT * start.snap_cost() / start.duration
    best: Motion | None = None
    failure: Infeasible | None = None
    rules = monotone_rules(task.corridor, fitted.monotone)  # what the first path broke, the second would break again
    for roomy in (False, True) if any(task.corridor.rooms) else (False,):
        first = start if best is None else best.path.stretched(_ROOM)
        try:
            found = _kept(_Aim(task, fitted, first, weight, rules, roomy))
        except Infeasible as error:
            failure = failure or error
            continue
        if best is None or _cost(found.path, options) < _cost(best.path, options):
            best = found
    if best is None:
        assert failure is not None
        raise Infeasible(
            f"{task.name}: no flight of pace '{options.pace}' was found ({failure}) The plan's own times can be kept: "
            "ask for pace 'nominal'.",
            failure.witness,
        ) from failure
    return best


def _plain(limits: Limits) -> Limits:
    """Return the limits that a programme without yaw and rotors keeps."""
    return replace(limits, rotors=None, yaw_rate=np.inf)


def _cost(path: Spline, options: RefinementOptions) -> float:
    return path.duration if options.pace == "time" else path.snap_cost() + options.weight * path.duration


@dataclass(frozen=True, eq=False, slots=True)
class _Aim:
    """What one series of programmes looks for.

    Attributes:
        task: The robot's.
        fitted: What it flies at the plan's own times.
        start: First guess.
        weight: Of time, m^2/s^8.
        rules: Planes that paths have broken so far; grows with each series.
        roomy: Whether the points of visits may move in their rooms.
    """

    task: Task
    fitted: Fitted
    start: Spline
    weight: float
    rules: Rules
    roomy: bool


def _kept(aim: _Aim) -> Motion:
    """Return a motion with free times from one start.

    Where the programme does not converge, it starts from an answer for another weight of time; where its path cuts back into
    a region that it has just left, the legs concerned never go back.

    Raises:
        Infeasible: The programme did not converge, or its path does not keep the labels.
    """
    task, rest, monotone = aim.task, aim.fitted.rest, aim.fitted.monotone
    programmes = _Programmes(aim)
    while True:
        motion = slowed(task, until_kept(task.corridor, aim.rules, programmes.answer, buffer=task.buffer), rest)
        found = task.violations(motion.path)
        if not found:
            return _within_rotors(aim, programmes, motion)
        more = monotone | legs_about(motion.path, found[0].time)
        if more == monotone:
            raise Infeasible(found[0].sentence, found[0])
        aim.rules.update(monotone_rules(task.corridor, more - monotone))
        monotone = more


def _within_rotors(aim: _Aim, programmes: _Programmes, motion: Motion) -> Motion:
    """Return the motion with rotor thrusts considered by further programmes, where that beats stretching it for them."""
    task, best, last = aim.task, motion, programmes.last
    if motion.path.duration <= last.duration * _STRETCHED:
        return best
    first = last.stretched(_ROOM)
    runs: list[Callable[[], Spline]] = [
        lambda: programmes.solved(first, aim.weight, limits=replace(task.limits, yaw_rate=np.inf))
    ]
    if task.options.pace == "time":
        runs = [lambda share=share: programmes.solved(first, share * aim.weight) for share in _LIGHTER]
    for run in runs:
        try:
            other = slowed(task, until_kept(task.corridor, aim.rules, run, buffer=task.buffer), aim.fitted.rest)
        except Infeasible:
            continue
        if other.path.duration < best.path.duration and not task.violations(other.path):
            best = other
        if best.path.duration <= last.duration * _STRETCHED:
            break
    return best


class _Programmes:
    """The nonlinear programmes of one series: what they share, how many are left, and the last answer."""

    def __init__(self, aim: _Aim) -> None:
        corridor = aim.task.corridor
        self._aim, self._left = aim, _PROGRAMMES
        self._answers: list[Spline] = []
        self._speeds = leg_speeds(aim.task.mission, aim.task.robot, corridor)
        self._fixed = fixed_states(corridor, aim.fitted.rest)
        self._rooms: list[tuple[int, Ball]] = []
        if aim.roomy:
            self._rooms = [(node, room) for node, room in enumerate(corridor.rooms) if room is not None]
            self._fixed[[node for node, _ in self._rooms], 0] = np.nan
            if corridor.cycle is not None:  # both are free where one is
                self._fixed[[corridor.cycle, -1], 0] = self._fixed[corridor.cycle, 0] + 0.0 * self._fixed[-1, 0]

    @property
    def last(self) -> Spline:
        """The last answer."""
        return self._answers[-1]

    def answer(self) -> Spline:
        """Return an answer that keeps the rules so far, from the first start that leads to one.

        Raises:
            Infeasible: None does.
            SolverTimeout: An engine's seconds ran out before its iterations.
        """
        start, weight = self._aim.start, self._aim.weight
        tries: list[Callable[[], Spline]] = [lambda: self.solved(self.last.stretched(_ROOM), weight)] if self._answers else []
        tries += [lambda: self.solved(start, weight), lambda: self.solved(start, weight, "cautious")]
        if not self._aim.roomy:
            tries += [lambda share=share: self._by_way_of(share * weight) for share in _OTHER_WEIGHTS]
        failure: Infeasible | None = None
        for run in tries:
            try:
                self._answers.append(run())
                return self.last
            except Infeasible as error:
                failure = error
        assert failure is not None
        raise failure

    def solved(self, first: Spline, weight: float, steps: Steps = "plain", limits: Limits | None = None) -> Spline:
        """Return one programme's answer.

        Args:
            first: Where it starts.
            weight: Of time, m^2/s^8.
            steps: IPOPT's step in the multipliers.
            limits: Instead of those without yaw and rotors.

        Raises:
            Infeasible: It did not converge, or no programme is left.
            SolverTimeout: An engine's seconds ran out before its iterations.
        """
        if not self._left:
            raise Infeasible(f"{_PROGRAMMES} programmes did not lead to a path that keeps the corridors and labels.")
        self._left -= 1
        return optimise(
            Timing(
                start=first,
                fixed=self._fixed,
                limits=_plain(self._aim.task.limits) if limits is None else limits,
                objective="blend",
                weight=weight,
                within=self._rooms,
                planes=[(leg, plane) for (_, leg, _), planes in self._aim.rules.items() for plane in planes],
                speeds=self._speeds,
                cycle=self._aim.task.corridor.cycle,
                instants=_INSTANTS,
                steps=steps,
                settled=self._aim.roomy,
            )
        )

    def _by_way_of(self, weight: float) -> Spline:
        """Return the answer from the one for another weight of time."""
        return self.solved(self.solved(self._aim.start, weight).stretched(_ROOM), self._aim.weight)
