"""Random hoop courses: missions with hoops at random places and a random sequence of passages, for tests and benchmarks."""

from __future__ import annotations

import numpy as np

from ltlplan.paths.hoops import route_sequence
from verify.data import BadInput, Infeasible, Mission, RobotPlan
from verify.data.mission import check_mission
from verify.data.sections import Agent, Box, Planner, Spec
from verify.data.shapes.region import Hoop
from verify.data.vehicle import load_vehicle


def course(rng: np.random.Generator, hoops: int, passages: int, *, cycle: bool = False) -> Mission | None:
    """Return a random course in a box of 4 x 4 x 2.5 m, or None where its draw breaks a rule of missions."""
    low, high = np.array([-2.0, -2.0, 0.3]), np.array([2.0, 2.0, 2.5])
    margin = np.array([0.6, 0.6, 0.5])
    centres: list[np.ndarray] = []
    while len(centres) < hoops:
        centre = rng.uniform(low + margin, high - margin)
        if all(np.linalg.norm(centre - other) > 1.0 for other in centres):
            centres.append(centre)
    table = {
        f"h{i}": Hoop(
            center=tuple(float(x) for x in c),
            yaw_deg=float(rng.uniform(-180, 180)),
            radii=(0.2, 0.2, 0.2),
            opening=0.25,
            rim=0.02,
        )
        for i, c in enumerate(centres)
    }
    names = [f"h{int(i)}{'FR'[int(rng.integers(2))]}" for i in rng.permutation(hoops)[:passages]]
    start = rng.uniform(low + 0.3, high - 0.3)
    sequence = " ".join(names)
    mission = Mission(
        name="course",
        spec=Spec(trace="infinite" if cycle else "finite"),
        hoops=table,
        agents={"quad0": Agent(start=tuple(float(x) for x in start))},
        vehicle=load_vehicle("crazyflie-2.1"),
        workspace=Box(min=tuple(low.tolist()), max=tuple(high.tolist())),
        sequence=f"({sequence})*" if cycle else sequence,
        planner=Planner(cost={"length": 1.0, "effort": 0.5}),
    )
    try:
        return check_mission(mission)
    except BadInput:
        return None


def courses(seed: int, count: int, *, hoops: int = 4, passages: int = 3) -> list[tuple[Mission, RobotPlan]]:
    """Return random courses that have a nominal path, each with it."""
    rng = np.random.default_rng(seed)
    found: list[tuple[Mission, RobotPlan]] = []
    while len(found) < count:
        mission = course(rng, hoops, passages)
        if mission is None:
            continue
        try:
            found.append((mission, route_sequence(mission)))
        except Infeasible:
            continue
    return found
