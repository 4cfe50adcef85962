"""What can change in the world while a team flies online: a hoop moves, a robot fails, leaves or joins, a formula arrives.

Each event is a value with a time; `apply` returns the mission as it is from then on. Everything that can be known to be
wrong before take-off (an unknown name, a hoop outside the workspace, a formula that cannot be read) is said before take-off.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from verify.data import BadInput, Mission
from verify.data.errors import did_you_mean
from verify.data.mission import Agent, Hoop, Point, Region
from verify.data.mission_file import check_mission


@dataclass(frozen=True, slots=True, kw_only=True)
class HoopMoves:
    """A hoop or plain region is somewhere else from now on.

    Attributes:
        time: s.
        region: Which one.
        center: m.
        yaw_deg: deg; None leaves it as it was.
    """

    time: float
    region: str
    center: Point
    yaw_deg: float | None = None

    def apply(self, mission: Mission) -> Mission:
        """Return the mission with the region at its new place."""
        table = "hoops" if self.region in mission.hoops else "regions"
        old: Region = mission.all_regions[self.region]
        values = {k: v for k, v in old.model_dump().items() if k not in ("matrix", "normal")}
        values["center"] = self.center
        if self.yaw_deg is not None:
            values["yaw_deg"] = self.yaw_deg
        moved = (Hoop if table == "hoops" else Region).model_validate(values)
        return changed(mission, **{table: {**getattr(mission, table), self.region: moved}})

    def __str__(self) -> str:
        return f"{self.region} moves to ({', '.join(f'{x:g}' for x in self.center)})"


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotLeaves:
    """A robot fails, or is taken out: it lands where it is, and its last letter stays what it was.

    Attributes:
        time: s.
        robot: Which one.
        fails: Whether it fails rather than leaves; for the words that are said.
    """

    time: float
    robot: str
    fails: bool = True

    def apply(self, mission: Mission) -> Mission:
        """Return the mission as it is; who is in the air is the team's affair."""
        return mission

    def __str__(self) -> str:
        return f"{self.robot} {'fails' if self.fails else 'leaves'} and lands"


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotJoins:
    """A robot that hovered ready outside the team takes part from now on.

    Attributes:
        time: s.
        robot: Its name, not one of the mission's.
        agent: Where it hovers, its heading and costs.
    """

    time: float
    robot: str
    agent: Agent

    def apply(self, mission: Mission) -> Mission:
        """Return the mission with one more agent."""
        return changed(mission, agents={**mission.agents, self.robot: self.agent})

    def __str__(self) -> str:
        return f"{self.robot} joins"


@dataclass(frozen=True, slots=True, kw_only=True)
class NewFormula:
    """Another formula is asked of the whole flight, what was flown so far included.

    Attributes:
        time: s.
        formula: As in a mission file.
    """

    time: float
    formula: str

    def apply(self, mission: Mission) -> Mission:
        """Return the mission with the new formula."""
        return changed(mission, spec=mission.spec.model_copy(update={"formula": self.formula}))

    def __str__(self) -> str:
        return f"the formula is now {self.formula}"


WorldEvent = HoopMoves | RobotLeaves | RobotJoins | NewFormula


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
        match event:
            case HoopMoves():
                if event.region not in mission.all_regions:
                    raise BadInput(_unknown(event.region, "region", mission.all_regions))
            case RobotLeaves():
                if event.robot not in present:
                    raise BadInput(_unknown(event.robot, "robot in the air", present))
                present.remove(event.robot)
            case RobotJoins():
                if event.robot in mission.agents:
                    raise BadInput(f"'{event.robot}' is a robot of this mission already; one that joins needs another name.")
                present.append(event.robot)
            case NewFormula():
                pass
        try:
            mission = event.apply(mission)
            # agents have left their starts: only what the event brings is held against the rest
            check_mission(_for_check(mission, event))
        except ValueError as error:
            raise BadInput(f"At {event.time:g} s {event}: {error}") from None
        except BadInput as error:
            raise BadInput(f"At {event.time:g} s {event}: {error}") from None
    return ordered


def falls_on(mission: Mission, event: WorldEvent, positions: dict[str, Point]) -> str | None:
    """Return a sentence where a region that moves comes onto a robot, or None."""
    if not isinstance(event, HoopMoves):
        return None
    region = event.apply(mission).all_regions[event.region]
    need = mission.vehicle.radius + mission.margin
    for robot, position in positions.items():
        if float(region.level(np.array(position))) <= (1 + mission.margin / min(region.radii)) ** 2:
            return f"{event.region} moves onto {robot}, which is inside it at once; the robots hold their positions."
        if isinstance(region, Hoop) and rim_distance(position, region) <= need:
            return f"The rim of {event.region} moves onto {robot}, within {need:.3f} m; the robots hold their positions."
    return None


def changed(mission: Mission, **parts: Any) -> Mission:
    """Return a mission with other parts, built anew so that nothing that was computed from the old ones stays."""
    return Mission.model_validate({**{name: getattr(mission, name) for name in Mission.model_fields}, **parts})


def _for_check(mission: Mission, event: WorldEvent) -> Mission:
    """Return a mission whose agents' starts say nothing: robots in the air have left theirs."""
    if isinstance(event, RobotJoins):
        return changed(mission, agents={event.robot: event.agent})
    parked = Agent(start=_corner(mission))
    return changed(mission, agents={"parked": parked})


def _corner(mission: Mission) -> Point:
    """Return the point of the workspace, away from its walls, that is farthest from all regions."""
    low, high = np.array(mission.workspace.min), np.array(mission.workspace.max)
    inset = np.minimum((high - low) / 4, mission.margin + 0.1)
    corners = np.stack(np.meshgrid(*zip(low + inset, high - inset, strict=True)), axis=-1).reshape(-1, 3)
    centres = np.array([region.center for region in mission.all_regions.values()]).reshape(-1, 3)
    if not len(centres):
        return tuple(float(x) for x in corners[0])  # pyright: ignore[reportReturnType]  # three numbers
    away = np.linalg.norm(corners[:, None] - centres[None], axis=-1).min(axis=1)
    return tuple(float(x) for x in corners[int(np.argmax(away))])  # pyright: ignore[reportReturnType]  # three numbers


def _unknown(name: str, what: str, known: Iterable[str]) -> str:
    return f"'{name}' is not a {what}.{did_you_mean(name, known)} There are: {', '.join(known) or '(none)'}."


def rim_distance(point: Point, hoop: Hoop) -> float:
    """Distance from a point to the solid ring, m."""
    offset, normal = np.array(point) - np.array(hoop.center), np.array(hoop.normal)
    along = float(offset @ normal)
    across = float(np.linalg.norm(offset - along * normal))
    radial = max(hoop.opening - across, across - hoop.opening - hoop.rim, 0.0)
    return math.hypot(radial, max(abs(along) - hoop.rim / 2, 0.0))
