"""One robot's flight, as if it were alone: a course, a smooth path that keeps it, slowed or hurried, and its heading.

A path that does not show the plan's visits is bent less and less, until at worst it is the planner's own polyline.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from refine.corridor.bodies import Ball
from refine.corridor.course import Course, course_of, thinned, with_stops
from refine.corridor.fitting import BUFFER, Rules, fit, fixed_states, onward_rules, until_kept
from refine.corridor.leg_limits import leg_speeds, slow_legs, slower_on_ways
from refine.corridor.legs import PAD
from refine.corridor.relocation import moved_into_the_clear
from refine.corridor.sampled_stays import troubles
from refine.feedback import Wishes
from refine.heading.yaw import heading_spline
from refine.limits.stretching import stretch_to_limits
from refine.limits.values import Limits
from refine.solvers.nlp import Steps, Timing, optimise
from refine.spline.values import Spline
from verify.data import Infeasible, Plan, RobotPlan

Floats = NDArray[np.float64]
Pace = Literal["nominal", "time", "blend"]
TooLong = Literal["refuse", "rest"]

HOVER = 1.0
"""s of the hover piece of a robot that goes nowhere, or of a cycle that is a hover."""
NONE: frozenset[int] = frozenset()
_LEG_ROUNDS = 8
_EASE = 3e4
"""Weight of time over snap for `pace="time"`, in units of the uniformly stretched path's snap over its duration."""
_SHIFTS = (0.1, 10.0, 0.01)
"""Weights of time, in units of the one that is asked for, whose answers are other starts of a programme that did not
converge from the nominal path."""
_UNSURE = 5e-4
"""m of margin, more or less, that must not change which visits a path shows."""
_UNEVEN = 1.1
"""How much longer than planned a flight may become before other shares of its time are tried."""
_SHARES = (1.0, 0.5)
"""Powers of the legs' lengths that the other shares go by."""
_ROOM = 1.03
"""Stretch of such an answer, so that the programme starts away from its limits."""
_INSTANTS = 12
"""Instants a piece at which these programmes keep the limits: what they miss is stretched away, and the dearer programmes
of more instants do not end in shorter flights."""
_STRETCHED = 1.02
"""Stretch of an answer from which on rotor thrusts, which the first programmes leave out, are worth more programmes."""
_EASED = (0.1, 0.01)
"""Shares of the weight of time that these take for `pace="time"`: more regard for snap makes the path a little longer before it
is stretched and leaves rotors far more room; with rotor thrusts in it, a programme takes several times as long and often does not
converge."""
_PROGRAMMES = 24
"""Programmes that one hurried flight may take, each with a budget of iterations of its own."""


@dataclass(frozen=True)
class Ask:
    """How the caller wants it."""

    pace: Pace
    weight: float
    max_pieces: int
    too_long: TooLong = "refuse"
    even: bool = True
    """Whether other shares of a flight's time are tried where the plan's own would slow it much."""
    rests: bool = False
    """Whether the flight rests at every point."""


@dataclass(frozen=True, eq=False)
class _Fitted:
    path: Spline
    yaw: Spline | None
    rest: frozenset[int]
    onward: frozenset[int]


@dataclass(frozen=True, eq=False)
class Robot:
    """What one robot flies, without the wait before it departs; no course where it hovers."""

    name: str
    plan: RobotPlan
    limits: Limits
    course: Course | None
    path: Spline
    yaw: Spline | None
    cycle: int | None
    halts: dict[int, int]
    """Visit: the node at which the robot rests when it sets out for it."""


def single(plan: Plan, name: str, wishes: Wishes, extra: tuple[Ball, ...], ask: Ask, stops: frozenset[int] = NONE) -> Robot:
    """Return one robot's flight without waits, at rest where it sets out for each visit of `stops`."""
    mission, robot = plan.mission, plan.robots[name]
    limits = Limits.of_mission(mission)
    for (who, limit), factor in wishes.limits.items():
        if who == name:
            limits = limits.tightened(limit, factor)
    if robot.still:
        return Robot(
            name,
            robot,
            limits,
            None,
            _hover(np.array(robot.waypoints[0].position), HOVER),
            None,
            None if robot.cycle_waypoint is None else 0,
            {},
        )
    try:
        return _moving(plan, name, wishes, limits, extra, ask, stops)
    except Infeasible:
        moved = moved_into_the_clear(mission, robot)
        if moved == robot:
            raise
        changed = plan.model_copy(update={"robots": {**plan.robots, name: moved}})
        return _moving(changed, name, wishes, limits, extra, ask, stops)


def _moving(
    plan: Plan, name: str, wishes: Wishes, limits: Limits, extra: tuple[Ball, ...], ask: Ask, stops: frozenset[int]
) -> Robot:
    """Return the flight of a robot that does go somewhere."""
    mission, robot = plan.mission, plan.robots[name]
    more = wishes.pad.get(name, 0.0)
    course = course_of(mission, name, robot, pad=PAD + more, extra=extra)
    course = thinned(course, ask.max_pieces - 1, mission.spec.repeat)
    hovering = course.cycle is not None and course.cycle == len(course)
    if hovering:
        course = replace(course, cycle=None)
    course, halts = with_stops(course, mission, stops)
    rest = frozenset(halts.values())
    if ask.too_long == "rest" and course.cycle is None and len(course) >= ask.max_pieces:
        rest |= frozenset(range(ask.max_pieces - 1, len(course), ask.max_pieces - 1))
    if ask.rests and course.cycle is None:
        rest = frozenset(range(len(course) + 1))
    fitted = _labelled(plan, name, course, limits, more, rest, even=ask.even)
    path, yaw = fitted.path, fitted.yaw
    if ask.pace != "nominal":
        path, yaw = _raced(plan, name, course, limits, fitted, ask, BUFFER + more)
    cycle = course.cycle
    if hovering:
        cycle = len(path)
        path = Spline(np.append(path.durations, HOVER), np.concatenate([path.states, path.states[-1:]]))
        yaw = None if yaw is None else Spline(path.durations, np.concatenate([yaw.states, yaw.states[-1:]]))
    return Robot(name, robot, limits, course, path, yaw, cycle, halts)


def _labelled(
    plan: Plan, name: str, course: Course, limits: Limits, pad: float, halts: frozenset[int], *, even: bool
) -> _Fitted:
    """Return a path whose stays are the plan's visits, and its yaw.

    A path may cut back into a region that it has just left. Then the legs concerned never go back, and if that is not
    enough, the flight rests at their ends and is straight between: at worst it is the planner's own polyline. What comes
    back within `pad` m of that counts as well, if that can be helped: the judge may not be able to tell it apart.
    """
    mission, robot, buffer = plan.mission, plan.robots[name], BUFFER + pad
    try:
        path, yaw = _timed(plan, name, course, limits, buffer, halts, NONE, even=even)
    except Infeasible:  # the corridors are too tight for a curve; the polyline keeps them
        everywhere = frozenset(range(len(course) + 1))
        path, yaw = _timed(plan, name, course, limits, buffer, everywhere, NONE, even=even)
        found = troubles(path, mission, name, robot)
        if found:
            raise Infeasible(found[0].sentence, found[0]) from None
        return _Fitted(path, yaw, everywhere, NONE)
    found = troubles(path, mission, name, robot, _UNSURE + pad)
    if not found:
        return _Fitted(path, yaw, halts, NONE)
    onward = _legs_about(path, found[0].time)
    try:
        straight, straight_yaw = _timed(plan, name, course, limits, buffer, halts, onward, even=even)
        if not troubles(straight, mission, name, robot, _UNSURE + pad):
            return _Fitted(straight, straight_yaw, halts, onward)
    except Infeasible:
        pass  # legs that turn sharply cannot both go onward without a rest
    rest = halts
    while found:
        legs = _legs_about(path, found[0].time)
        more = rest | legs | {leg + 1 for leg in legs}
        if more == rest:
            found = troubles(path, mission, name, robot)
            if found:
                raise Infeasible(found[0].sentence, found[0])
            break  # no straight leg keeps the pad as well
        rest = more
        path, yaw = _timed(plan, name, course, limits, buffer, rest, NONE, even=even)
        found = troubles(path, mission, name, robot, _UNSURE + pad)
    return _Fitted(path, yaw, rest, NONE)


def _legs_about(path: Spline, time: float | None) -> frozenset[int]:
    """Return the leg flown at a time and the one before it; all legs where there is no time."""
    if time is None:
        return frozenset(range(len(path)))
    leg = int(np.clip(np.searchsorted(path.knots, time, side="right") - 1, 0, len(path) - 1))
    return frozenset({max(leg - 1, 0), leg})


def _timed(
    plan: Plan,
    name: str,
    course: Course,
    limits: Limits,
    buffer: float,
    rest: frozenset[int],
    onward: frozenset[int],
    *,
    even: bool,
) -> tuple[Spline, Spline | None]:
    """Return path and yaw with durations long enough for the limits: the plan's own ones where they do.

    A plan may give a leg far less time than its neighbours; slowing such a flight as a whole keeps the uneven shares, and the
    swings that come from them. Then shares that go by the legs' lengths are tried as well, and the shortest flight is taken.
    """
    first = _paced(plan, name, course, limits, buffer, rest, onward, course.durations)
    total = float(course.durations.sum())
    if not even or first[0].duration <= _UNEVEN * total:
        return first
    found = [first]
    lengths = np.linalg.norm(np.diff(course.points, axis=0), axis=1)
    for power in _SHARES:
        shares = lengths**power
        try:
            found.append(_paced(plan, name, course, limits, buffer, rest, onward, total * shares / shares.sum()))
        except Infeasible:
            continue  # the plan's own times stand
    return min(found, key=lambda flown: flown[0].duration)


def _paced(
    plan: Plan,
    name: str,
    course: Course,
    limits: Limits,
    buffer: float,
    rest: frozenset[int],
    onward: frozenset[int],
    durations: Floats,
) -> tuple[Spline, Spline | None]:
    """Return path and yaw with at least these durations, made longer where a leg's or the flight's limits ask for it."""
    path = fit(course, durations, buffer=buffer, rest=rest, onward=onward)
    for _ in range(_LEG_ROUNDS):
        slow = slow_legs(plan.mission, plan.robots[name], course, path)
        if np.all(slow <= 1.0):
            break
        durations = durations * slow
        path = fit(course, durations, buffer=buffer, rest=rest, onward=onward)
    return _slowed(plan, name, course, limits, path, rest)


def _slowed(
    plan: Plan, name: str, course: Course, limits: Limits, path: Spline, rest: frozenset[int]
) -> tuple[Spline, Spline | None]:
    """Return the path with its yaw, both slowed until all limits hold."""
    agent = plan.mission.agents[name]
    yaw = heading_spline(path, agent.heading, agent.yaw, cycle=course.cycle, rest=rest)
    factor = stretch_to_limits(path, yaw, limits)
    factor *= float(np.max(slow_legs(plan.mission, plan.robots[name], course, path.stretched(factor)), initial=1.0))
    if course.cycle is None:
        factor *= slower_on_ways(plan.mission, plan.robots[name], path.stretched(factor))
    return path.stretched(factor), None if yaw is None else yaw.stretched(factor)


def _raced(
    plan: Plan, name: str, course: Course, limits: Limits, fitted: _Fitted, ask: Ask, buffer: float
) -> tuple[Spline, Spline | None]:
    """Return a faster path and its yaw: free times on the same course, then the points of visits free in their rooms.

    Raises:
        Infeasible: No start led to a path that keeps the course and its labels.
    """
    plain = replace(limits, rotors=None, yaw_rate=np.inf)
    start = fitted.path.stretched(stretch_to_limits(fitted.path, None, plain, faster=True))
    ease = ask.weight if ask.pace == "blend" else _EASE * start.snap_cost() / start.duration
    best: tuple[Spline, Spline | None] | None = None
    failure: Infeasible | None = None
    rules = onward_rules(course, fitted.onward)  # what the first path broke, the second would break again
    for roomy in (False, True) if any(course.rooms) else (False,):
        first = start if best is None else best[0].stretched(_ROOM)
        try:
            found = _hurried(plan, name, course, limits, fitted, first, ease, buffer, rules, ask, roomy=roomy)
        except Infeasible as error:
            failure = failure or error
            continue
        if best is None or _cost(found[0], ask) < _cost(best[0], ask):
            best = found
    if best is None:
        assert failure is not None
        raise Infeasible(
            f"{name}: no flight of pace '{ask.pace}' was found ({failure}) The plan's own times can be kept: "
            "ask for pace 'nominal'.",
            failure.witness,
        ) from failure
    return best


def _cost(path: Spline, ask: Ask) -> float:
    return path.duration if ask.pace == "time" else path.snap_cost() + ask.weight * path.duration


def _hurried(
    plan: Plan,
    name: str,
    course: Course,
    limits: Limits,
    fitted: _Fitted,
    start: Spline,
    ease: float,
    buffer: float,
    rules: Rules,
    ask: Ask,
    *,
    roomy: bool,
) -> tuple[Spline, Spline | None]:
    """Return a path with free times from one start, and its yaw.

    Where the programme does not converge, it starts from an answer for another weight of time; where its path cuts back into
    a region that it has just left, the legs concerned never go back.

    Raises:
        Infeasible: The programme did not converge, or its path does not keep the labels.
    """
    mission, robot = plan.mission, plan.robots[name]
    plain = replace(limits, rotors=None, yaw_rate=np.inf)
    speeds = leg_speeds(mission, robot, course)
    fixed = fixed_states(course, fitted.rest)
    within: list[tuple[int, Ball]] = []
    if roomy:
        within = [(node, room) for node, room in enumerate(course.rooms) if room is not None]
        fixed[[node for node, _ in within], 0] = np.nan
        if course.cycle is not None:
            fixed[[course.cycle, -1], 0] = fixed[course.cycle, 0] + 0.0 * fixed[-1, 0]  # both are free where one is

    left = [_PROGRAMMES]

    def solved(first: Spline, shift: float, steps: Steps = "plain", kept: Limits = plain) -> Spline:
        if not left[0]:
            raise Infeasible(f"{_PROGRAMMES} programmes did not lead to a path that keeps the corridors and labels.")
        left[0] -= 1
        corridors = [(leg, plane) for (_, leg, _), planes in rules.items() for plane in planes]
        return optimise(
            Timing(
                first,
                fixed,
                kept,
                "blend",
                shift,
                within,
                corridors,
                speeds,
                course.cycle,
                _INSTANTS,
                steps,
                settled=roomy,
            )
        )

    answers: list[Spline] = []

    def attempt() -> Spline:
        tries: list[Callable[[], Spline]] = [lambda: solved(answers[-1].stretched(_ROOM), ease)] if answers else []
        tries += [lambda: solved(start, ease), lambda: solved(start, ease, "cautious")]
        if not roomy:
            tries += [lambda shift=shift: solved(solved(start, shift * ease).stretched(_ROOM), ease) for shift in _SHIFTS]
        failure: Infeasible | None = None
        for run in tries:
            try:
                answers.append(run())
                return answers[-1]
            except Infeasible as error:
                failure = error
        assert failure is not None
        raise failure

    def within_rotors(path: Spline, yaw: Spline | None) -> tuple[Spline, Spline | None]:
        """Return the path with rotor thrusts considered by further programmes, where that beats stretching it for them."""
        best = path, yaw
        if path.duration <= answers[-1].duration * _STRETCHED:
            return best
        first = answers[-1].stretched(_ROOM)
        runs = [lambda: solved(first, ease, kept=replace(limits, yaw_rate=np.inf))]
        if ask.pace == "time":
            runs = [lambda share=share: solved(first, share * ease) for share in _EASED]
        for run in runs:
            try:
                finer = until_kept(course, rules, run, buffer=buffer)
                other, other_yaw = _slowed(plan, name, course, limits, finer, fitted.rest)
            except Infeasible:
                continue
            if other.duration < best[0].duration and not troubles(other, mission, name, robot):
                best = other, other_yaw
            if best[0].duration <= answers[-1].duration * _STRETCHED:
                break
        return best

    onward = fitted.onward
    while True:
        path, yaw = _slowed(plan, name, course, limits, until_kept(course, rules, attempt, buffer=buffer), fitted.rest)
        found = troubles(path, mission, name, robot)
        if not found:
            return within_rotors(path, yaw)
        more = onward | _legs_about(path, found[0].time)
        if more == onward:
            raise Infeasible(found[0].sentence, found[0])
        rules.update(onward_rules(course, more - onward))
        onward = more


def _hover(point: Floats, duration: float) -> Spline:
    states = np.zeros((2, 4, 3))
    states[:, 0] = point
    return Spline(np.array([duration]), states)
