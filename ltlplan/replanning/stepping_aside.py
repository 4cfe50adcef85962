"""Robots that step aside: to a place off the others' ways, where no flight of the planned words was found.

Planning has robots rest in middles of regions alone. So one that ends, or hovers, where another one has to pass is led on to a place off all other
ways, once its visits are made: in free flight, or in a region in which it ends. One that has to let another one through first flies by such a place. One that flies from place to place within a region which the formula
lets it leave is led around outside of it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ltlplan.free_space.free_space import Place
from ltlplan.paths.costs import cost_of, plan_cost, team_cost
from ltlplan.replanning.cuts import STEPS_ASIDE
from ltlplan.search.orders.planned_words import hold_under_precedences
from ltlplan.systems.region_labels import Layout
from ltlplan.systems.routes import Routes
from verify.data import Letter, Plan, RobotPlan, Word
from verify.data.arrays import Floats
from verify.data.plan import Visit, Waypoint
from verify.data.validation.spacing import spacing_of

_GRID = 0.2
"""m between places that are looked at."""
_LOOKED_AT = 12
"""Places in the same regions, the nearest ones first, to which a way is looked for."""
_ASIDE = 0.2
"""m beyond what robots keep that a place lies off the straight ways of others: smooth ones leave these."""
_BACK = (0.75, 0.5, 0.9)
"""Shares of a leg at which a robot comes back into a region that it has left."""
_STEP = 0.05
"""m between samples of ways."""


def aside(plan: Plan, pair: Sequence[str]) -> Iterator[Plan]:
    """Yield plans in which one of two robots steps aside for the other one: after its visits, or on its way within a region.

    Args:
        plan: Of a finite trace, without waits, whose words no flight was found for.
        pair: The two.
    """
    robots = [(_Robot(plan, name), other) for name, other in itertools.permutations(pair, 2)]
    on = ((robot, other, changed) for robot, other in robots for changed in robot.led_on(other))
    by = ((robot, other, changed) for robot, other in robots for changed in robot.led_by(other))
    around = ((robot, other, changed) for robot, other in robots for changed in robot.led_around())
    for robot, other, changed in itertools.chain(on, by, around):
        known = {at.position for at in robot.own.waypoints}
        place = next((at.position for at in changed.waypoints if at.position not in known), None)
        if place is not None and hold_under_precedences(made := _with(plan, robot.name, changed)):
            yield made.noting(f"{robot.name} flies by ({', '.join(f'{x:.2f}' for x in place)}), {STEPS_ASIDE} {other}.")


def _starts_in_the_way(plan: Plan, name: str, other: str) -> bool:
    """Return whether the other robot starts in the way of one that is to fly first."""
    kept = spacing_of(plan.mission)
    start = np.array(plan.robots[other].waypoints[0].position)
    return bool(_apart(start[None], _way(plan.robots[name]), kept.z_scale).min() < kept.distance)


@dataclass(frozen=True, eq=False)
class _Robot:
    """One robot of a plan, and where it can step aside.

    Attributes:
        plan: The team's.
        name: The robot's.
    """

    plan: Plan
    name: str

    @cached_property
    def own(self) -> RobotPlan:
        """Its plan."""
        return self.plan.robots[self.name]

    @cached_property
    def _layout(self) -> Layout:
        return Layout(self.plan.mission)

    @cached_property
    def _routes(self) -> Routes:
        mission = self.plan.mission
        return Routes(mission, mission.vehicle_of(self.name).radius, mission.regions)

    def led_on(self, other: str) -> Iterator[RobotPlan]:
        """Yield its plan with a way on to a place aside, in the regions in which it ends or out of them; nothing where it ends off the other's way, or where it has to."""
        mission, kept, last = self.plan.mission, spacing_of(self.plan.mission), np.array(self.own.waypoints[-1].position)
        near = _apart(last[None], _way(self.plan.robots[other]), kept.z_scale).min() < kept.at_rest
        if not near or mission.agents[self.name].end is not None or _starts_in_the_way(self.plan, self.name, other):
            return
        shown, seen = self.own.word.letters[-1], set[tuple[Letter, ...]]()
        for place in self._places(last, last, nearer=True):
            found = self._leg(last, place)
            if found is not None and found[1] not in seen and found[1][0] == shown & mission.all_regions.keys():
                seen.add(found[1])
                more = [letter | (shown - mission.all_regions.keys()) for letter in found[1][1:]]
                letters = [*self.own.word.letters, *(more if len(set(found[1])) > 1 else ())]
                yield self._flying([*self.own.waypoints, *_vias(found[0][1:])], letters, self.own.visits)

    def led_by(self, other: str) -> Iterator[RobotPlan]:
        """Yield its plan with a place aside, where it lets another robot through, on a leg that comes near that one's way; the word stays the same.

        It comes to the place while the other one is at its start, and flies on from there while that one is at its end.
        """
        kept, away = spacing_of(self.plan.mission), _way(self.plan.robots[other])
        for here, there in self._legs:
            start, end = (np.array(self.own.waypoints[k].position) for k in (here, there))
            direct = self._leg(start, end)
            if direct is None or _apart(away, _dense(direct[0]), kept.z_scale).min() >= kept.distance:
                continue
            for place in self._places(start, start):
                out, on = self._leg(start, place), self._leg(place, end)
                if out is None or on is None or (*out[1][:-1], *on[1]) != direct[1]:
                    continue
                rests = ((away[:1], out[0]), (away[-1:], on[0]))
                if all(_apart(at, _dense(way), kept.z_scale).min() >= kept.distance for at, way in rests):
                    points = [*_vias(out[0][1:]), *_vias(on[0][1:-1])]
                    after = [*self.own.waypoints[: here + 1], *points, *self.own.waypoints[there:]]
                    yield self._flying(after, self.own.word.letters, self.own.visits)
                    break

    @property
    def _legs(self) -> list[tuple[int, int]]:
        """The waypoints, by index, between which it flies from stop to stop."""
        return [*itertools.pairwise(k for k, at in enumerate(self.own.waypoints) if at.role in ("start", "centre", "end"))]

    def led_around(self) -> Iterator[RobotPlan]:
        """Yield its plan with a leg within a region led around outside of it, once for each such leg."""
        for here, there in self._legs:
            found = self._around(here, there)
            if found is not None:
                yield found

    def _around(self, here: int, there: int) -> RobotPlan | None:
        """Return its plan with a leg that leaves the one region around both of its ends, and comes back into it; None where no such way is found."""
        points, regions, shown = self.own.waypoints, frozenset(self.plan.mission.all_regions), self.own.word.letters
        start, end = (np.array(points[k].position) for k in (here, there))
        stop = points[here].visit
        first = len(shown[0] & regions) if stop is None or here == 0 else stop + 1
        at = _reached(shown, regions, first)
        if at is None:
            return None
        for share, place in itertools.product(_BACK, self._places(start, end)):
            back = start + share * (end - start)
            out, again = self._leg(start, place), self._leg(place, back)
            if out is None or again is None or [shown[at] & regions, again[1][0]] != [out[1][0], out[1][-1]]:
                continue
            if len(out[1]) != 2 or again[1][::-1] != out[1]:
                continue
            (region,) = out[1][0] - out[1][1]
            letters = [
                *shown[: at + 1],
                *(each | shown[at] - regions for each in (*out[1][1:], *again[1][1:])),
                *shown[at + 1 :],
            ]
            visits = [*self.own.visits[:first], Visit(region=region), *self.own.visits[first:]]
            middle = Waypoint(position=_point(back), role="centre", region=region, visit=first)
            later = [
                each if each.visit is None else each.model_copy(update={"visit": each.visit + 1}) for each in points[there:]
            ]
            return self._flying(
                [*points[: here + 1], *_vias(out[0][1:]), *_vias(again[0][1:-1]), middle, *later], letters, visits
            )
        return None

    def _places(self, start: Floats, end: Floats, *, nearer: bool = False) -> Iterator[Floats]:
        """Yield places aside in no regions but those around both ends, by which the straight ways are shortest first.

        Where none in some regions is far enough off others' ways, `nearer` takes the farthest one: these may bend.
        """
        from refine.corridor.legs import CLEARANCE, bodies_of

        mission, kept = self.plan.mission, spacing_of(self.plan.mission)
        grow = mission.margin + CLEARANCE
        low, high = np.array(mission.workspace.min) + grow, np.array(mission.workspace.max) - grow
        axes = [np.linspace(low[k], high[k], max(1, int((high[k] - low[k]) / _GRID) + 1)) for k in range(2)]
        grid = np.stack(np.meshgrid(*axes, [start[2]], indexing="ij"), axis=-1).reshape(-1, 3)
        bodies, free = bodies_of(mission, self.name, CLEARANCE), np.ones(len(grid), dtype=bool)
        around = {*self._layout.at(_point(start)).inside} & {*self._layout.at(_point(end)).inside}
        closed = (body for name, body in bodies.regions.items() if name not in around)
        for body in (*closed, *bodies.rings.values(), *bodies.solids):
            free &= body.signed_distance(grid) > 0.0
        ways = [_apart(grid, _way(robot), kept.z_scale) for other, robot in self.plan.robots.items() if other != self.name]
        off = np.where(free, np.min(ways, axis=0), 0.0)
        lengths = np.linalg.norm(grid - start, axis=1) + np.linalg.norm(grid - end, axis=1)
        held = self._layout.regions_at(grid)
        for regions in dict.fromkeys(held[k] for k in np.argsort(lengths.round(6), kind="stable") if free[k]):
            these = np.flatnonzero([free[k] and held[k] == regions for k in range(len(grid))])
            far = these[off[these] >= kept.distance + _ASIDE]
            yield from grid[far[np.argsort(lengths[far].round(6), kind="stable")[:_LOOKED_AT]]]
            if nearer and not len(far) and off[these].max() > kept.distance / 2.0:
                yield grid[these[np.argmax(off[these].round(6))]]

    def _leg(self, start: Floats, end: Floats) -> tuple[Floats, tuple[Letter, ...]] | None:
        """Return a way, and the regions in which it is; None where there is none, or that is not clear."""
        one, other = (self._layout.at(_point(point)) for point in (start, end))
        way = self._routes.way(*(Place(at.point, frozenset(at.inside)) for at in (one, other)))
        letters = None if way is None else self._layout.along(one, way, other)
        return None if way is None or letters is None else (way, letters)

    def _flying(self, points: Sequence[Waypoint], letters: Sequence[Letter], visits: Sequence[Visit]) -> RobotPlan:
        """Return its plan by other points, at the nominal speed."""
        places, speed = np.array([each.position for each in points]), self.plan.mission.seen_by(self.name).planner.speed
        times = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))]) / speed
        changed = self.own.model_copy(
            update={
                "waypoints": tuple(points),
                "times": tuple(times.tolist()),
                "word": Word(tuple(letters)),
                "visits": tuple(visits),
            }
        )
        return changed.model_copy(update={"cost": plan_cost(changed, cost_of(self.plan.mission, self.name))})


def _with(plan: Plan, name: str, robot: RobotPlan) -> Plan:
    robots = {**plan.robots, name: robot}
    cost = team_cost(plan.mission, [each.cost for each in robots.values()])
    return plan.model_copy(update={"robots": robots, "cost": cost, "complete": False})


def _reached(letters: Sequence[Letter], regions: frozenset[str], visits: int) -> int | None:
    """Return the index of the last letter before so many visits and one more are begun; None where there are no more."""
    entered, before = 0, frozenset[str]()
    for index, letter in enumerate(letters):
        entered += len((letter & regions) - before)
        before = letter & regions
        if entered > visits:
            return index - 1
    return None


def _vias(points: Floats) -> list[Waypoint]:
    return [Waypoint(position=_point(point), role="via") for point in points]


def _point(at: Floats) -> tuple[float, float, float]:
    x, y, z = at.tolist()
    return (x, y, z)


def _way(robot: RobotPlan) -> Floats:
    """Return points on a robot's straight legs. Shape (n, 3)."""
    return _dense(np.array([each.position for each in robot.waypoints], dtype=float))


def _dense(points: Floats) -> Floats:
    lines = [
        a + np.linspace(0.0, 1.0, int(np.linalg.norm(b - a) / _STEP) + 2)[:, None] * (b - a)
        for a, b in itertools.pairwise(points)
    ]
    return np.concatenate([*lines, points[-1:]])


def _apart(places: Floats, way: Floats, z_scale: float) -> Floats:
    """Return how far places are from a way, as it counts, m. Shape (n, 3) to (n,)."""
    scale = np.array([1.0, 1.0, z_scale])
    return np.linalg.norm((places[:, None] - way[None]) * scale, axis=2).min(axis=1)
