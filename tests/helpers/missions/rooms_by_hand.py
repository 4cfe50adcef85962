"""Rooms of boxes for refinement's tests: missions with walls, plans through them by hand, and how near flights come to the walls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tests.helpers.motion.plans_by_hand import robot_plan
from verify.data import Mission, Plan, Trajectory, Visit, Waypoint, parse_mission

Box = tuple[Sequence[float], Sequence[float]]
"""Centre and full lengths, m."""

MARGIN = 0.05


def walled(
    walls: Mapping[str, Box], *, start: Sequence[float], goal: Sequence[float], more: str = "", hole: str = ""
) -> Mission:
    """A mission of one robot from a start to a box around a goal; `hole` is an opening of the first wall."""
    lines = [f"  {name}: {{center: {list(at)}, size: {list(size)}}}" for name, (at, size) in walls.items()]
    if hole:
        lines[0] = lines[0].replace("}", f", openings: [{hole}]}}")
    return parse_mission(
        f"""
format: 1
name: rooms
spec: {{formula: F goal}}
regions: {{goal: {{center: {list(goal)}, size: [0.4, 0.4, 0.4]}}}}
agents: {{q: {{start: {list(start)}}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-3, -3, 0], max: [3, 3, 2]}}
margin: {MARGIN}
{more}
obstacles:
"""
        + "\n".join(lines)
        + "\n"
    )


def along(mission: Mission, *points: Sequence[float] | Waypoint) -> Plan:
    """A plan from the start by some points to the goal, at 0.45 m/s; waypoints with a visit of their own come first."""
    led = [p if isinstance(p, Waypoint) else Waypoint(position=(p[0], p[1], p[2]), role="avoid") for p in points]
    passed = sorted({p.visit for p in led if p.visit is not None})
    visits = tuple(Visit(region=next(p.region or "" for p in led if p.visit == number), direction="F") for number in passed)
    start = Waypoint(position=mission.agents["q"].start, role="start")
    end = Waypoint(position=mission.regions["goal"].center, role="centre", region="goal", visit=len(visits))
    return Plan(mission=mission, robots={"q": robot_plan([start, *led, end], (*visits, Visit(region="goal")))})


def passage(name: str, x: float, reach: float) -> tuple[Waypoint, Waypoint, Waypoint]:
    """The three points of a passage along x of a hoop at height 1 m, as the first visit."""
    places = (("rear", x - reach), ("centre", x), ("front", x + reach))
    rear, centre, front = (Waypoint(position=(at, 0.0, 1.0), role=role, region=name, visit=0) for role, at in places)  # type: ignore[arg-type]
    return rear, centre, front


def sampled(flight: Trajectory, count: int = 500) -> np.ndarray:
    """Points of a flight, from its coefficients alone. Shape (pieces * count, 3)."""
    found = []
    for duration, piece in zip(flight.durations, flight.coefficients, strict=True):
        times = np.linspace(0.0, duration, count)
        found.append(np.stack([np.polynomial.polynomial.polyval(times, piece[axis]) for axis in range(3)], axis=1))
    return np.concatenate(found)


def from_boxes(points: np.ndarray, walls: Mapping[str, Box]) -> float:
    """How near points come to upright boxes, m, by school geometry."""
    return min(
        float(np.linalg.norm(np.maximum(np.abs(points - at) - np.array(size) / 2, 0.0), axis=1).min())
        for at, size in walls.values()
    )
