"""A recorded flight as the page shows it: the verdict, claim by claim, and where the robots were. Run by a worker."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from verify.data.progress import Progress

MOST_DOTS = 2000
"""Recorded places of a robot that are drawn at most."""

_WORDS = {"holds": "satisfied", "fails": "violated", "undecided": "the samples cannot tell"}


def judged(
    folder: Path, files: tuple[tuple[str, str], ...], recording: bytes, bounds: Mapping[str, float], report: Progress
) -> dict[str, Any]:  # of any type: JSON nests
    """Judge a recorded flight for the page.

    Args:
        folder: Empty, for use meanwhile.
        files: What the job has made: names, and where their bytes lie.
        recording: The recorded flight.
        bounds: `max_speed` (m/s), `error` (m) and `start` (s), where they are given.
        report: Told what is done.

    Returns:
        `words`, `sentence`, `claims`, `assumptions`, and by robot the places where it was seen (`flown`).

    Raises:
        BadInput: The recording cannot be judged.
    """
    from ltlplan.recorded import bounds_of, judge_flight
    from ltlplan.service.questions import without_places
    from ltlplan.service.recordings import put_recording
    from ltlplan.service.views.watching import claims_data

    run = folder / "run"
    for name, source in files:
        (run / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, run / name)
    flown = put_recording(folder, recording)
    with without_places(folder):
        found = judge_flight(run, flown, **bounds_of(bounds), progress=report)
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
