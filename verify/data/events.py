"""World events during a flight: a hoop or a solid body moves, another one appears, a robot fails, leaves or joins, a
formula arrives.

Each event is a value with a time; `apply` returns the mission as it is from then on. A flight in a changing world is written as the
mission at take-off and, beside it, `events.json`: what happened, and when.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Collection, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from verify.data.errors import BadInput, did_you_mean
from verify.data.mission import Mission
from verify.data.sections import Agent
from verify.data.shapes.inequalities import Point
from verify.data.shapes.obstacle import Obstacle
from verify.data.shapes.placed_body import PlacedBody
from verify.data.storage.safe_reading import parse_json, read_bytes

EVENTS_FILE = "events.json"
EVENTS_FORMAT = 1
MAX_BYTES = 10_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class HoopMoves:
    """A hoop, a plain region or an obstacle is somewhere else from now on.

    Attributes:
        time: s.
        region: Which one of them.
        center: m.
        yaw_deg: deg; None leaves it as it was.
    """

    time: float
    region: str
    center: Point
    yaw_deg: float | None = None

    def apply(self, mission: Mission) -> Mission:
        """Return the mission with the region at its new place."""
        table = next(name for name in ("hoops", "regions", "obstacles") if self.region in getattr(mission, name))
        old: PlacedBody = getattr(mission, table)[self.region]
        place = {"center": self.center, "yaw_deg": old.yaw_deg if self.yaw_deg is None else self.yaw_deg}
        return changed(mission, **{table: {**getattr(mission, table), self.region: old.changed(**place)}})

    def __str__(self) -> str:
        return f"{self.region} moves to ({', '.join(f'{x:g}' for x in self.center)})"


@dataclass(frozen=True, slots=True, kw_only=True)
class ObstacleAppears:
    """A solid body is there from now on.

    Attributes:
        time: s.
        name: Its name, that of nothing in the mission.
        obstacle: The body.
    """

    time: float
    name: str
    obstacle: Obstacle

    def apply(self, mission: Mission) -> Mission:
        """Return the mission with one more obstacle."""
        return changed(mission, obstacles={**mission.obstacles, self.name: self.obstacle})

    def __str__(self) -> str:
        return f"{self.name} appears at ({', '.join(f'{x:g}' for x in self.obstacle.center)})"


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
        climbs: When it left the ground to get there, s; None where it hovered there all the time.
    """

    time: float
    robot: str
    agent: Agent
    climbs: float | None = None

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
        """Return the mission with the new formula; its bounds in seconds count from the flight's start."""
        asked = changed(mission, spec=mission.spec.model_copy(update={"formula": self.formula}))
        if asked.timed_parts and "pace" not in mission.planner.model_fields_set:  # as of a mission that is read
            return changed(asked, planner=mission.planner.model_copy(update={"pace": 1.0}))
        return asked

    def __str__(self) -> str:
        return f"the formula is now {self.formula}"


WorldEvent = HoopMoves | ObstacleAppears | RobotLeaves | RobotJoins | NewFormula


def changed(mission: Mission, **parts: Any) -> Mission:  # of any type: pydantic looks at them
    """Return a mission with other parts, built anew so that nothing that was computed from the old ones stays."""
    return Mission.model_validate({**{name: getattr(mission, name) for name in Mission.model_fields}, **parts})


def events_to_json(events: Iterable[WorldEvent]) -> str:
    """Return events.json: what happened, in order of time."""
    return json.dumps({"format": EVENTS_FORMAT, "events": [_data(event) for event in events]}, indent=1, allow_nan=False) + "\n"


def load_events(path: str | Path) -> tuple[WorldEvent, ...]:
    """Read events.json again.

    Raises:
        BadInput: It is unreadable, of another format, or holds something that is no event; events go forward in time.
    """
    source = str(path)
    value = parse_json(read_bytes(path, most=MAX_BYTES, what="list of events"), source)
    if not isinstance(value, dict) or set(value) != {"format", "events"} or not isinstance(value["events"], list):
        raise BadInput(f'{source} must be an object with "format": {EVENTS_FORMAT} and a list of "events".')
    if value["format"] != EVENTS_FORMAT or isinstance(value["format"], bool):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput(f'{source} must have "format": {EVENTS_FORMAT}, not {str(value["format"])[:40]}.')
    events = tuple(_event(entry, f"{source}, event {index}") for index, entry in enumerate(value["events"]))
    for before, after in itertools.pairwise(events):
        if after.time < before.time:
            raise BadInput(f"{source}: events must go forward in time, but {after.time:g} s follows {before.time:g} s.")
    return events


def require_known(mission: Mission, event: WorldEvent) -> None:
    """Reject an event that names a region or a robot that the mission does not have, or a robot that it has already.

    Raises:
        BadInput: As said, with what there is.
    """
    match event:
        case HoopMoves() if event.region not in {**mission.all_regions, **mission.obstacles}:
            what = "region or obstacle" if mission.obstacles else "region"
            raise BadInput(unknown(event.region, what, {**mission.all_regions, **mission.obstacles}))
        case ObstacleAppears() if event.name in {**mission.all_regions, **mission.obstacles}:
            raise BadInput(
                f"'{event.name}' is a region or an obstacle of this mission already; what appears needs another name."
            )
        case RobotLeaves() if event.robot not in mission.agents:
            raise BadInput(unknown(event.robot, "robot in the air", mission.agents))
        case RobotJoins() if event.robot in mission.agents:
            raise BadInput(f"'{event.robot}' is a robot of this mission already; one that joins needs another name.")
        case _:
            pass


def unknown(name: str, what: str, known: Collection[str]) -> str:
    """Say that a name is not known, with the nearest one and all that are.

    Args:
        name: What was written.
        what: What it should name, such as "region".
        known: The names that there are.
    """
    return f"'{name}' is not a {what}.{did_you_mean(name, known)} There are: {', '.join(known) or '(none)'}."


def _data(event: WorldEvent) -> dict[str, Any]:
    data = {"event": _KINDS[type(event)], **asdict(event)}
    if isinstance(event, RobotJoins):
        data["agent"] = event.agent.model_dump(mode="json")
        if event.climbs is None:
            del data["climbs"]
    if isinstance(event, ObstacleAppears):
        data["obstacle"] = event.obstacle.model_dump(mode="json", by_alias=True, exclude_none=True)
    return data


def _event(entry: Any, source: str) -> WorldEvent:
    kinds = {name: kind for kind, name in _KINDS.items()}
    if not isinstance(entry, dict) or entry.get("event") not in kinds:
        raise BadInput(f"{source}: 'event' must be one of {', '.join(kinds)}.")
    kind, values = kinds[entry["event"]], {key: value for key, value in entry.items() if key != "event"}
    fields = set(kind.__dataclass_fields__)
    if set(values) != fields and set(values) != fields - _MAY_BE_LEFT_OUT:
        raise BadInput(f"{source} must have the keys event, {', '.join(sorted(fields))}.")
    for key, (test, wanted) in _SHAPE.items():
        if key in values and not test(values[key]):
            raise BadInput(f"{source}: '{key}' must be {wanted}.")
    if "center" in values:
        values["center"] = tuple(float(x) for x in values["center"])
    for key, made in (("agent", Agent), ("obstacle", Obstacle)):
        if key in values:
            try:
                values[key] = made.model_validate(values[key])
            except ValidationError as error:
                first = error.errors()[0]
                raise BadInput(f"{source}, {key}, {'.'.join(map(str, first['loc']))}: {first['msg']}.") from None
    return kind(**values)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


_KINDS: dict[type, str] = {
    HoopMoves: "moves", ObstacleAppears: "appears", RobotLeaves: "leaves", RobotJoins: "joins", NewFormula: "formula"
}  # fmt: skip
_MAY_BE_LEFT_OUT = {"climbs"}
_SHAPE: dict[str, tuple[Callable[[Any], bool], str]] = {  # tests of any type: what a file may hold
    "time": (lambda v: _is_number(v) and v >= 0, "a number of seconds, at least 0"),
    "region": (lambda v: isinstance(v, str), "a name"),
    "robot": (lambda v: isinstance(v, str), "a name"),
    "fails": (lambda v: isinstance(v, bool), "true or false"),
    "formula": (lambda v: isinstance(v, str), "a text"),
    "center": (lambda v: isinstance(v, list) and len(v) == 3 and all(map(_is_number, v)), "three numbers, m"),
    "yaw_deg": (lambda v: v is None or _is_number(v), "a number of degrees, or null"),
    "agent": (lambda v: isinstance(v, dict), "an object"),
    "name": (lambda v: isinstance(v, str), "a name"),
    "climbs": (lambda v: v is None or (_is_number(v) and v >= 0), "a number of seconds, at least 0, or null"),
    "obstacle": (lambda v: isinstance(v, dict), "an object"),
}
