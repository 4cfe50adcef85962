"""A recorded flight as the page shows it: the verdict, claim by claim, and where the robots were. Run by a worker."""

from __future__ import annotations

import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ltlplan.service.recordings import RecordingAsked, put_recording
from verify.data import BadInput
from verify.data.progress import Progress

MOST_DOTS = 2000
"""Recorded places of a robot that are drawn at most."""

_WORDS = {"holds": "satisfied", "fails": "violated", "undecided": "the samples cannot tell"}


def recording_asked(fields: Mapping[str, str]) -> RecordingAsked:
    """Return what a person says of a recording. A field that is empty says nothing.

    Args:
        fields: As they were typed, by the names of `RecordingAsked`.

    Raises:
        BadInput: A field holds no number where it must.
    """
    given = {name: text.strip() for name, text in fields.items() if text.strip()}
    return RecordingAsked(
        max_speed=_number(given, "max_speed", None),
        error=_number(given, "error", 0.0) or 0.0,
        start=given.get("start"),
        start_error=_number(given, "start_error", 0.0) or 0.0,
        called=_listed(given.get("called", ""), "[;,]"),
        axes=given.get("axes"),
        origin=_listed(given.get("origin", ""), ";"),
        pauses=tuple(_finite(text, "pauses") for text in _listed(given.get("pauses", ""), r"[;,\s]")),
    )


def _listed(text: str, between: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in re.split(between, text) if part.strip())


def _number(given: Mapping[str, str], name: str, missing: float | None) -> float | None:
    return _finite(given[name], name) if name in given else missing


def _finite(text: str, name: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value) or value < 0 or (name == "max_speed" and value == 0):
        raise BadInput(f"'{text[:60]}' is not a number that {name.replace('_', ' ')} can be; write one such as 1.5.")
    return value


def judged(
    folder: Path, files: tuple[tuple[str, str], ...], recording: bytes, said: RecordingAsked, report: Progress
) -> dict[str, Any]:  # of any type: JSON nests
    """Check a recorded flight for the page.

    Args:
        folder: Empty, for use meanwhile.
        files: What the job has made: names, and where their bytes lie.
        recording: The recorded flight.
        said: What a person says of it.
        report: Receives what is done.

    Returns:
        `words`, `sentence`, `claims`, `assumptions`, and by robot the places where it was seen (`flown`).

    Raises:
        BadInput: The recording cannot be checked.
    """
    from ltlplan.recorded import judge_flight
    from ltlplan.recording_options import told_of
    from ltlplan.service.queries import without_places
    from ltlplan.service.views.watching import claims_data

    told = told_of(said.start, said.start_error, said.called, said.axes, said.origin)
    run = folder / "run"
    for name, source in files:
        (run / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, run / name)
    flown = put_recording(folder, recording)
    with without_places(folder):
        found = judge_flight(
            run, flown, max_speed=said.max_speed, error=said.error, told=told, pauses=said.pauses, progress=report
        )
    positions = {name: np.asarray(track, dtype=float) for name, track in found.samples.positions.items()}
    return {
        "words": _WORDS[found.verdict.outcome],
        "sentence": found.verdict.sentence,
        "claims": claims_data(found.verdict),
        "assumptions": list(found.verdict.assumptions),
        "flown": {name: _thinned(track) for name, track in positions.items()},
    }


def _thinned(track: np.ndarray[Any, np.dtype[np.float64]]) -> list[list[float]]:
    known = track[np.isfinite(track).all(axis=1)]
    return np.round(known[:: max(1, len(known) // MOST_DOTS)], 4).tolist()
