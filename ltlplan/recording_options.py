"""Options of a recording as text, on the command line or in a form: pairs such as `quad0=cf231`, one start or one a robot, origins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flight import RecordingOptions


def told_of(
    start: str | None, start_error: float, called: Sequence[str], axes: str | None, origin: Sequence[str]
) -> RecordingOptions:
    """Read what is told of a recording.

    Args:
        start: s, or s by robot (`quad0=3.2,quad1=5.7`); None where nobody says it.
        start_error: How far it may be off, s.
        called: Pairs, what we call it first.
        axes: The mission's x, y, z in the recording's axes.
        origin: m (`1,2,0`), or m by robot (`quad0=1,2,0`).

    Raises:
        BadInput: One of them is not written so, or said twice.
    """
    from flight import RecordingOptions
    from verify.data import BadInput

    if start is None and start_error:
        raise BadInput("--start-error says how far --start may be off; give --start as well.")
    names: dict[str, str] = {}
    for pair in called:
        ours, equals, theirs = pair.partition("=")
        if not equals or not ours.strip() or not theirs.strip():
            raise BadInput(
                f"--rename is {pair[:60]!r}; it must be what we call it, = and what the recording calls it: quad0=cf231."
            )
        if ours.strip() in names:
            raise BadInput(f"--rename says twice what {ours.strip()[:40]} is called.")
        names[ours.strip()] = theirs.strip()
    places: dict[str, tuple[float, float, float]] = {}
    for text in origin:
        robot, equals, numbers = text.rpartition("=")
        place = [_number(part) for part in numbers.split(",")]
        if len(place) != 3 or None in place or (equals and not robot.strip()):
            raise BadInput(f"--origin is {text[:60]!r}; it must be x,y,z in m, or a robot's: quad0=1.5,0,0.")
        if robot.strip() in places:
            raise BadInput(f"--origin is given twice for {robot.strip()[:40] or 'all robots'}.")
        x, y, z = (value or 0.0 for value in place)
        places[robot.strip()] = (x, y, z)
    return RecordingOptions(_start(start), start_error, names, axes or "", places)


def in_words(told: RecordingOptions) -> dict[str, list[str]]:
    """Return what `told_of` reads: by option the words for it, one for each time that it is given.

    Args:
        told: What is told of a recording.
    """
    start = told.start
    if isinstance(start, Mapping):
        start = ",".join(f"{robot}={float(seconds)!r}" for robot, seconds in start.items())
    places = {robot: ",".join(repr(float(x)) for x in place) for robot, place in told.origin.items()}
    return {
        "start": [] if start is None else [start if isinstance(start, str) else repr(float(start))],
        "start_error": [repr(float(told.start_error))] if told.start_error else [],
        "called": [f"{ours}={theirs}" for ours, theirs in told.rename.items()],
        "axes": [told.axes] if told.axes else [],
        "origin": [f"{robot}={place}" if robot else place for robot, place in places.items()],
    }


def _start(text: str | None) -> float | dict[str, float] | None:
    """Read one start, or one a robot."""
    from verify.data import BadInput

    if text is None:
        return None
    wrong = BadInput(
        f"--start is {text[:60]!r}; it must be s of the recording's clock, or s of each robot's own: quad0=3.2,quad1=5.7."
    )
    if "=" not in text:
        alone = _number(text)
        if alone is None:
            raise wrong
        return alone
    found: dict[str, float] = {}
    for part in text.split(","):
        robot, _, number = part.rpartition("=")
        value = _number(number)
        if value is None or not robot.strip() or robot.strip() in found:
            raise wrong
        found[robot.strip()] = value
    return found


def _number(text: str) -> float | None:
    """Read a finite number; None where it is none."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if value - value == 0 else None
