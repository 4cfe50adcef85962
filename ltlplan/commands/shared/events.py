"""What changes during an online flight, as text on the command line.

12.5 quad1 fails            12.5 quad1 leaves          12.5 quad3 joins 1.2,0.9,0.8
12.5 water moves 0.3,-0.7,0.9                          12.5 formula F loc1
12.5 crate appears 0.3,-0.7,0.5 0.4,0.4,1.0            (a solid box: its centre, and its full lengths)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from verify.data import BadInput

if TYPE_CHECKING:
    from verify.data.events import WorldEvent

_FORMS = (
    "write TIME ROBOT fails, TIME ROBOT leaves, TIME ROBOT joins X,Y,Z, TIME NAME moves X,Y,Z, TIME NAME appears X,Y,Z SX,SY,SZ "
    "or TIME formula FORMULA, "
    "such as '12.5 quad1 fails'"
)


def parse_events(texts: Sequence[str]) -> tuple[WorldEvent, ...]:
    """Read events.

    Raises:
        BadInput: A text is no event; the message says how one is written.
    """
    return tuple(_event(text) for text in texts)


def event_told(line: str) -> WorldEvent:
    """Read an event that is told in flight: its time may be left out, and is 0 then.

    Args:
        line: Such as `quad1 fails`.

    Raises:
        BadInput: It is no event; the message says how one is written.
    """
    first = line.strip().partition(" ")[0]
    try:
        float(first)
    except ValueError:
        return _event(f"0 {line.strip()}")
    return _event(line)


def _event(text: str) -> WorldEvent:
    from pydantic import ValidationError

    from verify.data.events import HoopMoves, NewFormula, ObstacleAppears, RobotJoins, RobotLeaves
    from verify.data.sections import Agent
    from verify.data.shapes.obstacle import Obstacle
    from verify.data.value import faults_of

    first, _, rest = text.strip().partition(" ")
    try:
        time = float(first)
    except ValueError:
        raise BadInput(f"'{text}' is no event: {_FORMS}.") from None
    words = rest.split()
    match words:
        case ["formula", *_]:
            return NewFormula(time=time, formula=rest.strip().removeprefix("formula").strip())
        case [robot, "fails" | "leaves" as how]:
            return RobotLeaves(time=time, robot=robot, fails=how == "fails")
        case [robot, "joins", place]:
            return RobotJoins(time=time, robot=robot, agent=Agent(start=_point(place, text)))
        case [name, "appears", place, size]:
            box = {"center": _point(place, text), "size": _point(size, text)}
            try:
                return ObstacleAppears(time=time, name=name, obstacle=Obstacle.model_validate(box))
            except ValidationError as error:
                raise BadInput(f"'{text}' is no event: {' '.join(faults_of(error, name))}") from None
        case [region, "moves", place]:
            return HoopMoves(time=time, region=region, center=_point(place, text))
        case _:
            raise BadInput(f"'{text}' is no event: {_FORMS}.")


def _point(place: str, text: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(part) for part in place.split(","))
    except ValueError:
        raise BadInput(f"'{text}' is no event: '{place}' must be three numbers X,Y,Z in m.") from None
    return (x, y, z)
