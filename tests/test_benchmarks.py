"""Every benchmark runs: each file of `tests/benchmarks` at its smallest size, as `python -m tests.benchmarks.NAME --smallest` does. No times are checked."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers.benchmarks import LEFT_OUT, SMALLEST

ROOT = Path(__file__).parents[1]
BENCHMARKS = sorted(path.stem for path in (ROOT / "tests" / "benchmarks").glob("*.py") if path.stem != "__init__")
PATIENCE = 1800
"""s until a benchmark counts as one that does not end."""


def test_the_folder_is_found() -> None:
    assert "certificates" in BENCHMARKS


@pytest.mark.slow
@pytest.mark.parametrize("name", BENCHMARKS)
def test_a_benchmark_runs_at_its_smallest_size(name: str) -> None:
    """A peer that is not installed is left out, and the test says so as its reason to skip; all else has run by then."""
    done = subprocess.run(
        [sys.executable, "-m", f"tests.benchmarks.{name}", SMALLEST],
        cwd=ROOT, env={**os.environ, "OMP_NUM_THREADS": "1"}, capture_output=True, text=True, timeout=PATIENCE,
    )  # fmt: skip
    assert done.returncode == 0, f"{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    lines = done.stdout.splitlines()
    left_out = [line.removeprefix(LEFT_OUT) for line in lines if line.startswith(LEFT_OUT)]
    assert left_out or lines, "it prints nothing"
    if left_out:
        pytest.skip("; ".join(left_out))
