"""Sentences on what an event will do to a flight in the air, before it is sent: by the flight's own rules, in a worker."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from ltlplan.online.checked_events import falls_on, in_order
from ltlplan.online.event_sources.lines import event_told
from ltlplan.service.live_view.messages import Frame, Shown
from verify.data import BadInput, parse_mission
from verify.data.events import HoopMoves, NewFormula, ObstacleAppears, RobotJoins, RobotLeaves

if TYPE_CHECKING:
    from verify.data import Mission
    from verify.data.events import WorldEvent
    from verify.data.progress import Progress

_REST = (
    "All robots in the air go on for 0.3 s, then come to rest in a way that is proved; where none is proved within 2 s, all hold and land. "
    "What is left is planned and proved again, and flown."
)


def foretell(shown: str, frame: str, line: str, report: Progress) -> list[str]:
    """Return what an event will do, a sentence each; whether what is left can be proved is known only when it has come.

    Args:
        shown: The mission as the flight said it last (`Shown`), as JSON.
        frame: Its last frame (`Frame`), as JSON.
        line: The event, as `--follow` has it.
        report: Receives what is done.

    Raises:
        BadInput: It is no event.
    """
    report("looking at the event", 0.0)
    seen = Frame.model_validate_json(frame)
    if not seen.hears:
        return ["Nothing: this flight follows its plan, and takes no events. It can be stopped."]
    event = event_told(line)
    mission = parse_mission(Shown.model_validate_json(shown).mission)
    if seen.ending:
        return ["Nothing: the flight ends, and takes no events any more."]
    positions = {name: robot.at for name, robot in seen.robots.items() if robot.at is not None and robot.acknowledged is None}
    try:
        in_order(mission, (replace(event, time=0.0),))
    except BadInput as error:
        return [f"Nothing: {error}"]
    if isinstance(event, RobotLeaves) and event.robot not in positions:
        return [f"Nothing: {event.robot} is not in the air."]
    if (trouble := falls_on(mission, event, positions)) is not None:
        return [f"The flight ends: {trouble} Then all land."]
    others = [name for name in positions if name != getattr(event, "robot", None)]
    return [*_of(event, mission, others), *([] if isinstance(event, RobotLeaves) and not others else [_REST])]


def _of(event: WorldEvent, mission: Mission, others: list[str]) -> list[str]:
    """Return what is particular to an event."""
    match event:
        case RobotLeaves() if not others:
            return [f"{event.robot} lands where it is, which is not certified. No robot is left in the air: the flight ends."]
        case RobotLeaves():
            return [
                f"{event.robot} lands where it is, which is not certified, and takes no part any more. {', '.join(others)} share what is left."
            ]
        case HoopMoves():
            table = next(table for table in (mission.hoops, mission.regions, mission.obstacles) if event.region in table)
            return [
                f"{event.region} is {math.dist(table[event.region].center, event.center):.2f} m from where it was, for the rest of the flight."
            ]
        case ObstacleAppears():
            return [f"{event.name} is solid from then on, for the rest of the flight."]
        case NewFormula():
            return [f"What is asked of the whole flight, what was flown so far included, is then {event.formula}."]
        case RobotJoins():
            return [
                f"{event.robot} climbs straight up from where it waits and takes part, if it waits there (--standby) and its checks pass."
            ]
