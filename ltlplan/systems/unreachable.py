"""Reasons why a region cannot be reached in a world with obstacles: what blocks the path, how wide it is, and what is needed."""

from __future__ import annotations

from collections.abc import Collection, Iterable

import numpy as np

from ltlplan.free_space.bottlenecks import WALL, Gap, Shut, TooNear, what_shuts
from ltlplan.free_space.staying_inside import ROOMS, narrowest_inside, way_inside
from ltlplan.systems.region_graph import RegionGraph
from verify.data import Mission
from verify.data.language.lasting import lasting_regions
from verify.data.obstruction import Obstruction
from verify.data.shapes.inequalities import Point

_INSIDE = 5e-4
"""m; a place so near to an obstacle is said to lie in it."""


def why_unreachable(mission: Mission, graph: RegionGraph, robot: str, region: str) -> str | None:
    """Return a sentence that says what shuts the way of a robot to a region; None where nothing solid does.

    Args:
        mission: Whose region.
        graph: Where robots of this size can rest.
        robot: Its name.
        region: Which it cannot reach.
    """
    if graph.space is None:
        return None
    starts = _reached(graph, mission.agents[robot].start)
    gate = mission.hoops.get(region)
    ends = [mission.all_regions[region].center]
    if gate is not None:
        ends = [place.point for _, place, _ in graph.entries(region)]
    found = [what_shuts(graph.space, starts, end) for end in ends]
    if all(one is not None for one in found):
        return said_of(mission, robot, region, found[0])
    return why_not_within(mission, graph, robot, region)


def why_not_within(mission: Mission, graph: RegionGraph, robot: str, region: str) -> str | None:
    """Return a sentence on the regions that hold both ends of a robot's way to a region, where no way stays as deep in them as the margin asks; else None.

    Args:
        mission: Whose region.
        graph: Where robots of this size can rest.
        robot: Its name.
        region: Where it is to come to.
    """
    space, names = graph.space, frozenset(mission.all_regions)
    if space is None or region not in mission.regions:
        return None
    ends = np.array(mission.agents[robot].start), np.array(mission.all_regions[region].center)
    held = {name: float(np.max(body.level(np.stack(ends)))) <= 1.0 for name, body in mission.regions.items() if name != region}
    rooms = [name for name in sorted(held) if held[name]]
    if (
        not rooms
        or space.roadmap().way(*ends, names) is None
        or way_inside(space, rooms, ends, names, 0.0, ROOMS[-1:]) is not None
    ):
        return None
    found, named = narrowest_inside(space, rooms, ends, names, 0.0), joined_names([f"'{name}'" for name in rooms])
    if found is None:
        where, least = "not even near to the border", ()
    else:
        where = (
            f"around {_point(found[0])} none is more than {found[1]:.3g} m within, and the margin asks for {mission.margin:g} m"
        )
        least = (f"a `margin` below {found[1]:.3g} m",)
    outside = () if lasting_regions(mission, robot, inside=True) & set(rooms) else ("a region outside to go by",)
    what = (
        f"No way of {robot} to {region} stays within {named}, which {'hold' if len(rooms) > 1 else 'holds'} both ends: {where}."
    )
    return Obstruction(what, (robot,), helps=(f"a wider {named} there", *outside, *least)).sentence


def said_of(mission: Mission, robot: str, region: str, shut: Gap | Shut | TooNear | None) -> str:
    """Return a sentence about what shuts the way of a robot to a region.

    Args:
        mission: Whose region.
        robot: Its name.
        region: Which it cannot reach.
        shut: What `what_shuts` found.
    """
    radius, margin = mission.vehicle_of(robot).radius, mission.margin
    middle = "control points" if region in mission.hoops else "middle"
    match shut:
        case Gap():
            through, width = [name for name in shut.regions if name != region], f"{round(shut.width, 3):g} m"
            where = f"between {_sides(shut.between)}, {width} apart"
            if through:
                where = f"through {joined_names(through)}, {width} wide, between {_sides(shut.between)}"
            sides = "radius and margin" if WALL not in shut.between else "radius and margin to the obstacle, margin to the wall"
            return f"{region} can only be reached {where}; {robot} needs {round(shut.needed, 3):g} m ({sides}, {radius:g} m and {margin:g} m)."
        case TooNear() if shut.distance < _INSIDE:
            return f"The {middle} of {region} cannot be reached: it lies in the obstacle '{shut.name}'."
        case TooNear():
            return (
                f"The {middle} of {region} cannot be reached: it is {round(shut.distance, 3):g} m from the obstacle '{shut.name}', and {robot} "
                f"needs {radius + margin:.3g} m (radius and margin)."
            )
        case _:
            names = [] if shut is None else [f"'{name}'" for name in shut.behind[:4]]
            by = f": {joined_names(names)} stand{'s' * (len(names) == 1)} between" if names else ""
            return f"No way of any width leads to {region}{by}."


def said_of_narrowest(mission: Mission, gap: Gap) -> str:
    """Return where the widest way past a region is narrowest, how wide, between what, and what is needed there.

    Args:
        mission: Whose world.
        gap: What `narrowest_around` found.
    """
    near = f"near {_point(gap.point)} the widest way around it is {gap.width:.3g} m wide"
    sides = joined_names(["the workspace's wall" if name == WALL else f"'{name}'" for name in dict.fromkeys(gap.between)])
    solid = {name in mission.obstacles or name in mission.hoops for name in gap.between}
    needs = "radius and margin to what is solid, margin to the other side" if len(solid) == 2 else "margin on both sides"
    both = "radius and " if solid == {True} else ""
    return f"{near} between {sides}, and more than {gap.needed:.3g} m is needed ({both}{needs})"


def _point(at: Iterable[float]) -> str:
    return f"({', '.join(f'{number:.2f}' for number in at)})"


def _reached(graph: RegionGraph, start: Point) -> list[Point]:
    """Return from where ways begin that a robot can come to: its start, and the places it can visit from there."""
    point = graph.standing(graph.layout.at(start))
    waiting, seen = [point], {point}
    for here in waiting:  # grows while it is walked
        for transition in graph.transitions(here):
            if transition.end not in seen:
                seen.add(transition.end)
                waiting.append(transition.end)
    return list(dict.fromkeys(graph.exit(here)[0].point for here in waiting))


def _sides(names: Collection[str]) -> str:
    if len(set(names)) == 1 and WALL not in names:
        return f"two sides of '{next(iter(names))}'"
    return joined_names(["the workspace's wall" if name == WALL else f"'{name}'" for name in names])


def joined_names(items: Collection[str]) -> str:
    """Return names as a sentence lists them."""
    *most, last = items
    return f"{', '.join(most)} and {last}" if most else last
