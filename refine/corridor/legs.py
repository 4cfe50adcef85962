"""Constraints of one leg between two stops of a plan: bodies to stay out of and, during a passage, a cylinder to stay in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from refine.corridor.passage_room import room_in_opening, room_in_region
from refine.obstacles.keep_out_bodies import Ball, Disc, GrownRegion, Obstacle, convex_parts, grown_region, ring, within
from refine.obstacles.solid_body import SolidBody, solid_bodies
from verify.data import Infeasible, Mission, RobotPlan, Witness
from verify.data.plan import Role, Waypoint
from verify.data.shapes.region import Hoop
from verify.data.validation.spacing import ROUNDING

Floats = NDArray[np.float64]
Body = TypeVar("Body", Ball, Disc, SolidBody, GrownRegion)

CLEARANCE = 1e-3
"""m kept on top of the margin, so that rounding and engine tolerances cannot use the margin up."""
HOVERING = 0.02
"""m on top of the distance around a robot that hovers."""
PASSAGE: tuple[Role, ...] = ("rear", "centre", "front")  # along the normal


@dataclass(frozen=True, eq=False)
class Cylinder:
    """The cylinder that a passage stays in: within `radius` of the axis through `centre` along `normal`."""

    centre: Floats
    normal: Floats
    radius: float


@dataclass(frozen=True, eq=False)
class Leg:
    """Constraints of one leg.

    Attributes:
        obstacles: Bodies to stay out of.
        cylinder: Cylinder to stay in, during a passage.
        visit: The visit that is being approached or made; None after the last one and between points that belong to no visit.
        approaches: More cylinders to stay in, along approach corridors.
    """

    obstacles: tuple[Obstacle, ...]
    cylinder: Cylinder | None
    visit: int | None
    approaches: tuple[Cylinder, ...] = ()


@dataclass(frozen=True)
class TimedWaypoint:
    """One waypoint of a plan: m, s, and what it is there for."""

    position: Floats
    time: float
    role: Role
    region: str | None
    visit: int | None


@dataclass(frozen=True)
class Bodies:
    """Bodies that robots stay out of, inflated by the margin.

    Attributes:
        regions: By name.
        rings: Grown by the vehicle's radius too, by the hoop's name.
        solids: Parts of obstacles, grown by the vehicle's radius too.
    """

    regions: dict[str, GrownRegion]
    rings: dict[str, Disc]
    solids: tuple[SolidBody, ...]


@dataclass(frozen=True, eq=False)
class Space:
    """Space that one robot flies in.

    Attributes:
        mission: Gives regions, hoops, obstacles and margin.
        name: The robot's.
        clearance: m on top of the margin.
        bodies: Regions and rings, grown by margin and clearance.
        low: Lower corner of the box to stay in, m. Shape (3,).
        high: Upper corner.
    """

    mission: Mission
    name: str
    clearance: float
    bodies: Bodies
    low: Floats
    high: Floats

    @property
    def radius(self) -> float:
        """The robot's radius, m."""
        return self.mission.vehicle_of(self.name).radius


def space_for(mission: Mission, name: str, clearance: float) -> Space:
    """Return what a robot flies in, with `clearance` m on top of the margin.

    Args:
        mission: Gives regions, hoops, margin and workspace.
        name: The robot's.
        clearance: m on top of the margin.
    """
    low, high = (np.array(corner) for corner in (mission.workspace.min, mission.workspace.max))
    more = min(clearance, ROUNDING)
    return Space(
        mission, name, clearance, bodies_of(mission, name, clearance), low + mission.margin + more, high - mission.margin - more
    )


def bodies_of(mission: Mission, name: str, clearance: float) -> Bodies:
    """Return what one of a mission's robots stays out of.

    Args:
        mission: Gives regions, hoops, obstacles and margin.
        name: The robot's.
        clearance: m on top of the margin.
    """
    grow = mission.margin + clearance
    wide = grow + mission.vehicle_of(name).radius
    return Bodies(
        {name: grown_region(name, region, grow) for name, region in mission.all_regions.items()},
        {name: ring(name, hoop, wide) for name, hoop in mission.hoops.items()},
        solid_bodies(mission, wide),
    )


def leads_to(mission: Mission, waypoint: Waypoint) -> bool:
    """Return whether a point lies outside of the region that it belongs to: it leads there, or out again before coming back."""
    region = None if waypoint.region is None else mission.all_regions.get(waypoint.region)
    if region is None or waypoint.role != "via":
        return False
    return float(region.level(np.array(waypoint.position))) > (1.0 + mission.margin / region.inner_radius) ** 2


def leg_between(space: Space, robot: RobotPlan, here: TimedWaypoint, there: TimedWaypoint, extra: tuple[Ball, ...]) -> Leg:
    """Return the rules of the leg from one point of a plan to the next.

    Args:
        space: What the robot flies in.
        robot: Its plan.
        here: The point that is left.
        there: The next one.
        extra: More bodies to stay out of.

    Raises:
        Infeasible: One of the points lies within the margin of a region that is not visited there, or a passage has no room.
    """
    mission, name, bodies, clearance = space.mission, space.name, space.bodies, space.clearance
    visit = there.visit if there.visit is not None else here.visit
    passing = _passing(mission, robot, here, there)
    ends = np.stack([here.position, there.position])
    everywhere = {visit.region for visit in robot.visits}  # regions may overlap: which of them come when, the stays tell
    obstacles: list[Obstacle] = []
    regions = tuple(bodies.regions.values())
    near = set(within(regions, ends.min(axis=0) - clearance, ends.max(axis=0) + clearance))
    for index, (region, grown) in enumerate(bodies.regions.items()):
        if index not in near and region != passing:
            obstacles += convex_parts(grown)
            continue
        body = trimmed(grown, ends, clearance)
        inside = body.signed_distance(ends) <= 0.0
        planned = inside[0] <= (region in everywhere or here.role == "start") and inside[1] <= (region in everywhere)
        if region == passing or (inside.any() and planned):
            continue
        if inside.any():
            stop = there if inside[1] else here
            raise refused(
                "visits",
                name,
                stop,
                f"{name}: waypoint {show(stop.position)} lies within the margin of '{region}', which is not visited there.",
            )
        obstacles += convex_parts(body)
    obstacles += [trimmed(disc, ends, clearance) for hoop, disc in bodies.rings.items() if hoop != passing]
    obstacles += [
        body for body in (trimmed(place, ends, HOVERING) for place in extra) if np.all(body.signed_distance(ends) > 0.0)
    ]
    obstacles += _solids(space, here, there, passing)
    cylinder = None if passing is None else _passage_cylinder(mission, name, passing, clearance)
    return Leg(tuple(obstacles), cylinder, visit)


def _solids(space: Space, here: TimedWaypoint, there: TimedWaypoint, passing: str | None) -> list[SolidBody]:
    """Return the parts of obstacles that a leg stays out of: all but those through whose opening it passes.

    Raises:
        Infeasible: One of its ends lies too near to an obstacle, and in none of its openings.
    """
    mission, solids = space.mission, list(space.bodies.solids)
    ends = np.stack([here.position, there.position])
    for index in within(space.bodies.solids, ends.min(axis=0) - space.clearance, ends.max(axis=0) + space.clearance):
        body = solids[index]
        if passing in body.openings:
            continue
        body = solids[index] = trimmed(body, ends, space.clearance)
        for stop, depth in zip((here, there), -body.signed_distance(ends), strict=True):
            if depth >= 0.0 and not any(in_opening(space, mission.hoops[hoop], stop.position) for hoop in body.openings):
                sentence = (
                    f"{space.name}: waypoint {show(stop.position)} is {depth:.4f} m too near to {body.name}; the vehicle's radius "
                    f"{space.radius:g} m and the margin {mission.margin:g} m are needed around it."
                )
                raise refused("obstacles", space.name, stop, sentence)
    return [body for body in solids if passing not in body.openings]


def in_opening(space: Space, hoop: Hoop, point: Floats) -> bool:
    """Return whether a point lies so near to a hoop's axis that the vehicle fits through the opening.

    Args:
        space: Gives margin and vehicle radius.
        hoop: Whose opening it is.
        point: m. Shape (3,).
    """
    offset = point - np.array(hoop.center)
    across = offset - (offset @ np.array(hoop.normal)) * np.array(hoop.normal)
    room = room_in_opening(hoop, space.radius, space.mission.margin + ROUNDING)
    return float(np.linalg.norm(across)) <= room


def trimmed(body: Body, ends: Floats, clearance: float) -> Body:
    """Return a body, shrunk where an end of a leg lies in its outermost `clearance` m, so that the end is just outside.

    The clearance is there for curves; a given point is where it is, and may use up all of it but for what rounding needs.

    Args:
        body: What a leg stays out of.
        ends: The leg's, m. Shape (2, 3).
        clearance: m on top of the margin that the body was grown by.
    """
    near = body.signed_distance(ends)
    slivers = near[(near <= 0.0) & (near >= ROUNDING - clearance)]
    return body.grown(float(slivers.min()) - ROUNDING) if len(slivers) else body


def _passing(mission: Mission, robot: RobotPlan, here: TimedWaypoint, there: TimedWaypoint) -> str | None:
    """Return the hoop that a leg flies through, if any."""
    if here.visit is None or there.visit is None or here.role not in PASSAGE or there.role not in PASSAGE:
        return None
    visit = robot.visits[there.visit]
    turned = here.visit + 1 == there.visit and robot.visits[here.visit].region == visit.region  # where the last passage ended
    if here.visit != there.visit and not turned:
        return None
    ahead = PASSAGE.index(there.role) - PASSAGE.index(here.role)  # a lap's last leg leads back to the same hoop
    if visit.direction is None or visit.region not in mission.hoops or (ahead > 0) != (visit.direction == "F"):
        return None
    return visit.region


def passage_radius(mission: Mission, name: str, hoop: Hoop, clearance: float) -> float:
    """Return how far from a hoop's axis a passage may be, in m; not positive where there is no room for it.

    Args:
        mission: Gives margin and vehicle.
        name: The robot's.
        hoop: What is flown through.
        clearance: m on top of the margin.
    """
    margin = mission.margin + clearance
    return min(room_in_opening(hoop, mission.vehicle_of(name).radius, margin), room_in_region(hoop, margin))


def _passage_cylinder(mission: Mission, name: str, hoop_name: str, clearance: float) -> Cylinder:
    hoop, margin, own = mission.hoops[hoop_name], mission.margin, mission.vehicle_of(name).radius
    radius = passage_radius(mission, name, hoop, clearance)
    if radius <= 0.0:
        what, sentence = (
            "opening",
            (
                f"'{hoop_name}' has an opening of {hoop.opening:g} m; vehicle radius {own:g} m and margin "
                f"{margin:g} m leave no room in it."
            ),
        )
        if room_in_opening(hoop, own, margin + clearance) > 0.0:
            what, sentence = (
                "region",
                (
                    f"'{hoop_name}' reaches {', '.join(f'{x:.3g}' for x in hoop.half_lengths)} m along x, y, z: within the margin {margin:g} m of its opening, not even its axis is "
                    "inside its region by the margin, so no visit could contain a passage. Give it a larger region, or ask for a smaller margin."
                ),
            )
        raise Infeasible(sentence, Witness(claim="passages", sentence=f"{what} too small", robot=name, region=hoop_name))
    return Cylinder(np.array(hoop.center), np.array(hoop.normal), radius)


def refused(claim: str, name: str, stop: TimedWaypoint, sentence: str) -> Infeasible:
    """Return the error that says why a stop cannot be flown to.

    Args:
        claim: What the judge would call it.
        name: The robot's.
        stop: The point.
        sentence: What is wrong with it.
    """
    return Infeasible(sentence, Witness(claim=claim, sentence=sentence, robot=name, region=stop.region, visit=stop.visit))


def show(point: Floats) -> str:
    """Return a point for a message, in m."""
    return "(" + ", ".join(f"{x:.3f}" for x in point) + ")"
