"""A recorded flight as the page shows it: the verdict, claim by claim, and where the robots were. Run by a worker."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np

from ltlplan.service.recordings import RecordingAsked, put_recording
from verify.data.progress import Progress

MOST_DOTS = 2000
"""Recorded places of a robot that are drawn at most."""

Data = dict[str, Any]  # of any type: JSON nests

_WORDS = {"holds": "satisfied", "fails": "violated", "undecided": "the samples cannot tell"}


def judged(folder: Path, files: tuple[tuple[str, str], ...], recording: bytes, said: RecordingAsked, report: Progress) -> Data:
    """Check a recorded flight for the page.

    Args:
        folder: Empty, for use meanwhile.
        files: What the job has made: names, and where their bytes lie.
        recording: The recorded flight.
        said: What a person says of it.
        report: Receives what is done.

    Returns:
        As `judged_run`: what is shown.

    Raises:
        BadInput: The recording cannot be checked.
    """
    from ltlplan.service.queries import without_places

    for name, source in files:
        (folder / "run" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, folder / "run" / name)
    with without_places(folder):
        return judged_run(folder, recording, said, report)[1]


def judged_run(folder: Path, recording: bytes, said: RecordingAsked, report: Progress) -> tuple[Data, Data]:
    """Check a recorded flight of a run.

    Args:
        folder: Has what the job has made in its folder `run`, and nothing else.
        recording: The recorded flight.
        said: What is said of it.
        report: Receives what is done.

    Returns:
        The verdict as the API tells it, and what the page shows: `words`, `sentence`, `claims`, `assumptions`, and by robot the places where
        it was seen (`flown`).

    Raises:
        BadInput: The recording cannot be checked.
    """
    from ltlplan.recorded import judge_flight
    from ltlplan.recording_options import told_of
    from ltlplan.service.views.watching import claims_data

    told = told_of(said.start, said.start_error, said.called, said.axes, said.origin)
    flown = put_recording(folder, recording)
    found = judge_flight(
        folder / "run", flown, max_speed=said.max_speed, error=said.error, told=told, pauses=said.pauses, progress=report
    )
    positions = {name: np.asarray(track, dtype=float) for name, track in found.samples.positions.items()}
    shown = {
        "words": _WORDS[found.verdict.outcome],
        "sentence": found.verdict.sentence,
        "claims": claims_data(found.verdict),
        "assumptions": list(found.verdict.assumptions),
        "flown": {name: _thinned(track) for name, track in positions.items()},
    }
    return {"mission": found.mission, **found.verdict.to_dict()}, shown


def _thinned(track: np.ndarray[Any, np.dtype[np.float64]]) -> list[list[float]]:
    known = track[np.isfinite(track).all(axis=1)]
    return np.round(known[:: max(1, len(known) // MOST_DOTS)], 4).tolist()
