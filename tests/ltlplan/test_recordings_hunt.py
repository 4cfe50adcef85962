"""The hunt for false verdicts: recordings that lost what was flown, in every format, held against what was flown.

Of a mission alone and of one whose world changed, nothing that is called satisfied may be broken in truth, nor the other way round.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from ltlplan import judge_flight
from tests.helpers.few import few_of
from tests.helpers.live.lost_ends import (
    OURS,
    RATE,
    WHOLE,
    WRITERS,
    Flown,
    Motion,
    draw_flown,
    draw_motion,
    draw_tape,
    in_laboratory,
    write_asked,
)  # fmt: skip
from tests.verify.test_run_folder import write_folder
from verify import FlightVerdict
from verify.data import BadInput, DoesNotFit

NEEDS = {"PX4": "pyulog", "our log, mcap": "mcap", "our log, parquet": "pyarrow"}


@dataclass(frozen=True)
class Found:
    """What was said of a recording, whether that is false, and the sentence."""

    outcome: str
    false: bool
    sentence: str


def hunt(kind: str, seed: int, folder: Path) -> Found:
    """Fly, record and judge against a mission alone, or one whose world changed."""
    rng = np.random.default_rng([91, seed, *kind.encode()])
    motion = draw_motion(rng, changing=bool(rng.random() < 0.3))
    begin = round(float(rng.uniform(0, 0.3)) * motion.end * RATE) / RATE if rng.random() < 0.5 else 0.0
    later = 0.0 if kind in OURS or rng.random() < 0.5 else float(rng.uniform(0, 0.5))
    (folder / "asked").mkdir()
    asked = write_asked(folder / "asked", motion)
    verdict, start = judged(kind, motion, asked, round(begin + later, 2) if later else 0.0, begin, rng)
    if isinstance(verdict, str):
        return Found("refused", False, verdict)
    truth = motion.satisfied(start)
    false = truth is not None and verdict.outcome != "undecided" and truth != (verdict.outcome == "holds")
    return Found(verdict.outcome, false, verdict.sentence)


def hunt_run(kind: str, seed: int, folder: Path) -> Found:
    """Fly, record and judge against a certified run: whoever is called satisfied was in its tube, whoever left it is known to have."""
    rng = np.random.default_rng([92, seed, *kind.encode()])
    flown = draw_flown(rng)
    plan, team, certificate = flown.made
    begin = float(rng.choice([0.0, 0.0, 0.0 if kind in OURS else -1.0, 0.4]))
    verdict, start = judged(kind, flown, write_folder(folder / "run", plan, team, certificate), 0.0, begin, rng)
    if isinstance(verdict, str):
        return Found("refused", False, verdict)
    broken = any(claim.outcome == "fails" and claim.name == "tube" for claim in verdict.claims)
    off = flown.furthest - certificate.margin
    false = start == 0.0 and ((verdict.outcome == "holds" and off > 1e-4) or (broken and off < -1e-4))
    return Found(verdict.outcome, false, verdict.sentence)


# six parameters: what was flown, what it is held against, and how it was recorded
def judged(
    kind: str, motion: Motion | Flown, asked: Path, start: float, begin: float, rng: np.random.Generator
) -> tuple[FlightVerdict | str, float]:
    """Return the verdict, or why there is none, and when the flight that was judged began, s of the motion.

    Args:
        kind: Of recording.
        motion: What was flown.
        asked: What it is held against.
        start: When the flight began, s, where that is told.
        begin: From when on it was recorded, s.
        rng: Draws the faults.
    """
    error, known = float(rng.choice([0.0, 0.0, 0.002, 0.01])), kind in OURS
    tape = draw_tape(motion, begin, error, rng, ends=kind not in WHOLE)
    folder = asked.parent / "recorded" if asked.is_dir() else asked.parents[1] / "recorded"
    folder.mkdir()
    path, clocks, told = WRITERS[kind](folder, tape if known else in_laboratory(tape, motion.mission), rng)
    tells = rng.random() < 0.5 if known else len(set(clocks.values())) > 1 or rng.random() < 0.7
    if tells:
        told = replace(told, **_start(clocks, start, rng))
    digits = np.sqrt(3) * (0.5e-8 if known else 0.5e-6)
    try:
        found = judge_flight(asked, path, max_speed=motion.speed * (1 + 1e-6), error=error + float(digits), told=told)
    except (BadInput, DoesNotFit) as refusal:
        return str(refusal), start
    return found.verdict, start if tells or known else float(tape.times[0])


def _start(clocks: Mapping[str, float], start: float, rng: np.random.Generator) -> dict[str, object]:
    """Return when the flight began as it is told, one time or one of each robot's clock, and how far that may be off."""
    off = float(rng.choice([0.0, 0.0, 0.02]))
    late = float(rng.uniform(-off, off))
    times = {name: round(zero + start + late, 6) for name, zero in clocks.items()}
    return {"start": times if len(set(times.values())) > 1 else next(iter(times.values())), "start_error": off * 1.001}


def hunted(one: Callable[[str, int, Path], Found], kind: str, seeds: range, folder: Path) -> Counter[str]:
    """Hunt many times; return how often which outcome came, with the number of false ones under `false`."""
    tally: Counter[str] = Counter()
    for seed in seeds:
        place = folder / f"{one.__name__}{seed}"
        place.mkdir()
        found = one(kind, seed, place)
        tally[found.outcome] += 1
        if found.false:
            tally["false"] += 1
            print(f"{kind}, seed {seed}: {found.outcome}, which is false: {found.sentence}")
    print(one.__name__, kind, dict(tally))
    return tally


def require(kind: str) -> None:
    """Skip what reads a kind of recording where it is not installed."""
    pytest.importorskip(NEEDS.get(kind, "rosbags.rosbag2" if "," in kind else "numpy"))


@few_of(1, "kind", WRITERS)
@pytest.mark.slow
def test_nothing_false_is_said_of_recordings_that_lost_what_was_flown(kind: str, tmp_path: Path) -> None:
    require(kind)
    for one in (hunt, hunt_run):
        found = hunted(one, kind, range(3), tmp_path)
        assert not found["false"]
        assert found["refused"] <= 2


@pytest.mark.slow
@pytest.mark.parametrize("kind", WRITERS)
def test_nothing_false_is_said_of_many_recordings_that_lost_what_was_flown(kind: str, tmp_path: Path) -> None:
    require(kind)
    for one in (hunt, hunt_run):
        found = hunted(one, kind, range(1000, 1150), tmp_path)
        assert not found["false"]
        assert found["holds"] >= (10 if one is hunt else 1), found
        assert found["fails"] >= 10, found
