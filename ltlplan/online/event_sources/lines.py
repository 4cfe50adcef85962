"""Events of an online flight as lines of text.

12.5 quad1 fails            12.5 quad1 leaves          12.5 quad3 joins 1.2,0.9,0.8
12.5 water moves 0.3,-0.7,0.9                          12.5 formula F loc1
12.5 crate appears 0.3,-0.7,0.5 0.4,0.4,1.0            (a solid box: its centre, and its full lengths)
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from verify.data import BadInput

if TYPE_CHECKING:
    from verify.data.events import WorldEvent

MOST_LETTERS = 10_000
"""Letters that a line may have which is told in flight."""

_FORMS = (
    "write TIME ROBOT fails, TIME ROBOT leaves, TIME ROBOT joins X,Y,Z, TIME NAME moves X,Y,Z, TIME NAME appears X,Y,Z SX,SY,SZ "
    "or TIME formula FORMULA, such as '12.5 quad1 fails'; what is told in flight may leave TIME out"
)


def parse_events(texts: Sequence[str]) -> tuple[WorldEvent, ...]:
    """Read events.

    Raises:
        BadInput: A text is no event; the message says how one is written.
    """
    return tuple(_event(text, text) for text in texts)


def event_told(line: str) -> WorldEvent:
    """Read an event that is told in flight: its time may be left out, and is 0 then.

    Args:
        line: Such as `quad1 fails`.

    Raises:
        BadInput: It is no event; the message says how one is written.
    """
    text = line.strip()
    if len(text) > MOST_LETTERS:
        raise BadInput(f"{len(text)} letters are no event; one has at most {MOST_LETTERS}: {text[:40]!r}...")
    if not text.isprintable():  # whoever reads it reads it on a terminal
        raise BadInput(f"{text[:200]!r} is no event: it has letters that cannot be shown.")
    try:
        time = float(text.partition(" ")[0])
    except ValueError:
        return _event(f"0 {text}", text)
    if not (math.isfinite(time) and time >= 0):
        raise BadInput(f"'{text}' is no event: its time must be a number of seconds, at least 0.")
    return _event(text, text)


def events_told(lines: Iterable[str]) -> list[WorldEvent | str]:
    """Return the events of lines as they were told; a text where a line is none. Empty lines, and those that begin with `#`, say nothing.

    Args:
        lines: Without their ends.
    """
    found: list[WorldEvent | str] = []
    for line in meant(lines):
        try:
            found.append(event_told(line))
        except BadInput as error:
            found.append(f"Not done: {error}")
    return found


def meant(lines: Iterable[str]) -> list[str]:
    """Return the lines that say something, without spaces around them."""
    stripped = (line.strip() for line in lines)
    return [line for line in stripped if line and not line.startswith("#")]


def _event(text: str, said: str) -> WorldEvent:
    """Return the event of a text with a time; `said` is what was written."""
    from pydantic import ValidationError

    from verify.data.events import HoopMoves, NewFormula, ObstacleAppears, RobotJoins, RobotLeaves
    from verify.data.sections import Agent
    from verify.data.shapes.obstacle import Obstacle
    from verify.data.value import faults_of

    first, _, rest = text.strip().partition(" ")
    try:
        time = float(first)
    except ValueError:
        raise BadInput(f"'{said}' is no event: {_FORMS}.") from None
    words = rest.split()
    match words:
        case ["formula", *_]:
            return NewFormula(time=time, formula=rest.strip().removeprefix("formula").strip())
        case [robot, "fails" | "leaves" as how]:
            return RobotLeaves(time=time, robot=robot, fails=how == "fails")
        case [robot, "joins", place]:
            return RobotJoins(time=time, robot=robot, agent=Agent(start=_point(place, said)))
        case [name, "appears", place, size]:
            box = {"center": _point(place, said), "size": _point(size, said)}
            try:
                return ObstacleAppears(time=time, name=name, obstacle=Obstacle.model_validate(box))
            except ValidationError as error:
                raise BadInput(f"'{said}' is no event: {' '.join(faults_of(error, name))}") from None
        case [region, "moves", place]:
            return HoopMoves(time=time, region=region, center=_point(place, said))
        case _:
            raise BadInput(f"'{said}' is no event: {_FORMS}.")


def _point(place: str, text: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(part) for part in place.split(","))
    except ValueError:
        x = y = z = math.nan
    if not all(map(math.isfinite, (x, y, z))):
        raise BadInput(f"'{text}' is no event: '{place}' must be three numbers X,Y,Z in m.")
    return (x, y, z)
