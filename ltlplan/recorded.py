"""Recorded flights, held against what was asked of them: the way from two files to a verdict."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict

from verify.data.progress import Progress, silent

if TYPE_CHECKING:
    from verify import FlightVerdict
    from verify.recordings.flight_log import Samples


class Bounds(TypedDict, total=False):
    """What is known of a recording, as keywords of `judge_flight`."""

    max_speed: float
    error: float
    start: float


def bounds_of(values: Mapping[str, float | None]) -> Bounds:
    """Return the bounds that are given: `max_speed` (m/s), `error` (m) and `start` (s)."""
    found: Bounds = {}
    for name in ("max_speed", "error", "start"):
        if (value := values.get(name)) is not None:
            found[name] = value
    return found


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recorded flight, judged.

    Attributes:
        mission: Name of the mission that was flown.
        verdict: What the recording shows, claim by claim.
        samples: What was measured.
    """

    mission: str
    verdict: FlightVerdict
    samples: Samples


# seven parameters: the two files, and what is known of the recording, each by its keyword
def judge_flight(
    source: str | os.PathLike[str],
    recording: str | os.PathLike[str],
    *,
    max_speed: float | None = None,
    error: float = 0.0,
    start: float | None = None,
    pauses: Sequence[float] = (),
    progress: Progress | None = None,
) -> Recorded:
    """Judge a recorded flight, claim by claim, for all times between its samples too.

    Args:
        source: What it was to do: a run's folder, or a mission file.
        recording: The flight: a log of ours, or a table of motion capture.
        max_speed: Bound on every robot's speed, m/s.
        error: Bound on a position's error, m.
        start: When the flight began on the recording's clock, s; None where it is to be found.
        pauses: How long the team hovered between the parts of a flight in parts, s each.
        progress: Told a sentence and the share done, 0 to 1.

    Raises:
        NotCertified: The folder's certificate is not proved any more, or a file was changed since.
        BadInput: A file is missing or unreadable, or the recording cannot be judged.
    """
    from flight import read_recording
    from verify import check_flight
    from verify.recordings.asked import asked_of
    from verify.recordings.flight_log import Samples, load_flight_log

    asked = asked_of(Path(source), pauses)
    if _is_our_log(recording):
        samples, begin = load_flight_log(recording, asked.mission), 0.0 if start is None else start
    else:
        table = read_recording(recording, tuple(asked.mission.agents), start=start)
        samples = Samples(
            table.times, {name: table.position[:, j] for j, name in enumerate(table.robots)}, rounding=table.rounding
        )
        begin = None if start is None else 0.0
    (progress or silent)("judging the recording", 0.0)
    verdict = check_flight(samples, asked, max_speed=max_speed, error=error, start=begin)
    return Recorded(asked.mission.name, verdict, samples)


def _is_our_log(path: str | os.PathLike[str]) -> bool:
    """Tell a log of ours, which holds internal propositions, from a table of motion capture."""
    from flight.logs.log import COLUMNS
    from verify.data.storage.reading import begins_with

    return begins_with(path, ",".join(COLUMNS).encode(), "recording")
