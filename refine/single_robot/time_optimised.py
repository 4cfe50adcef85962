"""The fastest flight in a corridor: durations and points first, then one programme with free states.

`least_time` finds durations of a minimum-snap spline and the points of visits (L-BFGS); an exact fit keeps its planes; IPOPT, started
there, frees the states at all nodes. Each answer is slowed until dense samples keep every limit, and stands only where it shows the
planned visits. The slowest that can be taken is the nominal path, sped up as a whole: one answer there always is.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from refine.corridor.corridor import Corridor
from refine.corridor.fitting import ROUNDS, Rules, broken_rules, fixed_states, monotone_rules, rows_of
from refine.corridor.leg_limits import own_limits
from refine.corridor.sampled_stays import certain_orders
from refine.limits.limits import Limits
from refine.limits.stretching import stretch_to_limits
from refine.limits.usage import peaks, shares_used
from refine.single_robot.least_time import Guess, least_time, rooms_of
from refine.single_robot.pacing import slowed
from refine.single_robot.task import Fitted, Motion, Task
from refine.single_robot.visits_shown import UNSURE, legs_about
from refine.solvers.nlp import Timing, optimise
from refine.solvers.qp import Programme, solve
from refine.solvers.timeout import SolverTimeout
from refine.spline.spline import Spline
from verify.data import Infeasible

Floats = NDArray[np.float64]

_ROUNDS = 4
"""How often durations and points are looked for again with the planes that the path before broke."""
_REPAIRS = 3
"""How often an answer that shows other visits is looked for again, with legs that never go back."""
_TIME_WEIGHT = 1e2
"""Weight of time over snap in the programme where time alone is least, in units of its first guess's snap over its duration: rotors
and yaw, which the programme leaves out, would stretch greedier answers."""
_INSTANTS = 12
"""Instants a piece at which the programme keeps the limits: what they miss is stretched away."""
_TURNS = 4
"""How often pieces in which the heading turns are given more time."""
_TURNING = {"yaw_rate": 1.0, "rotor_thrust_max": 0.5, "rotor_thrust_min": 0.5}
"""Limits that a turning heading uses, and the powers of their shares that a piece is slowed by."""
_NEARLY = 1.01
"""Share of such a limit up to which the flight is slowed as a whole."""
_OFTEN_FAR, _REACH = ("thrust_max", "thrust_min", "body_rate"), 0.4
"""Limits that the programme leaves out where a fitted path uses less than this share of each: it is solved twice as soon, and what an
answer breaks of them is stretched away. All or none of them, so that few programmes are compiled."""
_REMEMBERED = 64
"""Flights that are remembered: teams ask for the same robot's flight again and again while they are kept apart."""


def time_optimised(task: Task, fitted: Fitted) -> Motion:
    """Return the fastest motion that was found along a corridor, or in a blend the one of least cost.

    Args:
        task: The robot's; its options say what is least.
        fitted: What it flies at the plan's own times.

    Returns:
        Its note says so where a programme failed, or an engine's seconds ran out: the best of the other answers stands.
    """
    return _answered(_Question(task, fitted))


def forget() -> None:
    """Drop all answers, so that the next one is looked for (for measurements and tests)."""
    _answered.cache_clear()


def sped_up(task: Task, fitted: Fitted) -> Motion:
    """Return the motion at the plan's own times, sped up as a whole with a heading of its own where that is better.

    Args:
        task: The robot's; its options say what is least.
        fitted: What it flies at the plan's own times.
    """
    try:
        faster = slowed(task, fitted.motion.path, fitted.rest, faster=True)
    except Infeasible:  # no pace keeps the limits with that heading
        return fitted.motion
    return min((fitted.motion, faster), key=lambda motion: _cost(task, motion.path))


class _Question:
    """A task with what it flies at the plan's own times; equal to another where all is equal that an answer depends on."""

    def __init__(self, task: Task, fitted: Fitted) -> None:
        self.task, self.fitted = task, fitted
        self._digest = _digest(task, fitted)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Question) and other._digest == self._digest

    def __hash__(self) -> int:
        return hash(self._digest)


@lru_cache(maxsize=_REMEMBERED)
def _answered(question: _Question) -> Motion:
    task, fitted = question.task, question.fitted
    path = fitted.motion.path
    best = sped_up(task, fitted)
    start = path.stretched(stretch_to_limits(path, None, _plain(task.limits), faster=True))  # legs' own limits aside
    failures: list[str] = []
    everywhere = frozenset(range(len(task.corridor.points)))
    for each in (task, _pinned(task, everywhere)) if rooms_of(task.corridor) else (task,):
        found, failures = _answers(_Search(each, fitted, start))
        best = min((best, *found), key=lambda motion: _cost(task, motion.path))
        if found:
            break
    return replace(best, note=f"a faster flight was looked for and not found: {failures[0]}") if failures else best


def _digest(task: Task, fitted: Fitted) -> str:
    """Return what tells questions apart: all that an answer depends on."""
    corridor, robot, yaw = task.corridor, task.robot, fitted.motion.yaw
    asked = (
        corridor,
        (task.limits, task.clearance, task.options.blend, task.options.closes, task.options.effort),
        (
            fitted.motion.path.durations,
            fitted.motion.path.states,
            yaw and yaw.states,
            sorted(fitted.rest),
            sorted(fitted.monotone),
        ),
        (robot.visits, robot.cycle_visit, robot.cycle_waypoint),
        (task.mission.agents[task.name], task.mission.all_regions, task.mission.margin, task.mission.limits.legs),
    )
    return hashlib.sha256(pickle.dumps(asked)).hexdigest()


def _cost(task: Task, path: Spline) -> float:
    weight = task.options.blend
    return path.duration if weight is None else path.snap_cost() + weight * path.duration


class _Search:
    """State of one series of answers: the corridor with its visits' present points, and the planes that paths have broken."""

    def __init__(self, task: Task, fitted: Fitted, start: Spline) -> None:
        self.task, self.rest = task, fitted.rest
        self.guess = Guess(start.durations, start.nodes)
        self.monotone = fitted.monotone
        self.rules: Rules = monotone_rules(task.corridor, fitted.monotone)
        self.first = self.last = start
        self.shortest = np.zeros(len(start))
        self.order = certain_orders(fitted.motion.path, task.mission)

    @property
    def corridor(self) -> Corridor:
        """The corridor through the present points."""
        return replace(self.task.corridor, points=self.guess.points)

    def timed(self) -> Spline:
        """Return a minimum-snap path of least time that keeps the planes exactly."""
        task = self.task
        for _ in range(_ROUNDS):
            found = least_time(task, self.rest, self.rules, self.guess, self.shortest, weight=task.options.blend)
            self.guess = Guess(found.durations, np.clip(found.points, task.corridor.low, task.corridor.high))
            self.last = self._fit()
            fresh = self._broken(self.last)
            if not fresh:
                return self.last
            self.rules.update(fresh)
        for _ in range(ROUNDS):
            self.last = self._fit()
            fresh = self._broken(self.last)
            if not fresh:
                return self.last
            self.rules.update(fresh)
        raise Infeasible(f"{task.name}: no path through the points of least time kept the corridors within {ROUNDS} rounds.")

    def pin(self, regions: set[str]) -> bool:
        """Fix the points of visits to these regions where the plan has them, and begin again; tell whether any could move before.

        Raises:
            Infeasible: As `timed`.
        """
        nodes = [node for node, room in rooms_of(self.task.corridor) if room.name in regions]
        if not nodes:
            return False
        self.task, self.guess = _pinned(self.task, nodes), Guess(self.first.durations, self.first.nodes)
        self.timed()
        return True

    def turn_slower(self, motion: Motion) -> bool:
        """Give more time to pieces that yaw faster than they may at the pace of all other limits; tell whether there are any."""
        limits = self.task.limits
        fast = motion.stretched(stretch_to_limits(motion.path, None, replace(limits, yaw_rate=np.inf), faster=True))
        used = shares_used(fast.path, fast.yaw, limits)
        needed = np.ones(len(fast.path))
        for name, power in _TURNING.items():
            if name in used:
                needed = np.maximum(needed, np.maximum(used[name][2], 0.0).max(axis=1) ** power)
        shortest = np.where(needed > _NEARLY, needed * fast.path.durations, 0.0)
        if np.all(shortest <= self.shortest):
            return False
        self.shortest = np.maximum(self.shortest, shortest)
        return True

    def _broken(self, path: Spline) -> Rules:
        """Return planes for what a path breaks: beside the straight legs between its points, or beside the plan's where those meet a body."""
        try:
            return broken_rules(self.corridor, path, self.rules, self.task.buffer)
        except Infeasible:
            return broken_rules(self.task.corridor, path, self.rules, self.task.buffer)

    def _fit(self) -> Spline:
        rows = tuple(row for (_, leg, _), planes in self.rules.items() for plane in planes for row in rows_of(leg, plane))
        return solve(Programme(self.guess.durations, fixed_states(self.corridor, self.rest), rows, self.task.corridor.cycle))

    def freed(self) -> Spline:
        """Return the answer of the programme with free states that starts at the last path, and keeps the corridor."""
        for _ in range(_ROUNDS):
            found = optimise(self._programme())
            self.last, self.guess = found, Guess(found.durations, found.nodes)
            fresh = self._broken(found)
            if not fresh:
                return found
            self.rules.update(fresh)
        raise Infeasible(f"{self.task.name}: no fastest path kept the corridors within {_ROUNDS} programmes.")

    def _programme(self) -> Timing:
        task, start = self.task, self.last
        weight = task.options.blend
        if weight is None:
            weight = _TIME_WEIGHT * max(path.snap_cost() / path.duration for path in (start, self.first))
        fixed, rooms = fixed_states(self.corridor, self.rest), rooms_of(task.corridor)
        for node, _ in rooms:
            fixed[[node, -1] if node == task.corridor.cycle else node, 0] = np.nan
        speeds, accelerations = own_limits(task.mission, task.robot, task.corridor)
        return Timing(
            start=start,
            fixed=fixed,
            limits=_in_reach(start, _plain(task.limits)),
            objective="blend",
            weight=weight,
            within=rooms,
            planes=[(leg, plane) for (_, leg, _), planes in self.rules.items() for plane in planes],
            speeds=speeds,
            accelerations=accelerations,
            cycle=task.corridor.cycle,
            instants=_INSTANTS,
            shortest=self.shortest,
            warm=True,
        )


def _plain(limits: Limits) -> Limits:
    """Return the limits that a programme without yaw and rotors keeps."""
    return replace(limits, rotors=None, yaw_rate=np.inf)


def _in_reach(path: Spline, limits: Limits) -> Limits:
    """Return the limits that a somewhat faster flight may come to: without those of thrust and body rate where all are far away."""
    if any(peak.share >= _REACH for peak in peaks(path, None, limits) if peak.name in _OFTEN_FAR):
        return limits
    none = Limits()
    return replace(limits, **{name: getattr(none, name) for name in _OFTEN_FAR})


def _answers(search: _Search) -> tuple[list[Motion], list[str]]:
    """Return the motions of one series that keep corridor, limits and visits, fitted and with free states, and why others do not."""
    answers = [search.timed]
    if search.task.options.effort == "full" and np.isnan(fixed_states(search.task.corridor, search.rest)[:, 1:]).any():
        answers.append(search.freed)
    found: list[Motion] = []
    failures: list[str] = []
    for answer in answers:
        try:
            found.append(_shown(search, answer))
        except (Infeasible, SolverTimeout) as error:  # another answer stands
            failures.append(str(error))
    return [*found, *(_turned(search, found[-1], answers) if found else ())], failures


def _turned(search: _Search, motion: Motion, answers: Sequence[Callable[[], Spline]]) -> list[Motion]:
    """Return motions with more time for pieces in which the one before yaws too fast, as far as they are found."""
    found: list[Motion] = []
    try:
        for _ in range(_TURNS):
            if not search.turn_slower(found[-1] if found else motion):
                break
            found.append(_shown(search, answers[0]))
        for answer in answers[1:] if found else ():
            found.append(_shown(search, answer))
    except Infeasible:  # those before stand
        pass
    return found


def _shown(search: _Search, answer: Callable[[], Spline]) -> Motion:
    """Return an answer that shows the planned visits, looked for again with legs that never go back, and with fewer points that move.

    Labels must change in the order in which those of the nominal flight certainly do: formulas may rely on it.

    Raises:
        Infeasible: None does, or none keeps the corridor and its limits.
    """
    for last in (False,) * (_REPAIRS - 1) + (True,):
        task = search.task
        motion = slowed(task, answer(), search.rest, faster=True)
        violated = task.violations(motion.path, UNSURE + task.clearance)
        if violated:
            more = search.monotone | legs_about(motion.path, violated[0].time)
            if last or more == search.monotone:
                raise Infeasible(violated[0].sentence, violated[0])
            search.rules.update(monotone_rules(task.corridor, more - search.monotone))
            search.monotone = more
            continue
        changed = search.order - certain_orders(motion.path, task.mission)
        if not changed:
            return motion
        regions = {region for pair in changed for region, _, _ in pair if region}
        if last or not search.pin(regions):
            raise Infeasible(f"{task.name}: labels of {' and '.join(sorted(regions))} would change in another order.")
    raise AssertionError("the last round returns or raises")


def _pinned(task: Task, nodes: Collection[int]) -> Task:
    """Return a task in which some points must not move."""
    corridor = task.corridor
    rooms = tuple(None if node in nodes else room for node, room in enumerate(corridor.rooms))
    return replace(task, corridor=replace(corridor, rooms=rooms))
