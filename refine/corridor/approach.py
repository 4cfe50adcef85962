"""Approach corridors, from and to places right in front of an opening that is not flown through, nearer to the ring's disc than the rim demands, yet
clear of rim and opening; and in the opening of a wall so thick that a passage ends in it.

No plane parts such a place from the disc that stands for the whole ring, or from the wall, so a flight comes and goes straight along
the hoop's axis, in a cylinder around it, until it is clear of them; a passage of another hoop goes on as it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from refine.corridor.detours import Barriers, detour
from refine.corridor.legs import Cylinder, Leg, Space, TimedWaypoint, in_opening, refused, show, trimmed
from refine.obstacles.keep_out_bodies import Disc, blocking, opening
from refine.obstacles.solid_body import SolidBody
from verify.data import Mission
from verify.data.shapes.region import Hoop
from verify.data.validation.spacing import ROUNDING

Floats = NDArray[np.float64]
Around = dict[str, tuple[Disc | SolidBody, ...]]
"""What stands around a place in front of hoops or in their openings: rings and walls by the hoop's name."""

_CLEAR = 0.01
"""m from ring and wall at which an approach corridor is left."""
_STEPS = np.arange(0.05, 1.5, 0.01)
"""m from the place in the approach corridor at which it may be left."""


def through_approach_corridors(space: Space, leg: Leg, here: TimedWaypoint, there: TimedWaypoint) -> list[tuple[Floats, Leg]]:
    """Return the points after one point of a plan up to the next, each with the rules of the straight leg that leads there.

    A point that is too near a ring, and in no approach corridor, is refused.

    Args:
        space: What the robot flies in.
        leg: The rules between the two points.
        here: The point that is left.
        there: The next one.

    Raises:
        Infeasible: One of them is too near a ring, or no way was found around what is between them.
    """
    for stop in (here, there):
        _refuse_too_near(space, leg, stop)
    within, beyond = _within(space, leg, here.position), _within(space, leg, there.position)
    if within and beyond and (leg.cylinder is not None or within.keys() == beyond.keys()):
        both = {name: (*within.get(name, ()), *beyond.get(name, ())) for name in {**within, **beyond}}
        inside = _inside(space, leg, both, here.position, there.position)
        if inside is not None:
            return [(there.position, inside)]
    out = _way_out(space, within, leg, here.position, there.position)
    back = _way_out(space, beyond, leg, there.position, here.position)
    a, b = here.position if out is None else out[0], there.position if back is None else back[0]
    chain = [] if out is None else [out]
    if leg.cylinder is not None:
        chain.append((b, leg))
    else:
        kept = {body.name for body in leg.obstacles}
        around = [body for region, body in space.bodies.regions.items() if region not in kept]
        left = tuple(body for body in around if body.signed_distance(a) <= 0.0 < body.signed_distance(b))
        entered = tuple(body for body in around if body.signed_distance(b) <= 0.0 < body.signed_distance(a))
        legs = detour(space, a, b, Barriers(leg.obstacles, left, entered), to=there)
        chain += [(point, replace(leg, obstacles=obstacles)) for point, obstacles in legs]
    return chain if back is None else [*chain, (there.position, back[1])]


def _way_out(space: Space, within: Around, leg: Leg, point: Floats, other: Floats) -> tuple[Floats, Leg] | None:
    """Return where the approach corridor around one end of a leg is left, and the rules up to there; None where there is none."""
    if not within:
        return None
    for towards in _directions(space.mission, leg, tuple(within), point, other):
        places = point + _STEPS[:, None] * towards
        clear = np.all([body.signed_distance(places) >= _CLEAR for bodies in within.values() for body in bodies], axis=0)
        clear &= np.all((places >= space.low) & (places <= space.high), axis=1)
        if leg.cylinder is not None:
            clear &= np.linalg.norm(other - point) > _STEPS
        if not clear.any():
            continue
        place = places[int(np.argmax(clear))]
        inside = _inside(space, leg, within, point, place)
        if inside is not None:
            return place, inside
    return None


def _inside(space: Space, leg: Leg, within: Around, a: Floats, b: Floats) -> Leg | None:
    """Return the rules of a straight leg in the approach corridors of some hoops; None where it is too near a rim or meets something."""
    mission, clearance, radius = space.mission, space.clearance, space.radius
    way = np.linspace(a, b, 33)
    if any(np.any(_to_rim(mission.hoops[name], way) < mission.margin + radius) for name in within):
        return None
    flat = [opening(name, mission.hoops[name], mission.margin + clearance) for name in within]
    around = [other for bodies in within.values() for other in bodies]
    kept = [body for body in leg.obstacles if all(body is not other for other in around)]
    obstacles = (*kept, *(trimmed(disc, np.stack([a, b]), clearance) for disc in flat))
    if blocking(a, b, obstacles) is not None:
        return None
    cylinders = tuple(_approach_cylinder(mission.hoops[name], mission.margin + clearance + radius) for name in within)
    return Leg(obstacles, leg.cylinder, leg.visit, cylinders)


def _refuse_too_near(space: Space, leg: Leg, stop: TimedWaypoint) -> None:
    """Raise where a stop is nearer to the rim or the opening of a hoop than it may be."""
    mission, name = space.mission, space.name
    for hoop in _within(space, leg, stop.position):
        rim, radius = float(_to_rim(mission.hoops[hoop], stop.position)), space.radius
        hole = float(opening(hoop, mission.hoops[hoop], 0.0).signed_distance(stop.position))
        for what, distance, least in (("rim", rim, mission.margin + radius), ("opening", hole, mission.margin)):
            if distance < least + ROUNDING:
                sentence = f"{name}: waypoint {show(stop.position)} is {distance:.4f} m from the {what} of '{hoop}'; {least + ROUNDING:.4f} m are needed there."
                raise refused("passages", name, stop, sentence)


def _within(space: Space, leg: Leg, point: Floats) -> Around:
    """Return the rings, and walls with openings, that a leg keeps out of and one of its ends lies in."""
    rings = {disc.name: name for name, disc in space.bodies.rings.items()}
    found: Around = {}
    for body in leg.obstacles:
        if isinstance(body, Disc) and body.name in rings and body.signed_distance(point) <= 0.0:
            found[rings[body.name]] = (body,)
        elif isinstance(body, SolidBody) and body.openings and body.signed_distance(point) <= 0.0:
            for hoop in body.openings:
                if in_opening(space, space.mission.hoops[hoop], point):
                    found[hoop] = (*found.get(hoop, ()), body)
    return found


def _directions(mission: Mission, leg: Leg, within: tuple[str, ...], point: Floats, other: Floats) -> list[Floats]:
    """Return unit vectors along which an approach corridor may be left: a passage goes on, others follow an axis of the hoops."""
    if leg.cylinder is not None:
        return [(other - point) / max(float(np.linalg.norm(other - point)), 1e-9)]
    normals = [np.array(mission.hoops[name].normal) for name in within]
    sides = [(point - np.array(mission.hoops[name].center)) @ normal for name, normal in zip(within, normals, strict=True)]
    return [normal if side >= 0.0 else -normal for side, normal in zip(sides, normals, strict=True)]


def _approach_cylinder(hoop: Hoop, growth: float) -> Cylinder:
    return Cylinder(np.array(hoop.center), np.array(hoop.normal), max(hoop.opening - growth, 0.0))


def _to_rim(hoop: Hoop, points: Floats) -> Floats:
    """Return the distance of points to a hoop's rim, m. Shape (..., 3) to (...)."""
    offset, normal = points - np.array(hoop.center), np.array(hoop.normal)
    along = offset @ normal
    across = np.linalg.norm(offset - along[..., None] * normal, axis=-1)
    beside = np.maximum(np.maximum(hoop.opening - across, across - hoop.opening - hoop.rim), 0.0)
    return np.hypot(beside, np.maximum(np.abs(along) - hoop.rim / 2, 0.0))
