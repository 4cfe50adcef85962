"""Recorded flights, compared with what was asked of them: the way from two files to a verdict."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from verify.data.progress import Progress, silent

if TYPE_CHECKING:
    from flight import RecordingOptions
    from verify import FlightVerdict
    from verify.data import Mission
    from verify.recordings.flight_log import Samples
    from verify.recordings.flight_reference import FlightReference


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recorded flight, checked.

    Attributes:
        mission: Name of the mission that was flown.
        verdict: What the recording shows, claim by claim.
        samples: What was measured.
        asked: What it was compared with.
    """

    mission: str
    verdict: FlightVerdict
    samples: Samples
    asked: FlightReference


# eight parameters: the two files, and what is known of the recording, each by its keyword
def judge_flight(
    source: str | os.PathLike[str],
    recording: str | os.PathLike[str],
    *,
    max_speed: float | None = None,
    error: float = 0.0,
    start: float | None = None,
    told: RecordingOptions | None = None,
    pauses: Sequence[float] = (),
    progress: Progress | None = None,
) -> Recorded:
    """Check a recorded flight, claim by claim, for all times between its samples too.

    Args:
        source: What it was to do: a run's folder, or a mission file.
        recording: The flight: a file, a bag or a folder of those kinds that `flight.read_flown` reads.
        max_speed: Bound on every robot's speed, m/s.
        error: Bound on a position's error, m.
        start: When the flight began on the recording's clock, s; None where it is to be found.
        told: More that the files do not say, `start` included.
        pauses: How long the team hovered between the parts of a flight in parts, s each.
        progress: Receives a sentence and the share done, 0 to 1.

    Raises:
        NotCertified: The folder's certificate is not proved any more, or a file was changed since.
        BadInput: A file is missing or unreadable, or the recording cannot be checked.
    """
    from flight import RecordingOptions
    from verify import check_flight
    from verify.recordings.flight_reference import load_reference

    told = RecordingOptions(start=start) if told is None else told
    asked = load_reference(Path(source), pauses)
    (progress or silent)("reading the recording", 0.0)
    if _shows_internal_states(recording):
        samples, begins = _our_log(recording, asked.mission, told)
    else:
        samples, begins = _others(recording, asked, told)
    (progress or silent)("judging the recording", 0.0)
    verdict = check_flight(samples, asked, max_speed=max_speed, error=error, start=begins)
    return Recorded(asked.mission.name, verdict, samples, asked)


_Begins = tuple[float, float] | None
"""From when to when a flight may have begun, s of the samples' clock; None where that is to be found."""


def _our_log(recording: str | os.PathLike[str], mission: Mission, told: RecordingOptions) -> tuple[Samples, _Begins]:
    """Read a log of ours that shows internal states, 0 where the flight began."""
    from flight import read_log
    from verify.data import BadInput
    from verify.recordings.flight_log import load_flight_log, read_flight_log

    told.require_start_only(str(recording))
    if told.rename:
        raise BadInput(
            f"{recording} is a log of ours, in which all is called as in the mission: no other option applies to it."
        )
    if Path(recording).suffix == ".parquet":
        samples = read_flight_log(read_log(recording).to_csv(), str(recording), mission)
    else:
        samples = load_flight_log(recording, mission)
    begins = told.begins(tuple(mission.agents)) or {}
    zero = float(next(iter(begins.values()), 0))
    return replace(samples, times=samples.times - zero, zero=zero), told.began or (0.0, 0.0)


def _others(recording: str | os.PathLike[str], asked: FlightReference, told: RecordingOptions) -> tuple[Samples, _Begins]:
    """Read what others recorded, 0 where the flight began as far as that is told."""
    from flight import read_flown
    from flight.logs.placed import samples_of
    from flight.logs.units import require_seconds

    found = read_flown(recording, tuple(asked.mission.agents), told)
    if asked.team is not None:
        longest = max(path.flattened(asked.mission.spec.repeat).duration for path in asked.team.values())
        require_seconds(found.times, longest)
    if found.zero and not isinstance(told.start, Mapping):
        counted = f"Times are counted from {found.zero:.15g} s of the recording's own clock."
        found = replace(found, notes=(counted, *found.notes))
    return samples_of(found, asked.mission), found.begins


def _shows_internal_states(path: str | os.PathLike[str]) -> bool:
    """Tell a log of ours, as a table, from recordings of others."""
    from verify.data.storage.safe_reading import begins_with
    from verify.recordings.flight_log import LOG_COLUMNS

    if Path(path).is_dir():
        return False
    return Path(path).suffix == ".parquet" or begins_with(path, ",".join(LOG_COLUMNS).encode(), "recording")
