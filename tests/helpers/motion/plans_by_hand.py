"""Plans made by hand for refinement's tests: halls with balls and hoops, robots on polylines at 0.45 m/s."""

from __future__ import annotations

import itertools

import numpy as np

from ltlplan.missions import load_mission
from verify.data import Mission, Plan, RobotPlan, Visit, Waypoint, Word
from verify.data.sections import Agent, Box, Spec
from verify.data.shapes.region import Region
from verify.data.vehicle import load_vehicle


def through(mission: Mission, name: str, visits: list[tuple[str, str]], *, cycle: int | None = None) -> RobotPlan:
    """Rear, centre and front of each hoop in flight order, at 0.45 m/s."""
    points = [Waypoint(position=mission.agents[name].start, role="start")]
    first = None
    for index, (hoop_name, way) in enumerate(visits):
        hoop = mission.hoops[hoop_name]
        along = np.array(hoop.normal) * hoop.reach
        if cycle == index:
            first = len(points)
        for role, share in (
            (("rear", -1), ("centre", 0), ("front", 1)) if way == "F" else (("front", 1), ("centre", 0), ("rear", -1))
        ):
            position = tuple((np.array(hoop.center) + share * along).tolist())
            points.append(Waypoint(position=position, role=role, region=hoop_name, visit=index))
    if first is not None:
        points.append(points[first])
    return robot_plan(points, tuple(Visit(region=h, direction=d) for h, d in visits), cycle, first)


def robot_plan(
    points: list[Waypoint], visits: tuple[Visit, ...] = (), cycle: int | None = None, first: int | None = None
) -> RobotPlan:
    lengths = [float(np.linalg.norm(np.subtract(a.position, b.position))) for a, b in itertools.pairwise(points)]
    times = tuple(float(t) for t in np.concatenate([[0.0], np.cumsum(lengths) / 0.45]))
    return RobotPlan(
        word=Word.of([[]]), visits=visits, waypoints=tuple(points), times=times, cycle_visit=cycle, cycle_waypoint=first
    )


def sequence_plan() -> Plan:
    mission = load_mission("hoops-sequence")
    robot = through(mission, "quad0", [("hoop0", "F"), ("hoop1", "F"), ("hoop2", "F"), ("hoop1", "R")])
    end = Waypoint(position=mission.agents["quad0"].end, role="end")
    return Plan(mission=mission, robots={"quad0": robot_plan([*robot.waypoints, end], robot.visits)})


def patrol_plan() -> Plan:
    mission = load_mission("hoops-ltl")
    return Plan(
        mission=mission, robots={"quad0": through(mission, "quad0", [("hoop0", "F"), ("hoop2", "F"), ("hoop1", "F")], cycle=0)}
    )


def fire_plan() -> Plan:
    mission = load_mission("firefighting")
    robots = {
        "quad0": through(mission, "quad0", [("water", "F"), ("smoke", "F"), ("loc2", "F")]),
        "quad1": through(mission, "quad1", []),
        "quad2": through(mission, "quad2", [("loc1", "F")]),
    }
    action = mission.robot.actions[0]
    visits = robots["quad0"].visits
    robots["quad0"] = robots["quad0"].model_copy(
        update={"visits": (visits[0].model_copy(update={"actions": (action,)}), *visits[1:])}
    )
    return Plan(mission=mission, robots=robots)


def room(regions: dict[str, Region], agents: dict[str, Agent], **more) -> Mission:
    box = Box(min=(-3.0, -3.0, 0.2), max=(3.0, 3.0, 2.5))
    return Mission(
        name="room",
        spec=Spec(formula="true"),
        regions=regions,
        agents=agents,
        vehicle=load_vehicle("crazyflie-2.1"),
        workspace=box,
        **more,
    )


def ball(x: float, y: float, radius: float = 0.3) -> Region:
    return Region(center=(x, y, 1.0), radii=(radius, radius, radius))


def straight(*positions, visits: dict[int, str] | None = None) -> RobotPlan:
    visits = visits or {}
    points = [Waypoint(position=tuple(map(float, p)), role="start" if i == 0 else "via") for i, p in enumerate(positions)]
    for visit, (index, region) in enumerate(visits.items()):
        points[index] = Waypoint(position=points[index].position, role="centre", region=region, visit=visit)
    return robot_plan(points, tuple(Visit(region=region) for region in visits.values()))
