"""Random plans in random rooms: regions that may overlap, hoops, one to three robots, laps, limits and margins of all sizes.

Nothing is kept away from anything by construction, so a good share of these plans cannot be flown: waypoints lie in regions
that may not be entered, openings are too small, robots swap places in narrow rooms.
"""

from __future__ import annotations

import itertools

import numpy as np

from verify.data import BadInput, Mission, Plan, RobotPlan, Visit, Waypoint, Word
from verify.data.mission import check_mission
from verify.data.sections import Agent, Box, LegLimits, Limits, Spec
from verify.data.shapes.region import Hoop, Region
from verify.data.vehicle import load_vehicle

HIGH = 2.2


def random_plan(seed: int) -> Plan:
    """Return the plan of a seed; rooms that break a rule of mission files are drawn again."""
    rng = np.random.default_rng(seed)
    while True:
        mission = _room(rng)
        try:
            mission = check_mission(mission)
        except BadInput:
            continue
        lap = len(mission.agents) == 1 and len(mission.hoops) > 1 and rng.random() < 0.4
        if lap:
            mission = mission.model_copy(update={"spec": Spec(formula="true", trace="infinite", repeat=2)})
        robots = {name: _robot(mission, name, rng, lap) for name in mission.agents}
        if all(robot is not None for robot in robots.values()):
            return Plan(mission=mission, robots={name: robot for name, robot in robots.items() if robot is not None})


def _room(rng: np.random.Generator) -> Mission:
    half = np.array([rng.uniform(1.2, 2.5), rng.uniform(0.5, 2.0)])

    def place(clear: float = 0.25) -> tuple[float, float, float]:
        low, high = np.append(-half, 0.2) + clear, np.append(half, HIGH) - clear
        return tuple(float(x) for x in rng.uniform(low, high))

    names = iter("abcdefgh")
    regions = {
        next(names): Region(
            center=place(), radii=tuple(float(r) for r in rng.uniform(0.08, 0.4, size=3)), yaw_deg=float(rng.uniform(-90, 90))
        )
        for _ in range(int(rng.integers(1, 5)))
    }
    hoops = {
        f"h{i}": Hoop(
            center=place(0.45),
            radii=(0.2, 0.2, 0.2),
            yaw_deg=float(rng.uniform(-180, 180)),
            opening=float(rng.choice([0.25, 0.4])),
            rim=0.02,
        )
        for i in range(int(rng.integers(0, 3)))
    }
    agents = {
        f"q{i}": Agent(start=place(), heading=[("fixed"), ("path"), (0.0, 0.0, 1.0)][int(rng.integers(3))])
        for i in range(int(rng.integers(1, 4)))
    }
    legs = {"a": LegLimits(speed=0.3)} if rng.random() < 0.2 else {}
    return Mission(
        name="random",
        spec=Spec(formula="true"),
        hoops=hoops,
        regions=regions,
        agents=agents,
        vehicle=load_vehicle("crazyflie-2.1"),
        limits=Limits(speed=float(rng.choice([0.4, 1.0])), tilt_deg=float(rng.choice([10.0, 35.0])), legs=legs),
        workspace=Box(min=(*(-half).tolist(), 0.2), max=(*half.tolist(), HIGH)),
        margin=float(rng.choice([0.01, 0.03, 0.06])),
        separation=float(rng.choice([0.25, 0.4])),
    )


def _robot(mission: Mission, name: str, rng: np.random.Generator, lap: bool) -> RobotPlan | None:
    """Return a robot's plan: visits of regions and passages of hoops in random order; None where its start is in a region."""
    start = mission.agents[name].start
    if any(float(region.level(np.array(start))) < 1.5 for region in mission.all_regions.values()):
        return None
    points, visits = [Waypoint(position=start, role="start")], []
    targets = list(rng.permutation([*mission.hoops, *mission.regions])[: int(rng.integers(0, 4))])
    if lap:
        targets = list(mission.hoops)
    for visit, target in enumerate(map(str, targets)):
        if target in mission.hoops:
            hoop, way = mission.hoops[target], "FR"[int(rng.integers(2))]
            roles = (("rear", -1), ("centre", 0), ("front", 1))
            along = np.array(hoop.normal) * (hoop.reach or 0.0)
            for role, share in roles if way == "F" else roles[::-1]:
                position = tuple((np.array(hoop.center) + share * along).tolist())
                points.append(Waypoint(position=position, role=role, region=target, visit=visit))
            visits.append(Visit(region=target, direction=way))
            continue
        region, offset = mission.regions[target], rng.normal(size=3)
        offset *= rng.uniform(0.0, 0.9) * min(region.radii) / np.linalg.norm(offset)
        position = tuple((np.array(region.center) + offset).tolist())
        points.append(Waypoint(position=position, role="centre", region=target, visit=visit))
        visits.append(Visit(region=target))
    if lap:
        points.append(points[1])
    elif rng.random() < 0.7:
        points.append(Waypoint(position=_free(mission, rng), role="end"))
    lengths = [np.linalg.norm(np.subtract(a.position, b.position)) for a, b in itertools.pairwise(points)]
    times = tuple(float(t) for t in np.concatenate([[0.0], np.cumsum(lengths) / 0.45]))
    cycle = (0, 1) if lap else (None, None)
    return RobotPlan(
        word=Word.of([[]]),
        visits=tuple(visits),
        waypoints=tuple(points),
        times=times,
        cycle_visit=cycle[0],
        cycle_waypoint=cycle[1],
    )


def _free(mission: Mission, rng: np.random.Generator) -> tuple[float, float, float]:
    low, high = np.array(mission.workspace.min) + 0.2, np.array(mission.workspace.max) - 0.2
    return tuple(float(x) for x in rng.uniform(low, high))
