"""Exchange of places among robots that visit the same regions, so that their ways through all of these are short.

Robots that cross several regions side by side keep to lanes. Each region by itself is a linear assignment of its places to robots, by the
squares of their straight ways there and on: those of robots that set out together then do not cross (Turpin et al. 2014). The regions are
gone through in turn until no exchange shortens any ways.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from refine.corridor.relocation import movable, places_of
from verify.data import Plan, RobotPlan, Waypoint

Floats = NDArray[np.float64]
Visits = Mapping[str, list[int]]
"""Each robot's waypoints in one region, by index; they lie at one place."""

_FORBIDDEN = 1e9
"""m^2; more than any ways."""
_ROUNDS = 20
_ENOUGH = 1e-9
"""m^2 that a round has to save."""
_STRAIGHT = 1e-6
"""m by which a way is longer by a point on it that leads straight on, at the most."""


def exchange(plan: Plan, moved: Mapping[str, list[Waypoint]], regions: Mapping[str, Visits]) -> None:
    """Exchange places within each region; a robot gets none where it may not be.

    Args:
        plan: Whose robots visit the regions.
        moved: Their waypoints, each robot at a place of its own in each region, which are changed.
        regions: Who visits each region, and by which waypoints.
    """
    from scipy.optimize import linear_sum_assignment  # here: it takes long to load, and few teams need it

    allowed = {region: _allowed(plan, moved, visits) for region, visits in regions.items()}
    before = np.inf
    for number in range(_ROUNDS):
        for region, visits in regions.items():
            places = [moved[name][own[0]].position for name, own in visits.items()]
            costs = np.array([_costs(moved[name], own, places, onwards=number > 0) for name, own in visits.items()])
            _, chosen = linear_sum_assignment(np.where(allowed[region], costs, _FORBIDDEN))
            for (name, own), place in zip(visits.items(), chosen, strict=True):
                for index in own:
                    moved[name][index] = moved[name][index].model_copy(update={"position": places[place]})
            allowed[region] = allowed[region][:, chosen]
        squares = sum(_squares(points) for points in moved.values())
        if number and squares > before - _ENOUGH:
            break
        before = squares


def _allowed(plan: Plan, moved: Mapping[str, list[Waypoint]], visits: Visits) -> NDArray[np.bool_]:
    """Return which robots may visit which places: each its own. Shape (robots, places)."""
    places = np.array([moved[name][own[0]].position for name, own in visits.items()])
    found = np.eye(len(places), dtype=np.bool_)
    for row, (name, own) in zip(found, visits.items(), strict=True):
        robot, elsewhere = plan.robots[name], np.ones(len(places), dtype=np.bool_)
        for index in own:
            free = places_of(plan.mission, name, robot, robot.waypoints[index], ())
            elsewhere &= (free[:, None] == places).all(axis=2).any(axis=0)
        row |= elsewhere
    return found


def _costs(points: list[Waypoint], own: list[int], places: list[tuple[float, ...]], *, onwards: bool) -> Floats:
    """Return the squares of a robot's ways to each place, and on from there, m^2. Shape (places,)."""
    ends = [index + step for index in own for step in ((-1, 1) if onwards else (-1,)) if 0 <= index + step < len(points)]
    ends = [np.array(points[end].position) for end in ends if end not in own]
    return np.sum([np.sum((np.array(places) - end) ** 2, axis=1) for end in ends], axis=0)


def _squares(points: list[Waypoint]) -> float:
    return sum(float(np.sum((np.array(a.position) - np.array(b.position)) ** 2)) for a, b in itertools.pairwise(points))


def without_gates(plan: Plan) -> Plan:
    """Return the plan without the points that only lead straight on: just outside a region to the place of a visit, and between two others.

    Args:
        plan: Its visits are about to be made at other places; laps, which begin at such points, keep theirs.
    """
    robots = {
        name: robot if robot.cycle_waypoint is not None else _without_gates(plan, name, robot)
        for name, robot in plan.robots.items()
    }
    return plan.model_copy(update={"robots": robots})


def _without_gates(plan: Plan, name: str, robot: RobotPlan) -> RobotPlan:
    regions, points = plan.mission.regions, robot.waypoints
    kept = _turning(points)
    gates = {
        index
        for before, index, visit in zip(kept[:-2], kept[1:-1], kept[2:], strict=True)
        if (points[index].role, points[visit].role) == ("via", "centre")
        and points[index].visit == points[visit].visit
        and movable(plan.mission, name, robot, points[visit])
        and regions[points[visit].region or ""].level(np.array(points[before].position))
        > 1.0  # else it leaves the region there
    }
    kept = [index for index in kept if index not in gates]
    return robot.model_copy(update={"waypoints": tuple(points[i] for i in kept), "times": tuple(robot.times[i] for i in kept)})


def _turning(points: Sequence[Waypoint]) -> list[int]:
    """Return the indices of points without those that belong to no region and lie on a straight line between their neighbours."""
    places, kept, number = [np.array(point.position) for point in points], list(range(len(points))), 1
    while number < len(kept) - 1:
        before, here, after = (places[index] for index in kept[number - 1 : number + 2])
        longer = np.linalg.norm(here - before) + np.linalg.norm(after - here) - np.linalg.norm(after - before)
        if longer < _STRAIGHT and points[kept[number]].role == "via" and points[kept[number]].region is None:
            del kept[number]
        else:
            number += 1
    return kept
