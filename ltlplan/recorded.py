"""Recorded flights, held against what was asked of them: the way from two files to a verdict."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from verify.data.progress import Progress, silent

if TYPE_CHECKING:
    from flight import Told
    from verify import FlightVerdict
    from verify.data import Mission
    from verify.recordings.asked import Asked
    from verify.recordings.flight_log import Samples


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recorded flight, judged.

    Attributes:
        mission: Name of the mission that was flown.
        verdict: What the recording shows, claim by claim.
        samples: What was measured.
        asked: What it was held against.
    """

    mission: str
    verdict: FlightVerdict
    samples: Samples
    asked: Asked


# eight parameters: the two files, and what is known of the recording, each by its keyword
def judge_flight(
    source: str | os.PathLike[str],
    recording: str | os.PathLike[str],
    *,
    max_speed: float | None = None,
    error: float = 0.0,
    start: float | None = None,
    told: Told | None = None,
    pauses: Sequence[float] = (),
    progress: Progress | None = None,
) -> Recorded:
    """Judge a recorded flight, claim by claim, for all times between its samples too.

    Args:
        source: What it was to do: a run's folder, or a mission file.
        recording: The flight: a file, a bag or a folder of those kinds that `flight.read_flown` reads.
        max_speed: Bound on every robot's speed, m/s.
        error: Bound on a position's error, m.
        start: When the flight began on the recording's clock, s; None where it is to be found.
        told: More that the files do not say, `start` included.
        pauses: How long the team hovered between the parts of a flight in parts, s each.
        progress: Told a sentence and the share done, 0 to 1.

    Raises:
        NotCertified: The folder's certificate is not proved any more, or a file was changed since.
        BadInput: A file is missing or unreadable, or the recording cannot be judged.
    """
    from flight import Told
    from verify import check_flight
    from verify.recordings.asked import asked_of

    told = Told(start=start) if told is None else told
    asked = asked_of(Path(source), pauses)
    (progress or silent)("reading the recording", 0.0)
    if _is_our_log(recording):
        samples, begins = _our_log(recording, asked.mission, told)
    else:
        samples, begins = _others(recording, asked, told)
    (progress or silent)("judging the recording", 0.0)
    verdict = check_flight(samples, asked, max_speed=max_speed, error=error, start=begins)
    return Recorded(asked.mission.name, verdict, samples, asked)


_Begins = tuple[float, float] | None
"""From when to when a flight may have begun, s of the samples' clock; None where that is to be found."""


def _our_log(recording: str | os.PathLike[str], mission: Mission, told: Told) -> tuple[Samples, _Begins]:
    """Read a log of ours, whose clock and frame are the mission's."""
    from verify.data import BadInput
    from verify.recordings.flight_log import load_flight_log

    if told.called or told.axes or told.origin or isinstance(told.start, Mapping):
        raise BadInput(
            f"{recording} is a log of ours, on one clock and in the mission's frame: of it only one start may be told."
        )
    begin = 0.0 if told.start is None else told.start
    return load_flight_log(recording, mission), (begin - told.start_error, begin + told.start_error)


def _others(recording: str | os.PathLike[str], asked: Asked, told: Told) -> tuple[Samples, _Begins]:
    """Read what others recorded, brought to the mission's frame, 0 where the flight began as far as that is told."""
    from flight import read_flown
    from flight.logs.units import require_metres, require_seconds
    from verify.recordings.flight_log import Samples

    mission = asked.mission
    found = read_flown(recording, tuple(mission.agents), told)
    require_metres(found.position, mission)
    if asked.team is not None:
        longest = max(path.flattened(mission.spec.repeat).duration for path in asked.team.values())
        require_seconds(found.times, longest)
    position = found.position if mission.frame is None else mission.frame.to_mission(found.position)
    framed = (
        () if mission.frame is None else (f"The recording's frame is the laboratory's: {mission.frame.sentence} (`frame`).",)
    )
    places = {name: position[:, j] for j, name in enumerate(found.robots)}
    counted = (
        ()
        if isinstance(told.start, Mapping) or not found.zero
        else (f"Times are counted from {found.zero:.15g} s of the recording's own clock.",)
    )
    samples = Samples(found.times, places, rounding=found.rounding, notes=(*counted, *found.notes, *framed), zero=found.zero)
    if told.start is None:
        return samples, None
    off = 0.0 if isinstance(told.start, Mapping) else told.start_error  # of several clocks it is part of the times' own error
    return samples, (0.0 - off, off)


def _is_our_log(path: str | os.PathLike[str]) -> bool:
    """Tell a log of ours, which holds internal propositions, from recordings of others."""
    from flight.logs.log import COLUMNS
    from verify.data.storage.reading import begins_with

    return not Path(path).is_dir() and begins_with(path, ",".join(COLUMNS).encode(), "recording")
