"""Ways around robots that hover, and to places where nobody is in the way: geometry only, whatever the team does.

| function | what it finds |
|---|---|
| `way_from` | a robot's way from where it hovers |
| `led_around` | the same, around places where others hover |
| `places_aside` | places in free flight that are off some paths |
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from ltlplan.allocation import Itinerary
from ltlplan.paths.hoops import route_itinerary
from verify.data import Mission, RobotPlan
from verify.data.shapes.inequalities import Point
from verify.data.shapes.region import Region

Floats = NDArray[np.float64]

_SPARE = 0.03
"""m beyond the distance that robots keep, by which a way leads around one that hovers."""
_NEAR = 0.05
"""m beyond the margin that a way's start keeps from what it leads around."""
_GRID = 0.15
"""m between places to step aside to."""
_LEAST = 0.02
"""m; radius of the smallest body that is led around."""


def way_from(mission: Mission, robot: str, start: Point, does: Itinerary, end: Point | None = None) -> RobotPlan:
    """Lay the way of a robot that hovers, as if it were alone.

    Args:
        mission: What to keep clear of.
        robot: Who flies.
        start: m, where it hovers.
        does: What it visits and shows; regions that it begins in are visits, too.
        end: m, where the robot is to hover at last; by default where the mission says.

    Raises:
        Infeasible: There is none.
    """
    changes = {"start": start} if end is None else {"start": start, "end": end}
    agent = mission.agents[robot].model_copy(update=changes)
    return route_itinerary(mission.model_copy(update={"agents": {robot: agent}}), robot, does)


# six parameters: who flies what from where, around whom
def led_around(
    mission: Mission, robot: str, start: Point, does: Itinerary, hovering: Iterable[Point], distance: float
) -> RobotPlan:
    """Lay one robot's way around places where others hover, as far from them as `distance`, or as the start allows.

    Args:
        mission: What is asked.
        robot: Who flies.
        start: m, where it hovers.
        does: What it visits and shows.
        hovering: m, where others hover.
        distance: m.

    Raises:
        Infeasible: There is no way around, or somebody hovers where the robot is to go.
    """
    bodies: dict[str, Region] = {}
    for index, place in enumerate(hovering):
        away = float(np.linalg.norm(np.array(place) - np.array(start)))
        radius = min(distance + _SPARE, away - _NEAR) - mission.margin
        if radius > _LEAST:
            bodies[f" robot {index} "] = Region(center=place, radii=(radius, radius, radius))
    return way_from(mission.model_copy(update={"regions": {**mission.regions, **bodies}}), robot, start, does)


def places_aside(mission: Mission, start: Point, paths: Sequence[Floats], distance: float) -> list[Point]:
    """Return places in free flight that are as far as `distance` from some paths, the nearest to a start first.

    Args:
        mission: Regions, margin and workspace.
        start: m.
        paths: m, where nobody may be. Each of shape (n, 3).
        distance: m.
    """
    inset = mission.margin + 0.1
    low, high = np.array(mission.workspace.min) + inset, np.array(mission.workspace.max) - inset
    axes = [np.arange(a, b, _GRID) if b > a else np.array([(a + b) / 2.0]) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    for region in mission.all_regions.values():
        reach = region.outer_radius
        grid = grid[np.linalg.norm(grid - np.array(region.center), axis=1) > reach * (1.0 + inset / region.inner_radius)]
    for hoop in mission.hoops.values():
        ring = hoop.opening + hoop.rim + inset + max(mission.vehicle_of(robot).radius for robot in mission.agents)
        grid = grid[np.linalg.norm(grid - np.array(hoop.center), axis=1) > ring]
    for path in paths:
        if len(grid):
            grid = grid[np.linalg.norm(grid[:, None] - path[None], axis=2).min(axis=1) > distance]
    order = np.argsort(np.linalg.norm(grid - np.array(start), axis=1), kind="stable")
    return [(float(x), float(y), float(z)) for x, y, z in grid[order]]
