"""Rules for a mission's obstacles: openings that lead through walls, and room around starts, ends and hoops."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from verify.data.errors import did_you_mean
from verify.data.sections import Agent
from verify.data.shapes.convex_parts import ConvexBody, Floats, outline
from verify.data.shapes.nearest import Surface, surface_of
from verify.data.shapes.obstacle import Obstacle
from verify.data.shapes.region import Hoop, Region
from verify.data.shapes.solid_parts import SolidPart, solid_parts
from verify.data.validation.faults import Finding
from verify.data.validation.kinds import flown
from verify.data.validation.spacing import ROUNDING

_ANGLES = np.arange(32) * (np.pi / 16)
_TOUCHING = 1e-9
"""m; as much as rounding may make of faces that meet."""


def broken_by_obstacles(
    values: Mapping[str, Any],  # of any type: each section has its own
    hoops: Sequence[str],
    *,
    to_plan: bool = True,
) -> Iterator[Finding]:
    """Yield what is wrong with a mission's obstacles, and with what stands too near to them.

    Args:
        values: The sections that are sound by themselves, by key, as the schema's types.
        hoops: Names of all hoops, of those that are not sound as well.
        to_plan: Whether starts, ends and hoops must leave room, as planning needs it.
    """
    obstacles: Mapping[str, Obstacle] = values.get("obstacles", {})
    if not obstacles:
        return
    sound: Mapping[str, Hoop] = values.get("hoops", {})
    parts = solid_parts(obstacles, sound)
    for name, obstacle in obstacles.items():
        for index in range(len(obstacle.openings)):
            for sentence in _opening(obstacle, index, hoops, sound, [part for part in parts if part.obstacle == name]):
                yield ("obstacles", name, "openings", index), sentence
    if to_plan:
        yield from _crowded(values, parts, obstacles)
        yield from _walled_in(values.get("regions", {}), obstacles, sound)


def _opening(
    obstacle: Obstacle, index: int, known: Sequence[str], hoops: Mapping[str, Hoop], parts: Sequence[SolidPart]
) -> Iterator[str]:
    """Yield what is wrong with one opening of an obstacle."""
    name = obstacle.openings[index]
    if name not in known:
        yield f"'{name}' is not a hoop of this mission.{did_you_mean(name, known)} Hoops: {', '.join(known) or '(none)'}."
    elif name in obstacle.openings[:index]:
        yield f"'{name}' stands there twice."
    elif name in hoops:
        hoop = hoops[name]
        pierced = [part for part in parts if any(name == hole for hole, _ in part.holes)]
        if not pierced:
            yield f"the centre of hoop '{name}' lies outside this obstacle; an opening's hoop stands in its wall."
            return
        ring = _disc(hoop, hoop.opening + hoop.rim)
        inside = np.max([part.distances_whole(ring) <= _TOUCHING for part in pierced], axis=0)
        if not inside.all():
            yield (
                f"the ring of '{name}', {hoop.opening + hoop.rim:g} m around {_shown(hoop.center)}, reaches out of the wall at "
                f"{_shown(ring[int(np.argmin(inside))])}: what holds the hoop's centre must hold all of its ring. Make the wall larger, or "
                "the opening smaller."
            )


def _crowded(values: Mapping[str, Any], parts: Sequence[SolidPart], obstacles: Mapping[str, Obstacle]) -> Iterator[Finding]:
    """Yield starts, ends and hoops that a vehicle's sphere within the margin cannot be at."""
    vehicles = flown(values)
    if not vehicles:
        return
    smallest = min(vehicle.radius for vehicle in vehicles.values())
    margin = values.get("margin", 0.05)
    agents: Mapping[str, Agent] = values.get("agents", {})
    hoops: Mapping[str, Hoop] = values.get("hoops", {})
    keys: list[tuple[str | int, ...]] = []
    points: list[Sequence[float]] = []
    roles: list[str] = []
    radii: list[float] = []
    for name, agent in agents.items():
        for key, point in (("start", agent.start), ("end", agent.end)):
            if point is not None:
                keys.append(("agents", name, key))
                points.append(point)
                roles.append("")
                radii.append(vehicles[name].radius if name in vehicles else smallest)
    resting = len(keys)
    for name, hoop in hoops.items():
        normal = np.array(hoop.normal)
        for role, ahead in (("centre", 0.0), ("front", hoop.reach or 0.0), ("rear", -(hoop.reach or 0.0))):
            keys.append(("hoops", name))
            points.append((np.array(hoop.center) + ahead * normal).tolist())
            roles.append(role)
            radii.append(smallest)
    where = np.array(points).reshape(-1, 3)
    needed = np.array(radii) + margin
    needed[:resting] += ROUNDING
    said: set[tuple[str | int, ...]] = set()
    for part in parts:
        distances = part.distances(where)
        for index in np.flatnonzero(distances < needed).tolist():
            fault = (*keys[index], part.obstacle)
            if fault in said:
                continue
            said.add(fault)
            what = f"{_shown(where[index])}" if index < resting else f"its {roles[index]} control point {_shown(where[index])}"
            if distances[index] <= 0:
                place = f"{what} lies inside obstacle '{part.obstacle}'"
            else:
                place = f"{what} is {distances[index]:.4f} m from obstacle '{part.obstacle}'"
            hint = _mend(str(keys[index][1]), roles[index], part, obstacles[part.obstacle])
            yield keys[index], f"{place}; vehicle radius and margin need {needed[index]:g} m.{hint}"


def _mend(hoop: str, role: str, part: SolidPart, obstacle: Obstacle) -> str:
    """Return what may mend a hoop that stands in an obstacle or next to one."""
    if role == "centre":
        if any(hoop == hole for hole, _ in part.holes):
            return ""
        if hoop in obstacle.openings:
            return f" Part {part.number + 1} of it does not hold the hoop's centre, and fills the opening."
        return f" A hoop in a wall is one of its `openings: [{hoop}]`."
    return " Move the hoop or set a shorter `reach`." if role else ""


def _walled_in(
    regions: Mapping[str, Region], obstacles: Mapping[str, Obstacle], hoops: Mapping[str, Hoop]
) -> Iterator[Finding]:
    """Yield regions that lie wholly inside one convex body of an obstacle, so that nobody can ever be in them."""
    names = list(regions)
    centres = np.array([region.center for region in regions.values()]).reshape(-1, 3)
    for name, obstacle in obstacles.items():
        holes = [hoops[hoop] for hoop in obstacle.openings if hoop in hoops]
        for index in np.flatnonzero(obstacle.level(centres) <= 1.0).tolist() if names else ():
            region = regions[names[index]]
            reached = any(_off_axis(hole, region.center) < hole.opening + region.outer_radius for hole in holes)
            if not reached and _is_inside(region, obstacle):
                yield ("regions", names[index]), f"lies inside obstacle '{name}', so that no robot can ever be in it."


def _is_inside(region: Region, obstacle: Obstacle) -> bool:
    """Return whether every part of a region lies in some convex body of an obstacle, in floats."""
    between = np.array(region.center) - np.array(obstacle.center)
    return all(
        any(_is_part_inside(surface_of(tuple(part)), held, between) for held in obstacle.measures.covers)
        for part in region.body
    )


def _is_part_inside(inner: Surface, held: ConvexBody, between: Floats) -> bool:
    faces = between @ held.normals.T + inner.body.reaches(held.normals, inner.corners) <= held.distances + _TOUCHING
    return bool(np.all(faces)) and (
        not len(held.matrices) or bool(np.all(held.depths(outline(inner.body) + between) >= -_TOUCHING))
    )


def _off_axis(hoop: Hoop, point: Sequence[float]) -> float:
    """Return how far a point is from a hoop's axis, in m."""
    return float(np.linalg.norm(np.cross(np.array(point) - np.array(hoop.center), np.array(hoop.normal))))


def _disc(hoop: Hoop, radius: float) -> Floats:
    """Return points on a circle around a hoop's axis, in its plane, m. Shape (n, 3)."""
    normal = np.array(hoop.normal)
    left = np.cross([0.0, 0.0, 1.0], normal)
    left /= np.linalg.norm(left)
    return np.array(hoop.center) + radius * (
        np.cos(_ANGLES)[:, None] * left + np.sin(_ANGLES)[:, None] * np.cross(normal, left)
    )


def _shown(point: Sequence[float] | Floats) -> str:
    return f"({', '.join(f'{x + 0.0:.4g}' for x in np.round(np.array(point), 9))})"
