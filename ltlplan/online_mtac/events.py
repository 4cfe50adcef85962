"""Events that change the world of an online flight, checked before take-off, and what a region does that moves onto a robot.

Everything that can be known to be wrong before take-off (an unknown name, a hoop outside the workspace, a formula that cannot be
read) is said before take-off. The events themselves are `verify.data.events`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from verify.data import BadInput, Formula, Mission
from verify.data.events import (
    HoopMoves,
    ObstacleAppears,
    RobotJoins,
    RobotLeaves,
    WorldEvent,
    changed,
    require_known,
    unknown,
)
from verify.data.mission import check_mission
from verify.data.sections import Agent
from verify.data.shapes.inequalities import Point
from verify.data.shapes.region import Hoop
from verify.data.shapes.solid_parts import solid_parts

_PLACES = 7
"""Along each side of a workspace, where robots are put that say nothing."""


def in_order(mission: Mission, events: Iterable[WorldEvent]) -> tuple[WorldEvent, ...]:
    """Return events in the order of their times, checked one after another against the mission as it then is.

    Raises:
        BadInput: The first event that cannot be, with what would be right.
    """
    ordered = tuple(sorted(events, key=lambda event: event.time))
    present = list(mission.agents)
    for event in ordered:
        if not (math.isfinite(event.time) and event.time >= 0):
            raise BadInput(f"An event happens at {event.time} s; its time must be finite and not negative.")
        require_known(mission, event)
        if isinstance(event, RobotLeaves):
            if event.robot not in present:
                raise BadInput(unknown(event.robot, "robot in the air", present))
            present.remove(event.robot)
        elif isinstance(event, RobotJoins):
            present.append(event.robot)
        try:
            mission = event.apply(mission)
            # agents have left their starts: only what the event brings is held against the rest
            check_mission(_for_check(mission, event))
            if isinstance(event, RobotJoins):
                _require_apart(mission, event.robot, present)
        except ValueError as error:
            raise BadInput(f"At {event.time:g} s {event}: {error}") from None
        except BadInput as error:
            raise BadInput(f"At {event.time:g} s {event}: {error}") from None
    return ordered


def _require_apart(mission: Mission, joined: str, present: Iterable[str]) -> None:
    """Refuse a robot that may touch another one as far apart as the mission keeps them."""
    asked = [("", mission.separation), (" above each other", mission.separation_z)]
    for other in present:
        one, two = (mission.vehicle_of(name).radius for name in (joined, other))
        for where, value in asked if other != joined else ():
            if value is not None and value < one + two:
                raise BadInput(
                    f"{value:g} m between centres lets {joined} and {other}{where} touch: their radii of {one:g} m and {two:g} m need "
                    f"{one + two:g} m."
                )


def falls_on(mission: Mission, event: WorldEvent, positions: dict[str, Point]) -> str | None:
    """Return a sentence where a region or a solid body comes onto a robot, or None.

    Args:
        mission: As it is before the event.
        event: What changes.
        positions: Of each robot in the air, m.
    """
    if isinstance(event, ObstacleAppears) or (isinstance(event, HoopMoves) and event.region in mission.obstacles):
        return _solid_falls_on(event, event.apply(mission), positions)
    if not isinstance(event, HoopMoves):
        return None
    region = event.apply(mission).all_regions[event.region]
    for robot, position in positions.items():
        if float(region.level(np.array(position))) <= (1 + mission.margin / region.inner_radius) ** 2:
            return f"{event.region} moves onto {robot}, which is inside it at once; the robots hold their positions."
        need = mission.vehicle_of(robot).radius + mission.margin
        if isinstance(region, Hoop) and rim_distance(position, region) <= need:
            return f"The rim of {event.region} moves onto {robot}, within {need:.3f} m; the robots hold their positions."
    return None


def _solid_falls_on(event: HoopMoves | ObstacleAppears, after: Mission, positions: dict[str, Point]) -> str | None:
    name = event.name if isinstance(event, ObstacleAppears) else event.region
    parts = solid_parts({name: after.obstacles[name]}, after.hoops)
    for robot, position in positions.items():
        need = after.vehicle_of(robot).radius + after.margin
        far = min(float(part.distances(np.array([position]))[0]) for part in parts)
        if far <= need:
            return f"{event}, {max(far, 0.0):.3f} m from {robot}, which needs {need:.3f} m; the robots hold their positions."
    return None


def _for_check(mission: Mission, event: WorldEvent) -> Mission:
    """Return a mission whose agents' starts say nothing: robots in the air have left theirs."""
    if isinstance(event, RobotJoins):
        return _alone(mission, event.robot, event.agent)
    smallest = min(mission.agents, key=lambda name: mission.vehicle_of(name).radius, default=None)
    vehicle = mission.vehicle if smallest is None else mission.vehicle_of(smallest)
    kind = None if smallest is None else mission.kind_of(smallest)
    parked = Agent(start=_corner(mission, vehicle.radius), vehicle=vehicle, robot=kind)
    return _alone(mission, "parked", parked)


def _alone(mission: Mission, robot: str, agent: Agent) -> Mission:
    """Return a mission of one robot; whoever the formula names is that one."""
    spec = mission.spec
    if any(node.robot for node in mission.written.nodes()):  # reading it refuses names that are none of this team
        spec = spec.model_copy(update={"formula": str(_naming(mission.written, robot))})
    return changed(mission, agents={robot: agent}, spec=spec)


def _naming(formula: Formula, robot: str) -> Formula:
    if formula.robot:
        return replace(formula, robot=robot)
    return replace(formula, arguments=tuple(_naming(part, robot) for part in formula.arguments))


def _corner(mission: Mission, radius: float) -> Point:
    """Return the point of the workspace, away from its walls and clear of solid bodies, that is farthest from all regions."""
    low, high = np.array(mission.workspace.min), np.array(mission.workspace.max)
    inset = np.minimum((high - low) / 2, mission.margin + 0.1)
    corners = np.stack(np.meshgrid(*zip(low + inset, high - inset, strict=True)), axis=-1).reshape(-1, 3)
    if parts := solid_parts(mission.obstacles, mission.hoops):
        axes = (np.linspace(a, b, _PLACES) for a, b in zip(low + inset, high - inset, strict=True))
        corners = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)
        far = np.min([part.distances(corners) for part in parts], axis=0)
        need = radius + mission.margin + 1e-3
        corners = corners[far > need] if np.any(far > need) else corners
    centres = np.array([region.center for region in mission.all_regions.values()]).reshape(-1, 3)
    if not len(centres):
        return tuple(float(x) for x in corners[0])  # pyright: ignore[reportReturnType]  # three numbers
    away = np.linalg.norm(corners[:, None] - centres[None], axis=-1).min(axis=1)
    return tuple(float(x) for x in corners[int(np.argmax(away))])  # pyright: ignore[reportReturnType]  # three numbers


def rim_distance(point: Point, hoop: Hoop) -> float:
    """Distance from a point to the solid ring, m."""
    offset, normal = np.array(point) - np.array(hoop.center), np.array(hoop.normal)
    along = float(offset @ normal)
    across = float(np.linalg.norm(offset - along * normal))
    radial = max(hoop.opening - across, across - hoop.opening - hoop.rim, 0.0)
    return math.hypot(radial, max(abs(along) - hoop.rim / 2, 0.0))
