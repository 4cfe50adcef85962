"""One robot's flight from its part of the plan: a corridor, a smooth path that keeps it, its pace, and its heading."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from refine.corridor.legs import CLEARANCE
from refine.corridor.planned import corridor_of
from refine.corridor.points import thinned, with_ramps, with_rests
from refine.corridor.relocation import moved_into_the_clear
from refine.limits.limits import Limits
from refine.obstacles.keep_out_bodies import Ball
from refine.single_robot.hovers import hovering, hovering_longer, with_hovers
from refine.single_robot.task import NOWHERE, Problem, RobotFlight, Task
from refine.single_robot.time_optimised import sped_up, time_optimised
from refine.single_robot.visits_shown import showing_visits
from refine.spline.spline import Spline
from verify.data import Infeasible
from verify.data.shapes.inequalities import Point
from verify.data.trajectory import HOVER, PIECES

Floats = NDArray[np.float64]


def robot_flight(problem: Problem, name: str, extra: tuple[Ball, ...] = (), rests: frozenset[int] = NOWHERE) -> RobotFlight:
    """Return one robot's flight without waits.

    Args:
        problem: What is refined.
        name: The robot's.
        extra: More bodies to stay out of, such as other robots that hover.
        rests: Visits for which the robot sets out from a rest.

    Raises:
        BadInput: The plan's numbers do not fit each other.
        Infeasible: A limit or a label cannot be kept; carries a witness.
        SolverTimeout: An engine's seconds ran out before its iterations.
    """
    plan, robot = problem.plan, problem.plan.robots[name]
    limits = Limits.of_mission(plan.mission, name)
    for (who, limit), factor in problem.feedback.limits.items():
        if who == name:
            limits = limits.tightened(limit, factor)
    if robot.still:
        cycle = None if robot.cycle_waypoint is None else 0
        flight = RobotFlight(name, robot, limits, None, _hover(np.array(robot.waypoints[0].position)), None, cycle, {})
        return hovering_longer(flight, sum(hover.seconds for hover in plan.hovers if hover.robot == name))
    try:
        return _moving(problem, name, limits, extra, rests)
    except Infeasible:
        moved = moved_into_the_clear(plan.mission, name, robot)
        if moved == robot:
            raise
        changed = plan.model_copy(update={"robots": {**plan.robots, name: moved}})
        return _moving(replace(problem, plan=changed), name, limits, extra, rests)


def _moving(problem: Problem, name: str, limits: Limits, extra: tuple[Ball, ...], rests: frozenset[int]) -> RobotFlight:
    """Return the flight of a robot that does go somewhere."""
    mission, robot, options = problem.plan.mission.seen_by(name), problem.plan.robots[name], problem.options
    more = problem.feedback.clearance.get(name, 0.0)
    corridor = corridor_of(mission, name, robot, clearance=CLEARANCE + more, extra=extra)
    most = options.held(problem.plan.mission, name)
    corridor = thinned(corridor, (most or PIECES) - 1, mission.spec.repeat)
    if corridor.rooms[-1] is not None and _ends_beside_others(problem, name):
        corridor = replace(corridor, rooms=(*corridor.rooms[:-1], None))
    stands = corridor.cycle is not None and corridor.cycle == len(corridor)
    if stands:
        corridor = replace(corridor, cycle=None)
    held = {meeting.then[1] for meeting in problem.plan.meetings if meeting.then[0] == name}
    in_region = ("leaves", "acts") if options.lingers else ("leaves",)
    held |= {wait.then[1] + 1 for wait in problem.plan.precedences if wait.then[0] == name and wait.due in in_region} & rests
    hovers = {hover.visit + 1: hover.seconds for hover in problem.plan.hovers if hover.robot == name}
    at_end = hovers.pop(len(robot.visits) + 1, 0.0)
    held |= hovers.keys()
    stays = {visit: mission.all_regions[robot.visits[visit - 1].region] if visit else None for visit in held}
    corridor, halts = with_rests(corridor, mission, rests.union(stays), stays)
    share = options.share(problem.plan.mission, name)
    if share is not None and options.blend is None and corridor.cycle is None:
        corridor, halts = with_ramps(corridor, halts, most or PIECES - 1)
    rest = frozenset(halts.values())
    if options.rests and corridor.cycle is None:
        rest = frozenset(range(len(corridor) + 1))
    task = Task(mission, name, robot, corridor, limits, more, options)
    fitted = showing_visits(task, rest)
    fastest = sped_up if options.effort == "least" else time_optimised
    motion = fitted.motion if share is None else fastest(task, fitted).stretched(1.0 / share)
    path, yaw, cycle = motion.path, motion.yaw, corridor.cycle
    if stands:
        cycle = len(path)
        path = Spline(np.append(path.durations, HOVER), np.concatenate([path.states, path.states[-1:]]))
        yaw = None if yaw is None else Spline(path.durations, np.concatenate([yaw.states, yaw.states[-1:]]))
    planned = None if share is None or stands else fitted.motion.path
    note = f"{name}: {motion.note}" if motion.note else ""
    flight = RobotFlight(name, robot, limits, corridor, path, yaw, cycle, halts, None, note)
    waits = {halts[visit]: seconds for visit, seconds in hovers.items()}
    waits[len(corridor)] = waits.get(len(corridor), 0.0) + at_end
    if planned is not None:
        planned = hovering(replace(flight, path=planned, yaw=None), waits).path
    return replace(with_hovers(flight, waits), planned=planned)


def _ends_beside_others(problem: Problem, name: str) -> bool:
    """Return whether another robot may end so near this one's last region that the plan's places for both are to be kept."""
    regions, spacing = problem.plan.mission.all_regions, problem.spacing
    ends: dict[str, tuple[Point, float]] = {}
    for who, robot in problem.plan.robots.items():
        region = regions.get(robot.visits[-1].region) if robot.visits else None
        ends[who] = (robot.waypoints[-1].position, 0.0) if region is None else (region.center, region.outer_radius)
    (centre, radius), widest = ends.pop(name), max(1.0, spacing.z_scale)
    return any(spacing.between(centre, other) < widest * (radius + reach) + spacing.distance for other, reach in ends.values())


def _hover(point: Floats) -> Spline:
    states = np.zeros((2, 4, 3))
    states[:, 0] = point
    return Spline(np.array([HOVER]), states)
