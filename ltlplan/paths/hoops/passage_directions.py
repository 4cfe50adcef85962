"""From which side each hoop is flown: the nearest control point (2019 paper, Section III-B), or the cheapest whole sequence.

A visit whose side is given keeps it. `nearest` goes through the visits in order and takes the side whose first control point
is closer to where the robot then is; a side that cannot be reached is passed over. `cheapest` finds the sequence of
sides with the smallest total length by dynamic programming over the two sides of each hoop; a lasso's closing leg counts.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from operator import itemgetter
from typing import Literal

import numpy as np

from ltlplan.paths.hoops.avoidance import Blocked
from ltlplan.paths.hoops.legs import Legs
from ltlplan.paths.hoops.stops import Side
from verify.data.mission import Mission
from verify.data.plan import Visit

Directions = Literal["nearest", "cheapest"]


def choose_sides(legs: Legs, directions: Directions) -> list[Side]:
    """Return a side for each visit; None for plain regions and for a hoop in which the flight begins or ends.

    Args:
        legs: Of the robot, whose lengths from side to side count, a lap's last leg too.
        directions: Whether the nearest side is taken each time, or the cheapest sequence of sides.

    Raises:
        Blocked: No choice of sides reaches all visits; names the hoop in the way.
    """
    stays = {0} if legs.begins_inside else set[int]()
    stays |= {len(legs.visits) - 1} if legs.inside_last else set()
    options = [_options(legs.mission, visit, stays=i in stays) for i, visit in enumerate(legs.visits)]
    return _nearest(legs, options) if directions == "nearest" else _cheapest(legs, options)


def _options(mission: Mission, visit: Visit, *, stays: bool) -> list[Side]:
    if visit.region not in mission.hoops or stays:
        return [None]
    return [visit.direction] if visit.direction is not None else ["F", "R"]


@dataclass
class _Lengths:
    """Lengths of legs, infinite where there is no way; the reasons are kept."""

    legs: Legs
    problems: list[Blocked] = field(default_factory=list[Blocked])

    def leg(self, i: int, left: Side, j: int, entered: Side) -> float:
        """Return how far it is from visit i, left on a side, to visit j, entered on a side, m; i = -1 is the start."""
        try:
            return self.legs.length(i, left, j, entered)
        except Blocked as error:
            self.problems.append(error)
            return math.inf


def _nearest(legs: Legs, options: list[list[Side]]) -> list[Side]:
    position = legs.start
    previous: Side = None
    chosen: list[Side] = []
    for i, (visit, sides) in enumerate(zip(legs.visits, options, strict=True)):
        lengths = _Lengths(legs)
        side: Side = sides[0]
        if side is None:
            position = np.array(legs.mission.all_regions[visit.region].center)
        else:
            ends = legs.ends(visit.region)
            ordered = sorted(sides, key=lambda side: float(np.linalg.norm(ends.outer(side or "F")[0] - position)))
            length: Callable[[Side], float] = partial(lengths.leg, i - 1, previous, i)
            if legs.mission.obstacles:
                ordered.sort(key=length)
            side = next((side for side in ordered if math.isfinite(length(side))), None)
            if side is None:
                raise lengths.problems[0]
            position = ends.outer(side)[1]
        chosen.append(side)
        previous = side
    return chosen


def _cheapest(legs: Legs, options: list[list[Side]]) -> list[Side]:
    lengths, first = _Lengths(legs), legs.closes_at
    anchors: list[Side] = [None] if first is None else options[first]
    nothing: tuple[float, list[Side]] = math.inf, []
    best = nothing
    for anchor in anchors:
        table: dict[Side, tuple[float, list[Side]]] = {None: (0.0, [])}
        for i, sides in enumerate(options):
            following: dict[Side, tuple[float, list[Side]]] = {}
            open_sides: list[Side] = [anchor] if i == first else sides
            for side in open_sides:
                for previous, (total, taken) in table.items():
                    candidate = total + lengths.leg(i - 1, previous, i, side)
                    if candidate < following.get(side, nothing)[0]:
                        following[side] = (candidate, [*taken, side])
            table = following
        for side, (total, taken) in table.items():
            closed = total if first is None else total + lengths.leg(len(options) - 1, side, first, anchor)
            best = min(best, (closed, taken), key=itemgetter(0))
    if best is nothing:
        raise lengths.problems[-1]
    return best[1]
