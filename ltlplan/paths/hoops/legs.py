"""One robot's way, leg by leg: stops at control points, and what each segment between them may enter.

A leg leads from where one visit ends to where the next begins, straight or past the avoid points of what stands in its way;
a passage leads through a hoop; the last leg closes a lasso or goes to the end waypoint.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ltlplan.allocation import Itinerary
from ltlplan.paths.hoops.avoidance import Blocked, avoid
from ltlplan.paths.hoops.clearance import blocked
from ltlplan.paths.hoops.hoop_frame import control_points
from ltlplan.paths.hoops.keep_out import Room
from ltlplan.paths.hoops.passage_ends import PassageEnds, passage_ends
from ltlplan.paths.hoops.stops import Side, Stop, before_opening, holds, hoop_axes, primitives_between
from ltlplan.search.memoization import memoized
from ltlplan.systems.region_labels import apart
from ltlplan.systems.touching_points import Lap, is_large, routes_may_touch, touching_route
from verify.data import BadInput, Mission
from verify.data.arrays import Floats
from verify.data.plan import Role
from verify.data.shapes.region import Hoop

_AROUND = sorted(
    (np.array(way, dtype=np.float64) / np.linalg.norm(way) for way in itertools.product((-1, 0, 1), repeat=3) if any(way)),
    key=lambda way: (int(np.count_nonzero(way)), way[2] != 0, *(-way)),
)
"""Unit vectors along the axes, then between them: to which side a region is left that is visited again."""
_SAME = 1e-9
"""m; points as near as this are one."""


class Legs:
    """The stops of one robot's way, leg by leg."""

    def __init__(self, mission: Mission, robot: str, does: Itinerary, where: Room, inside_last: bool) -> None:
        self.mission, self.where, self.inside_last, self.numbers = mission, where, inside_last, does.all_stops
        self.visits, self.cycle_visit = tuple(does.visits[stop] for stop in self.numbers), does.first_of_lap
        agent, visits = mission.agents[robot], self.visits
        self.start = np.array(agent.start)
        self.end = None if agent.end is None else np.array(agent.end)
        self.begins_inside = bool(visits) and holds(mission, self.start, visits[0].region)
        first, last = self.cycle_visit, len(visits) - 1
        self.laps_begin_inside = (
            first is not None
            and first <= last
            and first > self.begins_inside
            and visits[first - 1].region == visits[last].region != visits[last - 1].region
            and visits[last].region not in mission.hoops
            and self.numbers[last] == len(does.visits) - 1
            and visits[last].region in does.word.letters[-1]
        )
        """Whether each lap begins and ends at one place of a region, that of the last visit before the first lap and of a lap's own last one."""

    @memoized
    def ends(self, name: str) -> PassageEnds:
        """Return where passages through a hoop begin and end, and the way to it and from it.

        Args:
            name: The hoop's.
        """
        return passage_ends(self.mission.hoops[name], self.where, name)

    def length(self, i: int, left: Side, j: int, entered: Side) -> float:
        """Return the length of the leg from one visit to the next by its primitives, m.

        Args:
            i: Index of the visit that is left.
            left: The side from which it was entered, so that it is left on the other.
            j: Index of the visit that is flown to.
            entered: The side from which that one is entered.
        """
        first, exit_from = self._exit(i, left)
        stops = [*([] if exit_from is None else [exit_from]), first, *self._leg(i, left, j, entered)]
        return sum(p.length for p in primitives_between(stops)[0 if exit_from is None else 1 :])

    def stops(self, sides: Sequence[Side]) -> tuple[list[Stop], int | None]:
        """Return all stops and the index of the stop where the cycle begins, if there is one."""
        cycle_visit = self.cycle_visit
        stops = [Stop(self.start, "start", visit=0 if self.begins_inside else None)]
        cycle: int | None = None
        for i, side in enumerate(sides):
            if i == 0 and self.begins_inside:
                continue
            stops += self._leg(i - 1, sides[i - 1] if i else None, i, side)
            if i == cycle_visit and not self.laps_begin_inside:
                # at the hoop's entry, or at the last point outside a region without a ring
                cycle = len(stops) - 1 if side is not None else len(stops) - 2
            stops += self._passage(i, side)
            if i + 1 == cycle_visit and self.laps_begin_inside:
                cycle = len(stops) - 1
        last = len(sides) - 1
        comes_to_rest = cycle_visit is None or cycle_visit == len(sides)
        if cycle is not None and not self.laps_begin_inside:
            first = stops[cycle]
            around = frozenset[str]() if first.region is None else self._around(first.region, first.position)
            stops += self._on_to(last, sides[last], replace(first, permitted=around))
        elif self.end is not None and cycle_visit is None:
            stops += self._to_end(last, sides[last] if sides else None)
        elif comes_to_rest and sides and sides[last] is None and not self.inside_last:
            ahead = stops[-1].position - stops[-2].position if len(stops) > 1 else np.zeros(3)
            stops.append(self._outside(self._exit(last, None)[0], self.visits[last].region, last, ahead))
        return stops, cycle

    def _exit(self, i: int, side: Side) -> tuple[Stop, Stop | None]:
        """Return where visit i is left, and the point before that."""
        if i < 0:
            return Stop(self.start, "start"), None
        name = self.visits[i].region
        if i == 0 and self.begins_inside:
            return Stop(self.start, "start", name, i), None
        if side is None:  # of a hoop in which the flight ends its end waypoint: nothing else leads on from there
            inside = self._places[i]
            return Stop(inside if self.end is None or name not in self.mission.hoops else self.end, "centre", name, i), None
        ends = self.ends(name)
        inner, points = ends.inner(side)[1], ends.points
        before = Stop(points.centre, "centre", name, i) if inner is None else Stop(inner, "front", name, i)
        return Stop(ends.outer(side)[1], "front", name, i, axes=points.frame), before

    @memoized
    def _leg(self, i: int, left: Side, j: int, entered: Side) -> list[Stop]:
        """Return the stops after visit i up to the first stop of visit j (its entry, or its centre)."""
        name, origin = self.visits[j].region, self._exit(i, left)[0]
        if entered is not None:
            entry, led = self.ends(name).outer(entered)[0], self.ends(name).inner(entered)[0] is not None
            role: Role = "via" if led else "rear" if entered == "F" else "front"
            around = self._around(name, entry)
            return self._on_to(i, left, Stop(entry, role, name, None if led else j, around, hoop_axes(self.mission, name)))
        if name in self.mission.hoops:
            return self._into(i, left, j)
        centre = self._places[j]
        target = Stop(centre, "centre", name, j, self.where.holding(centre))
        if i >= 0 and self.visits[i].region == name and self.numbers[i] != self.numbers[j]:
            return [self._outside(origin, name, j, np.zeros(3)), target]
        return self._with_gate(origin.position, self._way(i, left, target))

    @cached_property
    def _places(self) -> list[Floats]:
        """Place of each visit: its region's middle, or where the whole route touches a large region. Shape (3,) each."""
        names = [visit.region for visit in self.visits]
        middles = [np.array(self.mission.all_regions[name].center) for name in names]
        if not routes_may_touch(self.mission):
            return middles
        places: list[Floats | str] = [
            name if self._touches(names, k) else middle for k, (name, middle) in enumerate(zip(names, middles, strict=True))
        ]
        ends = [] if self.end is None else [self.end]
        lap = None if self._lap_of is None else Lap(self._lap_of + 1, self.mission.spec.repeat)
        if self.laps_begin_inside:
            del places[-1]
        found = list(touching_route(self.mission, [self.start, *places, *ends], self._turns, lap)[1 : len(places) + 1])
        return found if lap is None or not self.laps_begin_inside else [*found, found[lap.begins - 1]]

    @property
    def _lap_of(self) -> int | None:
        """Index of the visit at which laps come round; None where there are none."""
        return (self.cycle_visit or 0) - 1 if self.laps_begin_inside else self.closes_at

    @property
    def closes_at(self) -> int | None:
        """Index of the visit to which laps lead back; None where there are none, or each is a hover or ends in its last visit."""
        return None if self.cycle_visit == len(self.visits) or self.laps_begin_inside else self.cycle_visit

    def _turns(self, number: int, start: Floats, end: Floats) -> list[Floats]:
        """Return the points at which a leg turns on its way around what it may not enter; none of legs from and to hoops.

        Args:
            number: Index of the visit that it leads to, or of the way to the end or back to the lap's first visit.
            start: m. Shape (3,).
            end: m. Shape (3,).
        """
        to = self.closes_at if number == len(self.visits) else number
        ends = [*self.visits[max(number - 1, 0) : number], *(() if to is None else self.visits[to : to + 1])]
        if any(visit.region in self.mission.hoops for visit in ends):
            return []
        leaves, reaches = self.where.touching(start) if number == 0 else self.where.holding(start), self.where.holding(end)
        points = avoid(self.mission, self.where, start, end, leaves | reaches, leaves & reaches)
        return [point.position for point in points]

    def _touches(self, names: Sequence[str], k: int) -> bool:
        """Tell whether a visit may be made anywhere in its region: it is large, begun on the way, and not left to be visited again at once."""
        if k == 0 and self.begins_inside:
            return False
        beside = [*names[max(k - 1, 0) : k], *names[k + 1 : k + 2]]
        if self.closes_at is not None and k in (self.closes_at, len(names) - 1):
            beside += [names[-1] if k == self.closes_at else names[self.closes_at]]
        return names[k] not in beside and is_large(self.mission, names[k])

    def _into(self, i: int, left: Side, j: int) -> list[Stop]:
        """Return the leg to a hoop in which the flight ends: to the control point on its nearer side, or on the other one, then
        straight on to a place in front of the opening.

        Raises:
            Blocked: Neither side can be reached.
            Infeasible: No place in the hoop is clear of its opening.
        """
        name, origin = self.visits[j].region, self._exit(i, left)[0].position
        hoop = self.mission.hoops[name]
        points = control_points(hoop)
        ends: list[tuple[Role, Floats]] = [("rear", points.rear), ("front", points.front)]
        if self.end is not None:
            ends = ends[1:] if (self.end - points.centre) @ np.array(hoop.normal) >= 0.0 else ends[:1]
        problem: Blocked | None = None
        for role, position in sorted(ends, key=lambda end: float(np.linalg.norm(end[1] - origin))):
            place = before_opening(self.mission, name, hoop, role) if self.end is None else self.end
            beside = Stop(position, role, name, j, self._around(name, position), points.frame)
            rest = Stop(place, "centre", name, j, self.where.holding(place), points.frame)
            try:
                return [*self._on_to(i, left, beside), rest]
            except Blocked as error:
                problem = problem or error
        assert problem is not None
        raise problem

    def _outside(self, origin: Stop, name: str, visit: int, ahead: Floats) -> Stop:
        """Return a point just outside a region that is left for good, or visited again at once: the nearest one, from its middle straight ahead, that is clear.

        Raises:
            Blocked: There is no clear point around it.
        """
        obstacle, permitted = self.where.regions[name], self.where.holding(origin.position) | {name}
        beside = origin.position - obstacle.centre
        first = beside if float(np.linalg.norm(beside)) > _SAME else ahead
        far = float(np.linalg.norm(first))
        ways = [first / far, *sorted(_AROUND, key=lambda way: -round(float(way @ first) / far, 6))] if far > _SAME else _AROUND
        for way in ways:
            point = obstacle.centre + way * obstacle.exit(way, obstacle.level * 1.3)
            if self.where.inside(point) and not any(
                blocked(place, point, self.where, permitted) for place in (origin.position, obstacle.centre)
            ):
                return Stop(point, "via", name, visit, permitted)
        raise Blocked(
            name, origin.position, obstacle.centre, ["no point around it is clear, so it cannot be left and visited again"]
        )

    def _with_gate(self, origin: Floats, leg: list[Stop]) -> list[Stop]:
        """Put a point before a region's centre, clear of the region, on the last straight piece: a lap begins there."""
        target, regions = leg[-1], self.mission.all_regions
        before, entered = leg[-2].position if len(leg) > 1 else origin, str(target.region)
        obstacle = self.where.regions[entered]
        line = before - target.position
        if obstacle.measures is None and np.array_equal(target.position, obstacle.centre):
            level = float(line @ obstacle.matrix @ line)
            share = None if level <= obstacle.level * 1.2 else min(1.0, (obstacle.level * 1.1 / level) ** 0.5)
        else:
            share = obstacle.gate(target.position, line, obstacle.level * 1.1)
        if share is None:
            return leg
        gate = target.position + line * share
        kept = target.permitted & self.where.holding(gate)
        shared = {name for name in kept if not apart(regions[name], regions[entered])}
        return [
            *leg[:-1],
            Stop(gate, "via", entered, target.visit, target.permitted - {entered}),
            replace(target, permitted=self.where.holding(target.position) | shared),
        ]

    def _around(self, name: str, point: Floats) -> frozenset[str]:
        """Return the other regions that hold a point beside a region, and its centre: those that it stands in."""
        return (self.where.holding(point) & self.where.holding(self.where.regions[name].centre)) - {name}

    def _on_to(self, i: int, left: Side, target: Stop) -> list[Stop]:
        """Return detours and target; nothing where the robot is there already, as where it turns about."""
        return [] if np.allclose(self._exit(i, left)[0].position, target.position, atol=1e-9) else self._way(i, left, target)

    def _way(self, i: int, left: Side, target: Stop) -> list[Stop]:
        """Return detours and target; first and last segment may also be in the regions that they leave and reach."""
        origin = self._exit(i, left)[0]
        if i >= 0 and left is None and (hoop := self.mission.hoops.get(self.visits[i].region)) is not None:
            return self._out_of(i, hoop, origin, target)
        leaves, reaches = self._left(i, left, origin.position), target.permitted
        points = avoid(self.mission, self.where, origin.position, target.position, leaves | reaches, leaves & reaches)
        way, last = self._detours(points, leaves)
        return self._entering(origin, [*way, replace(target, permitted=reaches | last)], reaches)

    def _out_of(self, i: int, hoop: Hoop, origin: Stop, target: Stop) -> list[Stop]:
        """Return the stops from a start in a hoop's region to a target: to the hoop's control point on that side first."""
        name, points = self.visits[i].region, control_points(hoop)
        ahead = (origin.position - points.centre) @ np.array(hoop.normal) >= 0.0
        through = self.where.holding(origin.position) | {name}
        first = Stop(self.ends(name).outer("F")[1 if ahead else 0], "via", name, i, through, points.frame)
        if np.allclose(first.position, target.position, atol=1e-9):
            return [replace(target, permitted=through)]
        leaves = self._around(name, first.position)
        others = avoid(self.mission, self.where, first.position, target.position, target.permitted | leaves)
        way, last = self._detours(others, leaves)
        return [first, *way, replace(target, permitted=target.permitted | last)]

    def _entering(self, origin: Stop, way: list[Stop], reaches: frozenset[str]) -> list[Stop]:
        """Permit the regions around a target where a way turns in them, as in a room with a corner."""
        if not self.mission.obstacles or len(way) == 1:
            met = [*(self.where.touching(stop.position) for stop in way[:-1]), frozenset[str]()]
        else:
            met = self.where.space.entered(np.stack([origin.position, *(stop.position for stop in way)]), self.where.slack)
        return [replace(stop, permitted=stop.permitted | (here & reaches)) for stop, here in zip(way, met, strict=True)]

    def _detours(self, points: Sequence[Stop], leaves: frozenset[str]) -> tuple[list[Stop], frozenset[str]]:
        """Return the stops of a detour, and which regions the leg's last segment may still be in: those not left by then."""
        way: list[Stop] = []
        for point in points:
            way.append(replace(point, permitted=leaves, axes=hoop_axes(self.mission, point.region)))
            # around a body in a region the way is still in that region
            leaves = leaves & self.where.touching(point.position)
        return way, leaves

    def _left(self, i: int, side: Side, place: Floats) -> frozenset[str]:
        """Return the regions that a leg from a visit, or from the start, begins in."""
        if i < 0:
            return self.where.touching(place)
        name = self.visits[i].region
        return self.where.holding(place) | {name} if side is None else self._around(name, place)

    def _passage(self, i: int, side: Side) -> list[Stop]:
        """Return the stops of a passage; of a region that is not flown through there are none."""
        if side is None:
            return []
        name = self.visits[i].region
        ends = self.ends(name)
        points, (first, last) = ends.points, ends.inner(side)
        through = self.where.holding(points.centre)
        enters: Role = "rear" if side == "F" else "front"
        leaves: Role = "front" if side == "F" else "rear"
        return [
            *([] if first is None else [Stop(first, enters, name, i, through, points.frame)]),
            Stop(points.centre, "centre", name, i, through, points.frame),
            Stop(points.ends(side)[1], leaves, name, i, through, points.frame),
            *([] if last is None else [Stop(ends.outer(side)[1], "via", name, None, through, points.frame)]),
        ]

    def _to_end(self, i: int, left: Side) -> list[Stop]:
        assert self.end is not None
        region = self.visits[i].region if i >= 0 and left is None else None
        stays = frozenset() if region is None else frozenset({region})
        if self.inside_last:
            return [] if np.allclose(self._exit(i, left)[0].position, self.end) else [Stop(self.end, "end", region, i, stays)]
        for name in sorted(self.where.touching(self.end) - stays):
            at = ", ".join(f"{x:g}" for x in self.end)
            last = i >= 0 and self.visits[i].region == name
            why = "a hoop that is flown through, and so left again" if last else "which is not the region visited last"
            raise BadInput(f"The end waypoint ({at}) lies in or at '{name}', {why}.")
        return self._on_to(i, left, Stop(self.end, "end"))
