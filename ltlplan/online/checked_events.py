"""Events that change the world of an online flight, checked before take-off, and what a region does that moves onto a robot.

Everything that can be known to be wrong before take-off (an unknown name, a hoop outside the workspace, a formula that cannot be
read) is said before take-off. The events themselves are `verify.data.events`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from verify.data import BadInput, Mission, MissionError
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
from verify.data.shapes.inequalities import Point
from verify.data.shapes.region import Hoop
from verify.data.shapes.solid_parts import solid_parts
from verify.data.validation.faults import Fault

_APART = ("separation", "separation_z")
"""Keys of a mission that say how far apart robots keep."""


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
            _require_sound(mission, event, present)
        except (ValueError, BadInput) as error:
            raise BadInput(f"At {event.time:g} s {event}: {error}") from None
    return ordered


def _require_sound(mission: Mission, event: WorldEvent, present: Sequence[str]) -> None:
    """Refuse a mission with faults that an event brings: robots in the air have left the starts that the rules ask about.

    Raises:
        MissionError: It has some.
    """
    found = [fault for fault in _faults(mission) if fault.keys[0] not in (*_APART, "agents")]
    if isinstance(event, RobotJoins):
        team = changed(mission, agents={name: mission.agents[name] for name in present})
        found += [fault for fault in _faults(team) if fault.keys[0] in _APART]
        alone = changed(mission, agents={event.robot: event.agent})
        found += [fault for fault in _faults(alone) if fault.keys[0] == "agents"]
    if found:
        raise MissionError(mission.name, found)


def _faults(mission: Mission) -> Sequence[Fault]:
    try:
        check_mission(mission)
    except MissionError as error:
        return error.faults
    return ()


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


def rim_distance(point: Point, hoop: Hoop) -> float:
    """Distance from a point to the solid ring, m."""
    offset, normal = np.array(point) - np.array(hoop.center), np.array(hoop.normal)
    along = float(offset @ normal)
    across = float(np.linalg.norm(offset - along * normal))
    radial = max(hoop.opening - across, across - hoop.opening - hoop.rim, 0.0)
    return math.hypot(radial, max(abs(along) - hoop.rim / 2, 0.0))
