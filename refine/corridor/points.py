"""A corridor with points put in or left out: places to wait at, and fewer pieces where straight legs allow it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from refine.corridor.corridor import Corridor
from refine.corridor.legs import CLEARANCE, Leg, bodies_of
from refine.obstacles.keep_out_bodies import Disc, GrownRegion, blocking
from verify.data import Mission
from verify.data.shapes.region import Region

_CROWDED = 0.04
"""m from a neighbour at which a point that is not needed is left out."""
_RAMP = 0.25
"""Share of a leg on which a robot gathers speed from a rest, or comes to one."""
_PARTS = 64
"""Parts of a leg whose ends are looked at for a place to wait."""


def with_rests(
    corridor: Corridor, mission: Mission, visits: frozenset[int], stays: Mapping[int, Region | None] | None = None
) -> tuple[Corridor, dict[int, int]]:
    """Return the corridor with a point at which to wait for each of these visits, and which point that is.

    It is where the robot sets out for the visit, or where that lies in a region, the first place on the way that does not:
    others may have to wait until it has left.

    Args:
        corridor: The robot's.
        mission: Gives regions and hoops.
        visits: For which it waits; numbers in its plan.
        stays: For some of these the region in which it waits, the one that it visits before: others come there. None: its start.
            One more than the last visit: it waits there before it flies to its end, or at its end where that lies there.
    """
    if not visits:
        return corridor, {}
    bodies = bodies_of(mission, corridor.robot, CLEARANCE)
    outside = (*bodies.regions.values(), *bodies.rings.values())
    last = max((leg.visit for leg in corridor.legs if leg.visit is not None), default=-1)
    first = {
        visit: next((i for i, leg in enumerate(corridor.legs) if leg.visit == visit), 0) for visit in visits if visit <= last
    }
    first |= {visit: len(corridor) - 1 for visit in visits if visit > last}  # it waits before its way to the end
    stops: dict[int, int] = {}
    for visit, region in (stays or {}).items():
        latest = first[visit] + (visit > last)
        first[visit] = 0 if region is None else _deepest(corridor, region, latest)
    for visit in sorted(visits, key=lambda each: (-first[each], each)):
        node, share = first[visit], 0.0
        if node < len(corridor) and visit not in (stays or {}):
            node, share = _first_outside(corridor, node, outside)
        if share > 0.0:
            corridor = _cut(corridor, node, share)
            stops = {other: place + 1 for other, place in stops.items()}
        stops[visit] = node + (share > 0.0)
    return corridor, stops


def _first_outside(corridor: Corridor, node: int, bodies: Sequence[GrownRegion | Disc]) -> tuple[int, float]:
    """Return the first place on the way to a visit that lies in no body: its leg, and its share of that; the way's begin where there is none.

    Args:
        corridor: The robot's.
        node: Where it sets out for the visit.
        bodies: Regions and rings.
    """
    shares = np.linspace(0.0, 1.0, _PARTS + 1)[:-1]
    for leg in range(node, len(corridor)):
        if corridor.legs[leg].visit != corridor.legs[node].visit or corridor.legs[leg].cylinder is not None:
            break
        places = corridor.points[leg] + shares[:, None] * (corridor.points[leg + 1] - corridor.points[leg])
        clear = np.ones(_PARTS, dtype=bool)
        for body in bodies:
            clear &= body.signed_distance(places) > 0.0
        if clear.any():
            return leg, float(shares[int(np.argmax(clear))])
    return node, 0.0


def with_ramps(corridor: Corridor, halts: Mapping[int, int], pieces: int) -> tuple[Corridor, dict[int, int]]:
    """Return the corridor with two points more on legs from rest to rest, and the points of halts: one polynomial takes twice the time.

    Args:
        corridor: The robot's; no lap.
        halts: For visits the point at which it rests.
        pieces: Legs that it may have; where they would be more, nothing is changed.
    """
    found, stops, rests = corridor, dict(halts), {0, len(corridor), *halts.values()}
    for leg in reversed(range(len(corridor))):
        length = float(np.linalg.norm(corridor.points[leg + 1] - corridor.points[leg]))
        if {leg, leg + 1} <= rests and corridor.legs[leg].cylinder is None and length * _RAMP > _CROWDED:
            found = _cut(_cut(found, leg, _RAMP), leg + 1, (1.0 - 2.0 * _RAMP) / (1.0 - _RAMP))
            stops = {visit: node + 2 * (node > leg) for visit, node in stops.items()}
    return (corridor, dict(halts)) if len(found) > pieces else (found, stops)


def _deepest(corridor: Corridor, region: Region, last: int) -> int:
    """Return the point that lies deepest in a region, of those of the visit that ends at or before a point."""
    levels = np.asarray(region.level(corridor.points[: last + 1]))
    inside = np.flatnonzero(levels <= 1.0)
    if not len(inside):
        return last
    begin = int(inside[-1])
    while begin > 0 and levels[begin - 1] <= 1.0:
        begin -= 1
    return begin + int(np.argmin(levels[begin : int(inside[-1]) + 1]))


def _cut(corridor: Corridor, leg: int, share: float) -> Corridor:
    """Return the corridor with one more point on a leg."""
    a, b, duration = corridor.points[leg], corridor.points[leg + 1], corridor.durations[leg]
    return replace(
        corridor,
        points=np.insert(corridor.points, leg + 1, a + share * (b - a), axis=0),
        durations=np.concatenate(
            [corridor.durations[:leg], [share * duration, (1.0 - share) * duration], corridor.durations[leg + 1 :]]
        ),
        legs=(*corridor.legs[: leg + 1], *corridor.legs[leg:]),
        needed=(*corridor.needed[: leg + 1], True, *corridor.needed[leg + 1 :]),
        rooms=(*corridor.rooms[: leg + 1], None, *corridor.rooms[leg + 1 :]),
        cycle=None if corridor.cycle is None else corridor.cycle + (corridor.cycle > leg),
    )


def thinned(corridor: Corridor, pieces: int, laps: int = 1) -> Corridor:
    """Return the corridor with points left out, where straight legs allow it, until at most so many legs are flown.

    A leg of the cycle is flown `laps` times and counts as many. The points that lose least length for each leg saved go
    first. What cannot be left out stays, so the result may be longer.

    Args:
        corridor: The robot's.
        pieces: Legs that are flown at most.
        laps: Times that the cycle is flown.
    """

    def repeats(node: int) -> int:
        return laps if corridor.cycle is not None and node > corridor.cycle else 1

    while sum(repeats(node) for node in range(1, len(corridor) + 1)) > pieces:
        options = [
            (_detour_length(corridor, node) / repeats(node), node)
            for node in range(1, len(corridor))
            if not corridor.needed[node] and node != corridor.cycle
        ]
        shorter = next((merged for _, node in sorted(options) if (merged := _without(corridor, node)) is not None), None)
        if shorter is None:
            return corridor
        corridor = shorter
    return corridor


def without_crowding(corridor: Corridor) -> Corridor:
    """Leave out points that are hardly apart from a neighbour: very short pieces lose their precision in float32."""
    node = 1
    while node < len(corridor):
        near = min(np.linalg.norm(corridor.points[node] - corridor.points[node + side]) for side in (-1, 1)) < _CROWDED
        merged = _without(corridor, node) if near and not corridor.needed[node] else None
        corridor, node = (corridor, node + 1) if merged is None else (merged, node)
    return corridor


def _detour_length(corridor: Corridor, node: int) -> float:
    a, b, c = corridor.points[node - 1 : node + 2]
    return float(np.linalg.norm(b - a) + np.linalg.norm(c - b) - np.linalg.norm(c - a))


def _without(corridor: Corridor, node: int) -> Corridor | None:
    """Return the corridor without one point, or None where the straight leg past it would break a rule."""
    before, after = corridor.legs[node - 1], corridor.legs[node]
    if (before.cylinder is None) != (after.cylinder is None):
        return None
    obstacles = (*before.obstacles, *(body for body in after.obstacles if all(body is not other for other in before.obstacles)))
    if blocking(corridor.points[node - 1], corridor.points[node + 1], obstacles) is not None:
        return None
    approaches = tuple(
        cylinder
        for cylinder in before.approaches
        if any(np.array_equal(cylinder.centre, other.centre) for other in after.approaches)
    )
    leg = Leg(obstacles, before.cylinder, before.visit if before.visit == after.visit else after.visit, approaches)
    cycle = corridor.cycle
    return replace(
        corridor,
        points=np.delete(corridor.points, node, axis=0),
        durations=np.concatenate(
            [
                corridor.durations[: node - 1],
                [corridor.durations[node - 1] + corridor.durations[node]],
                corridor.durations[node + 1 :],
            ]
        ),
        legs=(*corridor.legs[: node - 1], leg, *corridor.legs[node + 1 :]),
        cycle=None if cycle is None else cycle - (cycle > node),
        needed=(*corridor.needed[:node], *corridor.needed[node + 1 :]),
        rooms=(*corridor.rooms[:node], *corridor.rooms[node + 1 :]),
    )
