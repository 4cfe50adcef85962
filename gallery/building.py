"""Building of the gallery: each entry's commands in a folder of its own, what they print, and what changed since."""

from __future__ import annotations

import json
import math
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

from gallery.entries import ENTRIES, NUMBERS, Entry
from gallery.shows import write_show

HERE = Path(__file__).parent
ROOT = HERE.parent
RESULTS = HERE / "results.json"
WITHIN = 1e-6
"""Relative difference of a number that counts as none: last digits differ between processors."""
ANY = math.inf
"""Relative difference of a number that is listed and accepted: costs and durations that are found by optimisation differ between processors."""
KERNELS = {"OMP_NUM_THREADS": "1", "OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR"}
"""Kernels of linear algebra that every x86-64 processor of the last ten years has: others round otherwise."""
MOST_BYTES = 2_000_000
"""Of a page that plays."""
KEPT = ("cost", "duration", "words", "visits", "holds", "outcome", "message", "sentence", "share_inside", "share_satisfied")

Found = dict[str, Any]
"""What is kept of an entry: its figures, of any kind that JSON has."""


def build(entry: Entry, target: Path) -> Found:
    """Build one entry, and return its figures.

    Args:
        entry: What is shown.
        target: Folder of the gallery; the entry's page, mission and certificate are put into a folder of its name there.

    Raises:
        RuntimeError: A command ended otherwise than it should, or the page is too large.
    """
    with tempfile.TemporaryDirectory() as scratch:
        folder, printed, seconds = Path(scratch), "", 0.0
        for file in (HERE / "missions").glob("*.yaml"):
            shutil.copy(file, folder)
        for command in entry.commands:
            begun = time.perf_counter()
            last = command is entry.commands[-1]
            printed = _ran(command, folder, expected=entry.expected if last else 0)
            seconds += time.perf_counter() - begun
        place = target / f"{NUMBERS[entry.name]}-{entry.name}"
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir(parents=True)
        if entry.page:
            if (folder / entry.page).stat().st_size > MOST_BYTES:
                raise RuntimeError(
                    f"{entry.name}: the page has {(folder / entry.page).stat().st_size} bytes, at most {MOST_BYTES}"
                )
            shutil.copy(folder / entry.page, place / "page.html")
        for name in ("mission.yaml", "certificate.json"):
            if (folder / "run" / name).exists():
                shutil.copy(folder / "run" / name, place / name)
        found = _figures(json.loads(printed))
        (place / "seconds.json").write_text(json.dumps(round(seconds, 1)))
    return found


def build_all(names: tuple[str, ...], target: Path, processes: int) -> dict[str, Found]:
    """Build entries, several at once, and return the figures of each.

    Args:
        names: Of the entries.
        target: Folder of the gallery.
        processes: How many at once.
    """
    chosen = [entry for entry in ENTRIES if entry.name in names]
    with ThreadPoolExecutor(processes) as pool:
        return dict(zip([entry.name for entry in chosen], pool.map(partial(build, target=target), chosen), strict=True))


def changes(known: Mapping[str, Found], found: Mapping[str, Found], within: float = WITHIN) -> list[str]:
    """Return what differs from known results, a line for each figure.

    Args:
        known: Figures of entries, as they were accepted.
        found: Figures of the entries that were built.
        within: Relative difference of numbers that counts as none.
    """
    return [
        f"{NUMBERS[name]} {name}: {key} was {before!r}, is {after!r}"
        for name, figures in found.items()
        for key in {**known.get(name, {}), **figures}
        if not _same(before := known.get(name, {}).get(key), after := figures.get(key), within)
    ]


def _ran(command: str, folder: Path, *, expected: int) -> str:
    """Return what a command prints as JSON."""
    if command in ("show", "show-with-divers"):
        write_show(folder / "show", divers=command != "show")
        return ""
    python = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    words = [sys.executable, "-m", "ltlplan", *shlex.split(command), "--json"]
    done = subprocess.run(
        words, cwd=folder, env={**os.environ, **KERNELS, "PYTHONPATH": python}, capture_output=True, text=True, check=False
    )
    if done.returncode != expected:
        raise RuntimeError(
            f"`ltlplan {command}` ended with {done.returncode}, not {expected}:\n{done.stdout[-2000:]}{done.stderr[-2000:]}"
        )
    return done.stdout


def _figures(printed: Mapping[str, Any]) -> Found:
    """Return the figures of what a command printed: what is kept as it is, and how many claims hold and are checked."""
    found = {key: printed[key] for key in KEPT if key in printed}
    claims = printed.get("claims", ())
    if claims:
        found["claims"] = len(claims)
        found["proved"] = sum("holds" in (claim.get("verdict"), claim.get("outcome")) for claim in claims)
        found["checked"] = sum(claim.get("proof") == "checked" for claim in claims)
    return found


def _same(one: Any, other: Any, within: float) -> bool:
    if isinstance(one, float) and isinstance(other, float):
        return abs(one - other) <= within * max(abs(one), abs(other))
    return one == other
