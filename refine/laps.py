"""A team's laps: the prefix and one lap, each refined as a finite flight from rest to rest, and put together on a common clock.

Whoever has arrived hovers until the others have, so that laps begin and end together to the last bit (`refine.rest_to_rest`). The lap begins
where the prefix has come to rest, in the vehicle's own numbers, and leads back there. One robot whose laps do not fit its vehicle at once
flies them in the same way: the lap is uploaded once and started again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from refine.alternatives import first_feasible
from refine.coordination.spacing import spacing_for
from refine.corridor.legs import HOVERING
from refine.corridor.meeting_places import moved_to_meet
from refine.feedback import Feedback, feedback_of
from refine.lap_missions import Rest, before_laps, one_lap, rest_after
from refine.parts import from_rest_to_rest, longer_than_held
from refine.rest_to_rest import end_of
from refine.single_robot.task import RefinementOptions
from verify.data import Mission, Plan, RobotPlan, Trajectory, Visit, Witness
from verify.data.plan import Meeting
from verify.data.progress import Progress, part_of
from verify.data.trajectory import HOVER


def team_laps(plan: Plan, witnesses: tuple[Witness, ...], options: RefinementOptions, tell: Progress) -> dict[str, Trajectory]:
    """Turn a team's plan with laps into polynomials.

    Args:
        plan: Who visits what, with where each robot's cycle begins.
        witnesses: What the checker refused so far.
        options: What the caller asked for.
        tell: Receives a sentence and a share of the work.

    Raises:
        BadInput: The plan's numbers do not fit each other.
        Infeasible: A part of the flight cannot be flown as planned.
        DoesNotFit: A part is too long, and does not keep its limits where it is slowed down to rest.
        SolverTimeout: An engine's seconds ran out.
    """
    feedback = feedback_of(plan, witnesses)
    placed, nearer = (_with_own_places(plan, feedback, nearest=nearest) for nearest in (False, True))
    alternatives = [("", placed)]
    if placed.robots != nearer.robots:
        alternatives.append(("letting robots rest where each is nearest", nearer))
    return first_feasible([(name, partial(_laps, at, witnesses, options, tell)) for name, at in alternatives], tell)


def _laps(plan: Plan, witnesses: tuple[Witness, ...], options: RefinementOptions, tell: Progress) -> dict[str, Trajectory]:
    """Return prefix and lap of robots that rest at places of their own."""
    rests = {name: rest_after(plan.mission, name, robot) for name, robot in plan.robots.items()}
    once = from_rest_to_rest(_prefix(plan), witnesses, options, part_of(tell, 0.0, 0.5))
    ends = {name: end_of(pieces) for name, pieces in once.pieces.items() if pieces.durations}
    rests = {
        name: replace(rest, place=tuple(float(value) for value in ends[name][:3])) if name in ends else rest
        for name, rest in rests.items()
    }
    yaws = {name: float(end[3]) for name, end in ends.items()}
    lap = _lap(plan, rests, yaws)
    again = from_rest_to_rest(lap, witnesses, replace(options, closes=True), part_of(tell, 0.5, 0.95), HOVER)
    whole = once.then(again) if once.length else again
    begins = {name: len(once.pieces[name].durations) if once.length else 0 for name in plan.robots}
    laps = {
        name: Trajectory(pieces.durations, np.stack(pieces.coefficients), cycle=begins[name])
        for name, pieces in whole.pieces.items()
    }
    if options.too_long == "refuse" or not longer_than_held(plan.mission, laps, options):
        return laps
    cuts = {name: sorted({*whole.cuts[name], begins[name]}) for name in laps}
    return {name: Trajectory(p.durations, p.coefficients, cycle=p.cycle, cuts=cuts[name]) for name, p in laps.items()}


def _with_own_places(plan: Plan, feedback: Feedback, *, nearest: bool) -> Plan:
    """Give robots places of their own in the regions in which they rest while others come there too."""
    finite = plan.model_copy(update={"mission": before_laps(plan.mission)})
    if not plan.mission.written.counts and not _shared(plan):
        return plan
    kept = spacing_for(finite, feedback)
    moved = moved_to_meet(finite, kept.distance + HOVERING, kept.z_scale, nearest=nearest)
    return moved.model_copy(update={"mission": plan.mission})


def _shared(plan: Plan) -> bool:
    """Return whether a robot visits a region in which another one rests between laps."""
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
        waypoints = (
            w if w.visit is None or w.visit < begins else w.model_copy(update={"role": "via", "region": None, "visit": None})
            for w in robot.waypoints[: at + 1]  # a lap of one robot may begin on its way into a region
        )
        robots[name] = robot.model_copy(
            update={
                "visits": robot.visits[:begins],
                "waypoints": tuple(waypoints),
                "times": robot.times[: at + 1],
                "cycle_visit": None,
                "cycle_waypoint": None,
            }
        )
    meetings = tuple(m for m in plan.meetings if m.then[1] < (plan.robots[m.then[0]].cycle_visit or 0))
    changed = {"mission": _silent(before_laps(plan.mission)), "robots": robots, "meetings": meetings, "precedences": ()}
    hovers = tuple(hover for hover in plan.hovers if hover.visit < (plan.robots[hover.robot].cycle_visit or 0))
    return plan.model_copy(update={**changed, "hovers": hovers})


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
    hovers = tuple(
        hover.model_copy(update={"visit": hover.visit + shifts[hover.robot]})
        for hover in plan.hovers
        if hover.visit >= (plan.robots[hover.robot].cycle_visit or 0)
    )
    changed = {"mission": mission, "robots": robots, "meetings": meetings, "precedences": ()}
    return plan.model_copy(update={**changed, "hovers": hovers})


def _silent(mission: Mission) -> Mission:
    """Return the mission without its formula, which is checked of the whole flight: places for meetings are chosen already."""
    return mission.asking(None)
