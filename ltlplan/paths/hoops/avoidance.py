"""AVOID: the way from one control point to the next past the hoops that stand between them (Algorithm 1, lines 8 to 12).

A hoop in the way is passed by its nearer avoid point, the other one where the first is not free; several in a row are passed
one after another. Where the straight line to an avoid point would itself cross the hoop's ring, as from a hoop's own front
to its own side, the way first goes out to the height of the avoid point, `reach` before or behind it.

All else that a leg may not enter is a body: past regions, in a world with obstacles, and where hoop by hoop leads nowhere, as between
two hoops that stand in each other's way, a shortest way through free space is taken (`ltlplan.free_space`).
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from ltlplan.free_space.bottlenecks import Gap, Shut, narrowest, narrowest_around
from ltlplan.free_space.staying_inside import narrowest_inside, way_inside, way_stays_inside
from ltlplan.paths.hoops.clearance import blocked
from ltlplan.paths.hoops.hoop_frame import control_points
from ltlplan.paths.hoops.keep_out import Room
from ltlplan.paths.hoops.stops import Stop
from ltlplan.systems.unreachable import joined_names, said_of_narrowest
from verify.data import Infeasible
from verify.data.arrays import Floats
from verify.data.mission import Mission
from verify.data.shapes.region import Hoop

_BESIDE = 0.05
"""m; a point of a way this near to one of its ends is left out where it can be."""
_STRIDE = 1.0
"""m between points on a way past regions, at most."""
_SAME = 1e-9
"""m; a point this near to an end is the end."""


class Blocked(Infeasible):
    """Both ways past a hoop are blocked.

    Attributes:
        region: The hoop or region in the way.
        shut: Whether no way leads around it without any margin either.
    """

    def __init__(
        self,
        region: str,
        start: Floats,
        end: Floats,
        reasons: list[str],
        around: tuple[Room, Collection[str]] | None = None,
        *,
        shut: bool = False,
    ) -> None:
        self.region, self.shut = region, shut
        self._ends, self._around = (start, end), around
        why = "; ".join(reasons) if reasons else "it is being passed already"
        super().__init__(f"'{region}' stands in the way from {_show(start)} to {_show(end)} and cannot be passed: {why}.")

    def explained(self) -> Blocked:
        """Return the error with where the widest way around is narrowest, where no way was found past regions."""
        if self._around is None:
            return self
        (where, permitted), (start, end) = self._around, self._ends
        match narrowest_around(where.space, start, end, permitted):
            case Gap() as gap if gap.width <= gap.needed + 2.0 * where.slack:
                why = said_of_narrowest(where.space.mission, gap)
                return Blocked(self.region, start, end, [why], shut=gap.width <= gap.needed - 2.0 * where.space.mission.margin)
            case Shut():
                why = "no way leads around it, however narrow"
                return Blocked(self.region, start, end, [why], shut=True)
            case _:
                return self


class NarrowRoom(Infeasible):
    """No way stays within regions that a leg may not leave, as deep as the margin asks.

    Attributes:
        helps: What would help, each as a noun; empty where that was not looked for.
    """

    def __init__(self, where: Room, leg: Leg, what: str = "", helps: tuple[str, ...] = ()) -> None:
        self._where, self._leg, self.helps = where, leg, helps
        deep = where.space.mission.margin + where.slack
        super().__init__(
            what or f"No way {leg.shown} was found that stays {deep:.3g} m within {leg.named}, as the margin asks."
        )

    def explained(self) -> NarrowRoom:
        """Return the error with where the regions are narrowest on the way, and what would help."""
        where, leg, margin = self._where, self._leg, self._where.space.mission.margin
        found = narrowest_inside(where.space, leg.within, leg.ends, leg.permitted, where.slack)
        if found is None:
            what = f"No way {leg.shown} lies within {leg.named}, however near to the border."
            return NarrowRoom(where, leg, what, (f"a larger {leg.named}, of parts that join each other",))
        point, deep = found
        what = f"{self} Around {_show(point)} no way is more than {deep:.3g} m within it."
        return NarrowRoom(
            where, leg, what, (f"{leg.named} wider than {2.0 * margin:.3g} m there", f"a `margin` below {deep:.3g} m")
        )


@dataclass(frozen=True, eq=False, slots=True)
class Leg:
    """One way that is looked for.

    Attributes:
        ends: m. Shape (3,) each.
        permitted: Regions that it may enter.
        within: Of these, regions that it may not leave.
    """

    ends: tuple[Floats, Floats]
    permitted: Collection[str]
    within: Sequence[str]

    @property
    def shown(self) -> str:
        """Start and end of the way, for a sentence."""
        return f"from {_show(self.ends[0])} to {_show(self.ends[1])}"

    @property
    def named(self) -> str:
        """Regions that it may not leave, for a sentence."""
        return " and ".join(f"'{name}'" for name in self.within)


def avoid(
    mission: Mission, where: Room, start: Floats, end: Floats, permitted: Collection[str] = (), within: Collection[str] = ()
) -> tuple[Stop, ...]:
    """Return the points to fly by between two points, none where the straight line is free.

    Args:
        mission: Gives the hoops' control points.
        where: Obstacles and walls, with the margin to keep.
        start: m. Shape (3,).
        end: m. Shape (3,).
        permitted: Regions that this leg may enter.
        within: Of these, regions that it may not leave.

    Raises:
        NarrowRoom: No way stays within a region that the leg may not leave.
        Blocked: Both avoid points of a hoop in the way are blocked, whatever other hoops are passed by first; the
            message says by what.
    """
    points = _past(mission, where, start, end, permitted)
    rooms = [name for name in within if points or len(mission.all_regions[name].measures.parts) > 1]
    way = np.stack([start, *(point.position for point in points), end])
    if all(way_stays_inside(mission.all_regions[name], way, mission.margin + where.slack) for name in rooms):
        return points
    inside = way_inside(where.space, rooms, (start, end), permitted, where.slack)
    if inside is None:
        raise NarrowRoom(where, Leg((start, end), permitted, rooms))
    return tuple(Stop(point, "via") for point in _divided(inside)[1:-1])


def _past(mission: Mission, where: Room, start: Floats, end: Floats, permitted: Collection[str]) -> tuple[Stop, ...]:
    """Return the points past all that a leg may not enter, wherever else they are."""
    if mission.obstacles:
        return _through(where, start, end, permitted)
    try:
        return _apart(where, start, end, permitted, _way(mission, where, start, end, permitted, frozenset()))
    except Blocked as error:
        if error.region not in mission.hoops:
            raise
        with suppress(Blocked):
            return _through(where, start, end, permitted)
        raise


def _apart(where: Room, start: Floats, end: Floats, permitted: Collection[str], points: tuple[Stop, ...]) -> tuple[Stop, ...]:
    """Return a way without points so near to its ends that a spline would turn back there, where it is free without them."""

    def needed(a: Floats, point: Floats, b: Floats, near: Floats) -> bool:
        distance = float(np.linalg.norm(point - near))
        return distance > _BESIDE or (distance > _SAME and blocked(a, b, where, permitted) is not None)

    kept = list(points)
    while kept and not needed(kept[-2].position if len(kept) > 1 else start, kept[-1].position, end, end):
        kept.pop()
    while kept and not needed(start, kept[0].position, kept[1].position if len(kept) > 1 else end, start):
        kept.pop(0)
    return tuple(kept)


def _through(where: Room, start: Floats, end: Floats, permitted: Collection[str]) -> tuple[Stop, ...]:
    """Return the points at which a shortest way through free space turns.

    Raises:
        Blocked: There is none.
    """
    space = where.space
    way = space.way(start, end, permitted, where.slack)
    if way is not None:
        points = way if space.mission.obstacles else _divided(way)
        return tuple(Stop(point, "via") for point in points[1:-1])
    for point in (start, end):
        if met := blocked(point, point, where, permitted):
            raise Blocked(met.name, start, end, [f"{_show(point)} itself is too near to it"])
    met = blocked(start, end, where, permitted)
    beside = f" and {space.clearance + where.slack:.3g} m beside obstacles" if space.mission.obstacles else ""
    why = f"no way around it leaves {space.mission.margin + where.slack:.3g} m beside regions{beside}"
    near = space.way(start, end, permitted) if space.mission.obstacles else None
    if near is not None and (gap := narrowest(space, near)).width < gap.needed + 2.0 * where.slack:
        sides = joined_names([f"'{name}'" for name in dict.fromkeys(gap.between)])
        why = (
            f"near {_show(np.array(gap.point))} it is {gap.width:.4f} m wide between {sides}, and {gap.needed + 2.0 * where.slack:.4f} m are "
            f"needed (radius, margin and {1000.0 * where.slack:g} mm on both sides)"
        )
        raise Blocked(met.name if met else "workspace", start, end, [why])
    raise Blocked(met.name if met else "workspace", start, end, [why], (where, permitted))


def _divided(way: Floats) -> Floats:
    """Return a way with points on its lines no farther apart than a stride, so that a spline does not swing there. Shape (points, 3)."""
    parts = [np.linspace(a, b, int(np.linalg.norm(b - a) / _STRIDE) + 1, endpoint=False) for a, b in itertools.pairwise(way)]
    return np.concatenate([*parts, way[-1:]])


def _way(
    mission: Mission, where: Room, start: Floats, end: Floats, permitted: Collection[str], passed: frozenset[str]
) -> tuple[Stop, ...]:
    hit = blocked(start, end, where, permitted)
    if hit is None:
        return ()
    if hit.name == "workspace" or hit.name in passed:
        raise Blocked(hit.name, start, end, ["the line leaves the workspace"] if hit.name == "workspace" else [])
    for point in (start, end):
        if met := blocked(point, point, where, permitted):
            hint = "; if it is a control point, set a larger `reach`" if met.name in mission.hoops else ""
            raise Blocked(
                met.name, start, end, [f"{_show(point)} itself is nearer to it than the vehicle's radius and the margin{hint}"]
            )
    if hit.name not in mission.hoops:
        return _through(where, start, end, permitted)
    reasons: list[str] = []
    for points in _candidates(mission.hoops[hit.name], hit.name, start, end):
        outside = [point for point in points if not where.inside(point.position)]
        inner = [blocked(a.position, b.position, where, permitted) for a, b in itertools.pairwise(points)]
        if outside:
            reasons.append(f"the point {_show(outside[0].position)} beside it is too near a wall or outside the workspace")
            continue
        if met := next((conflict for conflict in inner if conflict), None):
            own = (
                "it is too near the hoop's own ring; set a larger `clearance`"
                if met.name == hit.name
                else f"'{met.name}' is beside it"
            )
            reasons.append(f"at the point {_show(points[0].position)}, {own}")
            continue
        try:
            before = _way(mission, where, start, points[0].position, permitted, passed | {hit.name})
            after = _way(mission, where, points[-1].position, end, permitted, passed | {hit.name})
        except Blocked as error:
            if error.region != hit.name:
                reasons.append(f"'{error.region}' blocks the way by {_show(points[0].position)}")
            continue
        return (*before, *points, *after)
    raise Blocked(hit.name, start, end, list(dict.fromkeys(reasons)))


def _candidates(hoop: Hoop, name: str, start: Floats, end: Floats) -> Iterator[tuple[Stop, ...]]:
    """Yield ways past one hoop: the nearer side first, and for each side the shortest way first."""
    points = control_points(hoop)
    ahead = float(hoop.reach or 0.0) * points.frame[:, 0]
    # distances are rounded, so that moving the world decides no tie
    for side in sorted(points.avoid, key=lambda point: [round(float(np.linalg.norm(point - at)), 6) for at in (start, end)]):
        main = Stop(side, "avoid", name)
        near, far = (ahead if (start - side) @ ahead >= 0 else -ahead), (ahead if (end - side) @ ahead >= 0 else -ahead)
        first, last = Stop(side + near, "via", name), Stop(side + far, "via", name)
        yield (main,)
        yield (first, main)
        yield (main, last)
        yield (first, main, last)


def _show(point: Floats) -> str:
    return "(" + ", ".join(f"{x:.2f}" for x in point) + ")"
