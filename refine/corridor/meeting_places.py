"""Places beside each other for robots that visit one region, or end in it, so that they may be in it together."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from refine.corridor.outside import ASIDE, comes_after, flown_over, left_last, moved_outside, part_outside
from refine.corridor.packing import packed
from refine.corridor.place_exchange import Visits, exchange, without_gates
from refine.corridor.relocation import movable, moved_within, places_of
from refine.obstacles.keep_out_bodies import Ball, keep_out
from verify.data import Infeasible, Mission, Plan, RobotPlan, Waypoint, Witness

Floats = NDArray[np.float64]

_WIDER = (0.25, 0.1, 0.0)
"""m beyond what robots keep that places to meet at lie apart, where there is so much room: others fly between."""
_How = Literal["as planned", "near", "middle", "apart", "packed"]
"""At the planned points or near them, from the middle outwards, as far out as can be, or by trying."""
_HOW: tuple[_How, ...] = ("middle", "apart", "packed")
_ATTEMPTS: tuple[tuple[float, _How], ...] = (
    *itertools.product(_WIDER, ("middle", "apart")),
    *itertools.product(_WIDER, ("packed",)),
)
"""Places found by trying lie as the search met them: robots cross each other on their ways there more often."""
_NEAREST: tuple[tuple[float, _How], ...] = (
    (_WIDER[1], "as planned"),
    *((wider, "near") for wider in (2.0 * _WIDER[0], *_WIDER)),
    *_ATTEMPTS,
)
"""Places where ways are to be short."""
_AROUND = 1.0
"""m beyond a region's double size in which others' ways are looked at."""


def moved_apart(plan: Plan, distance: float, z_scale: float) -> Plan:
    """Return the plan with points of visits moved that lie too near another robot's last hover.

    A robot that never leaves its start is there for every visit; one that ends its flight is there when another one ends its
    own. Robots that do not move have the first say, then flights whose last point may not be moved, then those that end just outside a
    region that they have left; the others follow in the plan's order, and where that leaves one without a place, those who end in
    its region take places beside each other. What cannot be moved stays.

    Args:
        plan: A finite one, or one robot's.
        distance: m that robots keep.
        z_scale: Distances in z count this many times.

    Raises:
        Infeasible: More robots are to end in a region than it was found to have places for.
    """
    moved, stuck = _moved_apart(plan, distance, z_scale)
    for region in stuck:
        last = {
            name: len(robot.waypoints) - 1
            for name, robot in moved.robots.items()
            if robot.ends_in == region and movable(plan.mission, name, robot, robot.waypoints[-1])
        }
        hovering = {name: [np.array(robot.waypoints[-1].position)] for name, robot in moved.robots.items() if robot.still}
        places = _own_places(moved, region, last, (distance, z_scale), how="packed", nearby=hovering)
        if places is None:
            _refuse_what_is_too_small(moved, region, last, (distance, z_scale))
            continue
        robots = {name: _ending_at(robot, places.get(name)) for name, robot in moved.robots.items()}
        moved = _moved_apart(moved.model_copy(update={"robots": robots}), distance, z_scale)[0]
    return moved


def _ending_at(robot: RobotPlan, place: tuple[float, ...] | None) -> RobotPlan:
    if place is None:
        return robot
    last = robot.waypoints[-1].model_copy(update={"position": place})
    return robot.model_copy(update={"waypoints": (*robot.waypoints[:-1], last)})


def _moved_apart(plan: Plan, distance: float, z_scale: float) -> tuple[Plan, list[str]]:
    """Return the plan with robots that follow moved, and the regions in which that left one at another's last hover."""
    mission, robots, stuck = plan.mission, dict(plan.robots), list[str]()
    still = [name for name, robot in robots.items() if robot.still]
    firm = [name for name, robot in robots.items() if not movable(mission, name, robot, robot.waypoints[-1])]
    ends: dict[str, Ball] = {}
    later = {name: {other for other, _ in comes_after(plan, name, len(robot.visits) - 1)} for name, robot in robots.items()}
    firm.sort(key=lambda name: (left_last(mission, robots[name]) is not None, len(later[name])))
    for name in dict.fromkeys((*still, *firm, *robots)):
        robot = robots[name]
        hovering = tuple(ends[other] for other in ends if other in still)
        waypoints = list(robot.waypoints)
        for index, waypoint in enumerate(waypoints):
            taken = tuple(ends.values()) if index == len(waypoints) - 1 else hovering
            meets = any(place.signed_distance(np.array(waypoint.position)) <= 0.0 for place in taken)
            if name not in still and meets and movable(mission, name, robot, waypoint):
                other = moved_within(mission, name, robot, waypoint, taken)
                waypoints[index] = other or waypoint
                if other is None and index == len(waypoints) - 1 and waypoint.region is not None:
                    stuck.append(waypoint.region)
            elif index == len(waypoints) - 1 and (left := left_last(mission, robot)) is not None:
                near = np.array(mission.regions[left].center), 2.0 * mission.regions[left].outer_radius + _AROUND
                ways = {
                    other: flown_over(flown, (distance, z_scale), near)
                    for other, flown in robots.items()
                    if other != name and name not in later[other]
                }
                blocks = (at for other in later[name] for at in ways.get(other, ()))  # two may come after each other
                if meets or any(at.signed_distance(np.array(waypoint.position)) <= ASIDE for at in blocks):
                    leg, flown = (waypoints[index - 1], waypoint), list(itertools.chain(*ways.values()))
                    waypoints[index] = moved_outside(mission, name, left, leg, tuple(ends.values()), flown) or waypoint
        robots[name] = robot.model_copy(update={"waypoints": tuple(waypoints)})
        ends[name] = keep_out(name, np.array(waypoints[-1].position), distance, z_scale)
    return plan.model_copy(update={"robots": {name: robots[name] for name in plan.robots}}), stuck


def moved_to_meet(plan: Plan, distance: float, z_scale: float, *, nearest: bool = False) -> Plan:
    """Return the plan with each robot's visits of a region made at a place of its own, where the region has as many places.

    Robots take places from the region's middle outwards, or near where they are planned; where that leaves some without one, as far from each
    other as they can.

    Args:
        plan: Whose robots meet.
        distance: m that robots keep.
        z_scale: Distances in z count this many times.
        nearest: Whether robots take places near the planned ones, and then exchange them so that their ways through all regions are short.

    Raises:
        Infeasible: More robots are to end in a region than it was found to have places for.
    """
    plan, mission = without_gates(plan), plan.mission
    moved = {name: list(robot.waypoints) for name, robot in plan.robots.items()}
    apart: dict[str, Visits] = {}
    for region in mission.regions:
        visits = {
            name: [
                i
                for i, waypoint in enumerate(robot.waypoints)
                if waypoint.region == region and movable(mission, name, robot, waypoint)
            ]
            for name, robot in plan.robots.items()
        }
        guests = {name: found[0] for name, found in visits.items() if found}
        if _one_after_another(plan, region, guests):
            continue
        nearby = _visits_within(mission, region, moved)
        if not guests or len({*guests, *nearby}) < 2:
            continue
        for wider, how in _NEAREST if nearest else _ATTEMPTS:
            kept = distance + wider, z_scale
            places = _own_places(plan, region, guests, kept, how=how, nearby=nearby)
            if places is not None:
                apart[region] = {name: visits[name] for name in places}
                for name, place in places.items():
                    for i in visits[name]:
                        moved[name][i] = moved[name][i].model_copy(update={"position": place})
                break
        else:
            _refuse_what_is_too_small(plan, region, guests, (distance, z_scale))
            for name, place in _shared_places(plan, region, guests, (distance, z_scale)).items():
                for i in visits[name]:
                    moved[name][i] = moved[name][i].model_copy(update={"position": place})
    if nearest:
        exchange(plan, moved, apart)
    for region in mission.regions if plan.precedences else ():  # robots may wait for each other just outside regions
        part_outside(plan, region, moved, (distance, z_scale))
    robots = {name: robot.model_copy(update={"waypoints": tuple(moved[name])}) for name, robot in plan.robots.items()}
    return plan.model_copy(update={"robots": robots})


def _one_after_another(plan: Plan, region: str, guests: Collection[str]) -> bool:
    """Tell whether of any two robots that visit a region one leaves it before the other one enters it."""
    own = {name: [i for i, visit in enumerate(plan.robots[name].visits) if visit.region == region] for name in guests}
    after = {name: comes_after(plan, name, visits[-1]) for name, visits in own.items()}
    return all(
        (other, own[other][0]) in after[name] or (name, own[name][0]) in after[other]
        for name, other in itertools.combinations(own, 2)
    )


def _shared_places(
    plan: Plan, region: str, guests: Mapping[str, int], kept: tuple[float, float]
) -> dict[str, tuple[float, ...]]:
    """Return as many places in a region as are found, for those who end there first; others share theirs, one after another."""
    ending = [name for name in guests if plan.robots[name].ends_in == region]
    order = [*ending, *(name for name in guests if name not in ending)]
    for several in range(len(order) - 1, max(1, len(ending) - 1), -1):
        for how in _HOW:
            found = _own_places(plan, region, {name: guests[name] for name in order[:several]}, kept, how=how)
            if found is None:
                continue
            own = order[len(ending) : several] or order[several - 1 : several]
            for number, name in enumerate(order[several:]):
                place = found[own[number % len(own)]]
                if _allowed(plan, name, guests[name], place):
                    found[name] = place
            return found
    return {}


def _allowed(plan: Plan, name: str, index: int, place: tuple[float, ...]) -> bool:
    """Return whether a robot's waypoint may lie at another one's place."""
    robot = plan.robots[name]
    waypoint = robot.waypoints[index].model_copy(update={"position": place})
    return bool(np.any(np.all(places_of(plan.mission, name, robot, waypoint, ()) == np.array(place), axis=1)))


def _visits_within(mission: Mission, region: str, waypoints: Mapping[str, list[Waypoint]]) -> dict[str, list[Floats]]:
    """Return for robots the points in a region at which they visit others: a room's in a house, a house's in a room."""
    body = mission.regions[region]
    return {
        name: found
        for name, points in waypoints.items()
        if (
            found := [
                np.array(point.position)
                for point in points
                if point.role == "centre" and point.region != region and body.level(np.array(point.position)) <= 1.0
            ]
        )
    }


def _refuse_what_is_too_small(plan: Plan, region: str, guests: Mapping[str, int], kept: tuple[float, float]) -> None:
    """Raise where robots that end in a region, and so are in it together, find no places there that lie far enough apart."""
    last = {name: index for name, index in guests.items() if plan.robots[name].ends_in == region}
    if len(last) < 2 or any(_own_places(plan, region, last, kept, how=how) is not None for how in _HOW):
        return
    names = ", ".join(name for name in plan.mission.agents if name in last)
    sentence = (
        f"'{region}' is too small: {len(last)} robots are to be in it together ({names}), and no {len(last)} places {kept[0]:.3f} m "
        "apart were found in it (separation, twice the margin, and room for hovering)."
    )
    raise Infeasible(sentence, Witness(claim="separation", sentence=sentence, region=region))


def _own_places(
    plan: Plan,
    region: str,
    guests: Mapping[str, int],
    kept: tuple[float, float],
    *,
    how: _How,
    nearby: Mapping[str, list[Floats]] | None = None,
) -> dict[str, tuple[float, ...]] | None:
    """Return a place in a region for each robot that visits it (by one of its waypoints there); None where they are too few.

    `nearby` are points in it at which robots visit other regions.
    """
    distance, z_scale = kept
    taken: list[Ball] = []
    found: dict[str, tuple[float, ...]] = {}
    middle = np.array(plan.mission.regions[region].center)

    def free(name: str) -> Floats:
        others = [keep_out(o, at, distance, z_scale) for o, points in (nearby or {}).items() if o != name for at in points]
        return places_of(plan.mission, name, plan.robots[name], plan.robots[name].waypoints[guests[name]], (*taken, *others))

    if how == "packed":
        packing = packed(middle, [free(name) for name in guests], distance, z_scale)
        if packing is None:
            return None
        return {name: tuple(place.tolist()) for name, place in zip(guests, packing, strict=True)}
    for name in guests:
        places = free(name)
        if not len(places):
            return None
        planned = np.array(plan.robots[name].waypoints[guests[name]].position)
        away = np.linalg.norm(places - (planned if how in ("as planned", "near") else middle), axis=1)
        if how == "as planned" and away.min() > 0.0:
            return None
        if how == "apart" and taken:  # next to those who are there already, and as far out as can be
            away = np.sum([place.signed_distance(places) for place in taken], axis=0)
        chosen = places[int(np.argmax(away) if how == "apart" and not taken else np.argmin(away))]
        found[name] = tuple(chosen.tolist())
        taken.append(keep_out(name, chosen, distance, z_scale))
    return found
