"""A tester's half of the client: campaigns and rehearsals of a job's flight, and recordings that are kept with it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ltlplan.recording_options import in_words
from ltlplan.service.client_parts.job_handle import Submitted
from ltlplan.service.client_parts.transport import Wire, checked, job_of, segment
from ltlplan.service.models import DerivedKind, Job
from ltlplan.service.queries import zipped
from ltlplan.service.recordings import ENDINGS
from verify.data.storage.safe_reading import read_bytes

if TYPE_CHECKING:
    from flight import RecordingOptions

_RECORDING = 400_000_000
"""Bytes of a recording, all of its files together."""

Part = tuple[str, tuple[str, bytes, str]]


class DerivedClient:
    """A service, as those who try flights ask it."""

    _wire: Wire

    def campaign(self, job: Submitted | str, **options: Any) -> Submitted:  # of any type: each option has its own
        """Fly a job's certified flight many times in simulation, there, as a job of its own; its files are those of `ltlplan campaign`.

        Args:
            job: A job, or its id.
            options: Those of the command: runs, seed, wind, noise, model, controller, estimator, latency, mass.

        Raises:
            LtlplanError: The job has no flight, or there are no such conditions.
        """
        return self._derive(job, "campaigns", options)

    def rehearse(self, job: Submitted | str, **options: Any) -> Submitted:  # of any type: each option has its own
        """Rehearse a job's certified flight there, as a job of its own; its files are those of `ltlplan rehearse`.

        Args:
            job: A job, or its id.
            options: Those of the command, lists in the plural: runs, seed, controllers, masses, latencies, winds, drags, corners, hunt, noise.

        Raises:
            LtlplanError: The job has no flight, or there are no such conditions.
        """
        return self._derive(job, "rehearsals", options)

    def keep_recording(
        self,
        job: Submitted | str,
        recording: str | os.PathLike[str],
        *,
        max_speed: float | None = None,
        error: float = 0.0,
        told: RecordingOptions | None = None,
        pauses: Sequence[float] = (),
    ) -> Submitted:
        """Judge a recorded flight there and keep it with the job: `verdict.json` and the recording are files of the job that is returned.

        Args:
            job: The flight's job, or its id.
            recording: The flight, as `judge_flight` takes it.
            max_speed: Bound on every robot's speed, m/s.
            error: Bound on a position's error, m.
            told: More that the files do not say, such as when it began.
            pauses: How long the team hovered between the parts of a flight in parts, s each.

        Raises:
            LtlplanError: The job has no flight.
        """
        part, data = recording_form(recording, max_speed=max_speed, error=error, told=told, pauses=pauses)
        made = self._wire.ask("POST", f"/api/jobs/{_id(job)}/recordings", data=data, files=[part])
        return Submitted(self._wire, job_of(made.content))

    def derived(self, job: Submitted | str, kind: DerivedKind | None = None) -> tuple[Submitted, ...]:
        """Return the jobs of what was made of a job's flight, the newest first: exports, campaigns, rehearsals, recordings.

        Args:
            job: A job, or its id.
            kind: Only of this kind.
        """
        asked = {} if kind is None else {"kind": kind}
        listed = self._wire.ask("GET", f"/api/jobs/{_id(job)}/derived", params=asked).json()
        return tuple(Submitted(self._wire, checked(Job, each)) for each in listed)

    def _derive(self, job: Submitted | str, what: str, options: dict[str, Any]) -> Submitted:
        given = {name: value for name, value in options.items() if value is not None}
        return Submitted(self._wire, job_of(self._wire.ask("POST", f"/api/jobs/{_id(job)}/{what}", json=given).content))


def recording_form(
    recording: str | os.PathLike[str],
    *,
    max_speed: float | None,
    error: float,
    told: RecordingOptions | None,
    pauses: Sequence[float],
    start: float | None = None,
) -> tuple[Part, dict[str, Any]]:
    """Return a recording as a form sends it: its file, and what is said of it.

    Args:
        recording: The flight: a file, a bag or a folder.
        max_speed: Bound on every robot's speed, m/s.
        error: Bound on a position's error, m.
        told: More that the files do not say, `start` included.
        pauses: s between parts.
        start: When the flight began on the recording's clock, s.
    """
    given = {"max_speed": max_speed, "error": error, "start": start if told is None else None}
    data: dict[str, Any] = {name: repr(float(value)) for name, value in given.items() if value is not None}
    data |= {} if told is None else in_words(told)
    data["pauses"] = [repr(float(pause)) for pause in pauses]
    path = Path(recording)
    name = f"{path.name}.zip" if path.is_dir() else path.name
    return ("recording", (name, _sent(path), "application/octet-stream")), data


def _sent(recording: Path) -> bytes:
    """Return a recording as it is sent: a file as it is, the files of a folder in a ZIP archive."""
    if not recording.is_dir():
        return read_bytes(recording, most=_RECORDING, what="recording")
    files = sorted(path for path in recording.iterdir() if path.suffix in ENDINGS)
    return zipped({path.name: read_bytes(path, most=_RECORDING, what="recording") for path in files})


def _id(job: Submitted | str) -> str:
    return segment(job if isinstance(job, str) else job.id)
