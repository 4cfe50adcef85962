"""From which side each hoop is flown: the nearest control point (2019 paper, Section III-B), or the cheapest whole sequence.

A visit whose side is given keeps it. `nearest` goes through the visits in order and takes the side whose first control point
is closer to where the robot then is; a side that cannot be reached is passed over. `cheapest` finds the sequence of
sides with the smallest total length by dynamic programming over the two sides of each hoop; a lasso's closing leg counts.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from ltlplan.paths.hoops.avoidance import Blocked
from ltlplan.paths.hoops.legs import Legs
from ltlplan.paths.hoops.stops import Side
from verify.data.mission import Mission
from verify.data.plan import Visit
from verify.data.shapes.region import Hoop

Directions = Literal["nearest", "cheapest"]
Cost = Callable[[int, Side, int, Side], float]
"""Length in m from visit i, left on a side, to visit j, entered on a side; i = -1 is the start. Raises Blocked."""


def choose_sides(legs: Legs, cycle_visit: int | None, directions: Directions) -> list[Side]:
    """Return a side for each visit; None for plain regions and for a hoop in which the flight begins or ends.

    Args:
        legs: Of the robot, whose lengths from side to side count.
        cycle_visit: First visit of a lasso's cycle; None for a finite flight.
        directions: Whether the nearest side is taken each time, or the cheapest sequence of sides.

    Raises:
        Blocked: No choice of sides reaches all visits; names the hoop in the way.
    """
    stays = {0} if legs.begins_inside else set[int]()
    stays |= {len(legs.visits) - 1} if legs.inside_last else set()
    options = [_options(legs.mission, visit, stays=i in stays) for i, visit in enumerate(legs.visits)]
    if not options:
        return []
    if directions == "nearest":
        return _nearest(legs, options)
    return _cheapest(options, cycle_visit, legs.length)


def _options(mission: Mission, visit: Visit, *, stays: bool) -> list[Side]:
    if not isinstance(mission.all_regions[visit.region], Hoop) or stays:
        return [None]
    return [visit.direction] if visit.direction is not None else ["F", "R"]


def _nearest(legs: Legs, options: list[list[Side]]) -> list[Side]:
    mission, cost = legs.mission, legs.length
    position, chosen = legs.start, []
    previous: Side = None
    for i, visit in enumerate(legs.visits):
        region = mission.all_regions[visit.region]
        if options[i] == [None] or not isinstance(region, Hoop):
            chosen.append(None)
            position = np.array(region.center)
            previous = None
            continue
        ends = legs.ends(visit.region)
        here = position
        ordered = sorted(options[i], key=lambda side: float(np.linalg.norm(ends.outer(side or "F")[0] - here)))
        if mission.obstacles:
            ordered = _by_length(ordered, lambda side: cost(i - 1, previous, i, side))  # noqa: B023  # asked at once
        problem: Blocked | None = None
        for side in ordered:
            try:
                cost(i - 1, previous, i, side)
            except Blocked as error:
                problem = problem or error
                continue
            chosen.append(side)
            position, previous = ends.outer(side or "F")[1], side
            break
        else:
            assert problem is not None
            raise problem
    return chosen


def _by_length(sides: list[Side], length: Callable[[Side], float]) -> list[Side]:
    """Order sides by how long the ways to them are; those without a way come last."""

    def key(side: Side) -> float:
        try:
            return length(side)
        except Blocked:
            return float("inf")

    return sorted(sides, key=key)


def _cheapest(options: list[list[Side]], cycle_visit: int | None, cost: Cost) -> list[Side]:
    first = cycle_visit if cycle_visit is not None and cycle_visit < len(options) else None
    anchors: list[Side] = [None] if first is None else options[first]
    best: tuple[float, list[Side]] | None = None
    problem: Blocked | None = None
    for anchor in anchors:
        table: dict[Side, tuple[float, list[Side]]] = {None: (0.0, [])}
        for i, sides in enumerate(options):
            following: dict[Side, tuple[float, list[Side]]] = {}
            open_sides: list[Side] = [anchor] if i == first else sides
            for side in open_sides:
                for previous, (total, taken) in table.items():
                    try:
                        candidate = total + cost(i - 1, previous, i, side)
                    except Blocked as error:
                        problem = error
                        continue
                    if side not in following or candidate < following[side][0]:
                        following[side] = (candidate, [*taken, side])
            table = following
        for side, (total, taken) in table.items():
            try:
                closed = total if first is None else total + cost(len(options) - 1, side, first, anchor)
            except Blocked as error:
                problem = error
                continue
            if best is None or closed < best[0]:
                best = (closed, taken)
    if best is None:
        assert problem is not None
        raise problem
    return best[1]
