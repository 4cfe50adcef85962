"""Spacing of robots: the distance that they keep, and of each robot its flight and the place where it hovers."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from refine.coordination.departures import ScheduledPath
from refine.corridor.legs import HOVERING
from refine.corridor.relocation import movable
from refine.corridor.sampled_stays import SampledStay, stays
from refine.feedback import Feedback
from refine.obstacles.keep_out_bodies import Ball, keep_out
from refine.single_robot.task import Problem, RobotFlight
from verify.data import Plan
from verify.data.plan import Meeting
from verify.data.shapes.inequalities import Point
from verify.data.validation.clocks import clock_error_of
from verify.data.validation.spacing import Spacing, spacing_of

_SLOWER = 2.0
"""How many times longer than planned a flight may get, for the drift of clocks until its end."""


def spacing_for(plan: Plan, feedback: Feedback) -> Spacing:
    """Return how far a plan's robots keep apart, and by how much their clocks differ: as its mission asks, and what witnesses asked for on top.

    No more than robots have where they hover before or after their flights, which no flight changes.
    """
    kept = spacing_of(plan.mission)
    widest = min((kept.between(a, b) for *_, a, b in firm_pairs(plan)), default=np.inf)
    room = max(widest - kept.at_rest, 0.0)
    longest = max(robot.hold + robot.times[-1] for robot in plan.robots.values())
    skew = clock_error_of(plan.mission, _SLOWER * longest)
    return replace(kept, distance=kept.distance + min(feedback.distance, float(room)), skew=skew)


def firm_pairs(plan: Plan) -> Iterator[tuple[str, str, str, Point, Point]]:
    """Yield two robots, whether they start or end there, and where: starts, and ends of which no visit can be made elsewhere."""
    for (name, one), (other_name, other) in itertools.combinations(plan.robots.items(), 2):
        yield name, other_name, "start", one.waypoints[0].position, other.waypoints[0].position
        a, b = one.waypoints[-1], other.waypoints[-1]
        if not (movable(plan.mission, name, one, a) or movable(plan.mission, other_name, other, b)):
            yield name, other_name, "end", a.position, b.position


def idle_others(problem: Problem, name: str) -> tuple[Ball, ...]:
    """Return the places of robots that never move, to be kept clear of."""
    plan, spacing = problem.plan, problem.spacing
    idle = [other for other, robot in plan.robots.items() if other != name and robot.still]
    places = {other: np.array(plan.robots[other].waypoints[0].position) for other in idle}
    return tuple(
        keep_out(f"{other}, which hovers there", place, spacing.distance + HOVERING, spacing.z_scale)
        for other, place in places.items()
    )


def hovers_of(
    robot: RobotFlight, spacing: Spacing, meetings: Sequence[Meeting] = (), *, anywhere: bool = False
) -> tuple[Ball, ...]:
    """Return where a robot hovers before and after its flight, and while it waits for others to arrive, to be kept clear of.

    Args:
        robot: Its flight.
        spacing: How far robots keep apart.
        meetings: Arrivals that robots wait for.
        anywhere: Whether it waits at all of its halts, not only for meetings.
    """
    waits = {robot.halts[meeting.then[1]] for meeting in meetings if meeting.then[0] == robot.name}
    waits |= set(robot.halts.values()) if anywhere else set()
    ends = [("starts", robot.path.nodes[0]), ("ends", robot.path.nodes[-1])]
    ends += [("waits", robot.path.nodes[node]) for node in sorted(waits)]
    return tuple(
        keep_out(f"{robot.name}, which {what} there", place, spacing.distance + HOVERING, spacing.z_scale)
        for what, place in ends
    )


def flight_of(plan: Plan, robot: RobotFlight) -> ScheduledPath:
    """Return a robot's flight as scheduling sees it."""
    found = stays(robot.path, plan.mission.all_regions, plan.mission.margin)
    arrives: tuple[float, ...] = ()
    sets_out: dict[int, float] = {}
    if plan.meetings:
        deep = stays(robot.path, plan.mission.all_regions, -plan.mission.margin)
        waits = {meeting.then[1] for meeting in plan.meetings if meeting.then[0] == robot.name}
        sets_out = {visit: float(robot.path.knots[robot.halts.get(visit, 0)]) for visit in waits}
        arrives = tuple(_arrival(robot, index, stay, deep) for index, stay in enumerate(found))
    inside: tuple[tuple[float, float], ...] = ()
    acts: dict[int, tuple[float, float]] = {}
    if any((wait.done, wait.due) != ("left", "enters") for wait in plan.precedences):
        deep = stays(robot.path, plan.mission.all_regions, -plan.mission.margin)
        sure = [_surely(stay, deep) for stay in found]
        inside = tuple((those[0].start, those[0].end) for those in sure)
        acts = {
            index: _acting(max(sure[index], key=lambda stay: stay.end - stay.start), len(visit.actions))
            for index, visit in enumerate(robot.plan.visits[: len(sure)])
            if visit.actions
        }
    visits = tuple((stay.start, stay.end) for stay in found)
    shares = {index: 1.0 / (len(robot.plan.visits[index].actions) + 1) for index in acts if found[index].start == 0.0}
    return ScheduledPath(robot.name, robot.path, visits, robot.plan.hold, arrives, sets_out, inside, acts, shares)


def _surely(stay: SampledStay, deep: Sequence[SampledStay]) -> list[SampledStay]:
    """Return the parts of a stay in which the robot is inside for sure, or the whole where samples show none."""
    return [o for o in deep if o.region == stay.region and stay.start <= o.start and o.end <= stay.end] or [stay]


def _acting(stay: SampledStay, actions: int) -> tuple[float, float]:
    """Return when the first and the last of a visit's actions are made: they are spread evenly."""
    step = (stay.end - stay.start) / (actions + 1)
    return stay.start + step, stay.end - step


def _arrival(robot: RobotFlight, visit: int, stay: SampledStay, deep: Sequence[SampledStay]) -> float:
    """Return when a robot has come to the place of a visit where it waits or ends; where it flies on, when it is deep in its region."""
    nodes, knots = robot.path.nodes, robot.path.knots
    if visit + 1 in robot.halts or visit + 1 == len(robot.plan.visits):
        node = robot.halts.get(visit + 1, len(nodes) - 1)
        while node > 0 and np.array_equal(nodes[node - 1], nodes[node]):
            node -= 1
        return float(knots[node])
    return next((o.start for o in deep if o.region == stay.region and stay.start <= o.start and o.end <= stay.end), stay.end)
