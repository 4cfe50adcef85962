"""A team's laps: the prefix and one lap, each refined as a finite flight from rest to rest, and put together on a common clock.

Whoever has arrived hovers until the others have, so that laps begin and end together to the last bit. For that all durations are
whole multiples of a fraction of a millisecond that float32 holds exactly. The lap begins where the prefix has come to rest,
in the vehicle's own numbers, and leads back there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from refine.coordination.spacing import spacing_for
from refine.coordination.team_flights import Together
from refine.corridor.legs import HOVERING
from refine.corridor.relocation import moved_to_meet
from refine.feedback import Feedback, feedback_of
from refine.single.values import RefinementOptions, RobotFlight
from refine.spline.rounding import quantise
from refine.spline.values import Spline
from verify.data import Mission, Plan, RobotPlan, Trajectory, Visit, Witness
from verify.data.laps import Rest, before_laps, one_lap, rest_after
from verify.data.plan import Meeting
from verify.data.progress import Progress, part_of
from verify.data.trajectory import HOVER

TICK = 2.0**-15
"""s; every duration is a multiple of it, so that sums of them are exact and a hover of the difference is too."""
_LONGEST = 256.0
"""s of one hover, which float32 still holds to a tick."""
_SHORTEST = 0.25
"""s of the shortest hover in which a robot waits for the others: coefficients of much shorter pieces drown in float32."""

Part = Callable[[Plan, Feedback, RefinementOptions, Progress], Together]
"""Refines a finite plan: `together` of `refine.coordination.team_flights`."""


@dataclass(frozen=True, slots=True)
class _Pieces:
    """One robot's pieces in a part of the flight; none where it never moves."""

    durations: tuple[float, ...]
    coefficients: tuple[np.ndarray, ...]

    @property
    def length(self) -> Fraction:
        return sum(map(Fraction, self.durations), Fraction(0))


def team_laps(
    plan: Plan, witnesses: tuple[Witness, ...], options: RefinementOptions, tell: Progress, part: Part
) -> dict[str, Trajectory]:
    """Turn a team's plan with laps into polynomials.

    Args:
        plan: Who visits what, with where each robot's cycle begins.
        witnesses: What the judge refused so far.
        options: What the caller asked for.
        tell: Told a sentence and a share of the work.
        part: Refines a finite plan.

    Raises:
        BadInput: The plan's numbers do not fit each other.
        Infeasible: A part of the flight cannot be flown as planned.
        SolverTimeout: An engine's seconds ran out.
    """
    options = replace(options, too_long="refuse")
    plan = _with_own_places(plan, feedback_of(plan, witnesses))
    rests = {name: rest_after(plan.mission, name, robot) for name, robot in plan.robots.items()}
    prefix = _prefix(plan)
    once = _flown(prefix, witnesses, options, part_of(tell, 0.0, 0.5), part)
    length, once = _common(once, {name: robot.waypoints[-1].position for name, robot in prefix.robots.items()}, prefix.mission)
    ends = {name: _end(pieces) for name, pieces in once.items() if pieces.durations}
    rests = {
        name: replace(rest, place=tuple(float(value) for value in ends[name][:3])) if name in ends else rest
        for name, rest in rests.items()
    }
    yaws = {name: float(end[3]) for name, end in ends.items()}
    lap = _lap(plan, rests, yaws)
    again = _flown(lap, witnesses, replace(options, closes=True), part_of(tell, 0.5, 0.95), part)
    _, again = _common(again, {name: rest.place for name, rest in rests.items()}, lap.mission, least=HOVER)
    return {
        name: Trajectory(
            (*once[name].durations, *again[name].durations) if length else again[name].durations,
            np.stack((*once[name].coefficients, *again[name].coefficients) if length else again[name].coefficients),
            cycle=len(once[name].durations) if length else 0,
        )
        for name in plan.robots
    }


def _with_own_places(plan: Plan, feedback: Feedback) -> Plan:
    """Give robots places of their own in the regions in which they rest while others come there too."""
    finite = plan.model_copy(update={"mission": before_laps(plan.mission)})
    if not plan.mission.written.counts and not _shared(plan):
        return plan
    kept = spacing_for(finite, feedback)
    moved = moved_to_meet(finite, kept.distance + HOVERING, kept.z_scale)
    return moved.model_copy(update={"mission": plan.mission})


def _shared(plan: Plan) -> bool:
    """Tell whether a robot visits a region in which another one rests between laps."""
    homes: dict[str, str] = {}
    for name, robot in plan.robots.items():
        if robot.cycle_waypoint is not None and (region := robot.waypoints[robot.cycle_waypoint].region) is not None:
            homes[name] = region
    visited = {name: {visit.region for visit in robot.visits} for name, robot in plan.robots.items()}
    return any(region in visited[other] for name, region in homes.items() for other in visited if other != name)


def _prefix(plan: Plan) -> Plan:
    """Return the finite plan up to where the first lap begins."""
    robots: dict[str, RobotPlan] = {}
    for name, robot in plan.robots.items():
        at, begins = robot.cycle_waypoint or 0, robot.cycle_visit or 0
        robots[name] = robot.model_copy(
            update={
                "visits": robot.visits[:begins],
                "waypoints": robot.waypoints[: at + 1],
                "times": robot.times[: at + 1],
                "cycle_visit": None,
                "cycle_waypoint": None,
            }
        )
    meetings = tuple(m for m in plan.meetings if m.then[1] < (plan.robots[m.then[0]].cycle_visit or 0))
    return plan.model_copy(
        update={"mission": _silent(before_laps(plan.mission)), "robots": robots, "meetings": meetings, "precedences": ()}
    )


def _lap(plan: Plan, rests: Mapping[str, Rest], yaws: Mapping[str, float]) -> Plan:
    """Return the finite plan of one lap, which begins and ends where robots rest, with the headings that they have there."""
    mission = _silent(one_lap(plan.mission, rests))
    agents = {
        name: agent.model_copy(update={"yaw_deg": math.degrees(yaws[name])}) if name in yaws else agent
        for name, agent in mission.agents.items()
    }
    mission = mission.model_copy(update={"agents": agents})
    robots: dict[str, RobotPlan] = {}
    shifts: dict[str, int] = {}
    for name, robot in plan.robots.items():
        at, begins, place = robot.cycle_waypoint or 0, robot.cycle_visit or 0, rests[name].place
        inside = [region for region, body in mission.all_regions.items() if float(body.level(np.array(place))) <= 1.0]
        shifts[name] = len(inside) - begins
        waypoints = [
            w if w.visit is None else w.model_copy(update={"visit": w.visit + shifts[name]}) for w in robot.waypoints[at:]
        ]
        waypoints[0] = waypoints[0].model_copy(update={"position": place, "role": "start", "visit": 0 if inside else None})
        waypoints[-1] = waypoints[-1].model_copy(update={"position": place})
        if robot.hovers:
            waypoints = waypoints[:1]
        robots[name] = robot.model_copy(
            update={
                "visits": (*(Visit(region=region) for region in inside), *robot.visits[begins:]),
                "waypoints": tuple(waypoints),
                "times": tuple(time - robot.times[at] for time in robot.times[at : at + len(waypoints)]),
                "cycle_visit": None,
                "cycle_waypoint": None,
                "hold": 0.0,
            }
        )
    meetings = tuple(
        Meeting(first=(m.first[0], m.first[1] + shifts[m.first[0]]), then=(m.then[0], m.then[1] + shifts[m.then[0]]))
        for m in plan.meetings
        if m.then[1] >= (plan.robots[m.then[0]].cycle_visit or 0)
    )
    return plan.model_copy(update={"mission": mission, "robots": robots, "meetings": meetings, "precedences": ()})


def _silent(mission: Mission) -> Mission:
    """Return the mission without its formula, which is judged of the whole flight: places for meetings are chosen already."""
    return mission.asking(None)


def _flown(
    plan: Plan, witnesses: tuple[Witness, ...], options: RefinementOptions, tell: Progress, part: Part
) -> dict[str, _Pieces]:
    """Return each robot's pieces, waits before it departs included; none for those that never move."""
    nothing = _Pieces((), ())
    if all(robot.still for robot in plan.robots.values()):
        return dict.fromkeys(plan.robots, nothing)
    robots, starts = part(plan, feedback_of(plan, witnesses), options, tell)
    return {
        name: nothing if _never_moves(robot) else _pieces(robot, plan.mission.agents[name].yaw, starts[name])
        for name, robot in robots.items()
    }


def _never_moves(robot: RobotFlight) -> bool:
    return (
        robot.corridor is None and not robot.path.states[:, 1:].any() and np.ptp(robot.path.states[:, 0], axis=0).max() == 0.0
    )


def _pieces(robot: RobotFlight, start_yaw: float, departure: float) -> _Pieces:
    path = robot.path
    yaw = np.zeros((len(path) + 1, 4, 1)) if robot.yaw is None else robot.yaw.states
    if robot.yaw is None:
        yaw[:, 0] = start_yaw
    states, durations = np.concatenate([path.states, yaw], axis=2), path.durations
    if departure > 0.0:
        states = np.concatenate([states[:1], states])
        durations = np.concatenate([[departure], durations])
    ticks = np.maximum(np.round(durations / TICK), 1.0) * TICK
    flown = quantise(Spline(ticks, states))
    return _Pieces(tuple(flown.durations.tolist()), tuple(flown.coefficients))


def _end(pieces: _Pieces) -> np.ndarray:
    """Return where a robot comes to rest, in float32: x, y, z in m and yaw in rad. Shape (4,)."""
    powers = pieces.durations[-1] ** np.arange(8)
    return (pieces.coefficients[-1] @ powers).astype(np.float32).astype(np.float64)


def _common(
    flown: Mapping[str, _Pieces], places: Mapping[str, tuple[float, ...]], mission: Mission, *, least: float = 0.0
) -> tuple[Fraction, dict[str, _Pieces]]:
    """Return how long a part lasts, in s, and each robot's pieces with a hover at its end, if it has to wait for the others.

    A part in which nobody moves lasts `least` s.
    """
    length = max((pieces.length for pieces in flown.values()), default=Fraction(0))
    if not length:
        length = Fraction(least)
    if any(0 < length - pieces.length < Fraction(_SHORTEST) for pieces in flown.values()):
        length += Fraction(_SHORTEST)
    found: dict[str, _Pieces] = {}
    for name, pieces in flown.items():
        here = np.array([*places[name], mission.agents[name].yaw], dtype=np.float32).astype(np.float64)
        if pieces.durations:
            here = _end(pieces)
        hover = np.zeros((4, 8))
        hover[:, 0] = here
        waits = _waits(length - pieces.length)
        found[name] = _Pieces((*pieces.durations, *waits), (*pieces.coefficients, *(hover,) * len(waits)))
    return length, found


def _waits(left: Fraction) -> tuple[float, ...]:
    """Return hovers of this length in all, in s, each of whole ticks and not too long for float32."""
    ticks = left / Fraction(TICK)
    assert ticks.denominator == 1
    count = max(1, math.ceil(left / Fraction(_LONGEST))) if left else 0
    share, more = divmod(ticks.numerator, count) if count else (0, 0)
    return tuple(float((share + (index < more)) * Fraction(TICK)) for index in range(count))
