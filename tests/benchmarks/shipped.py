"""Times of the runs of shipped missions, in s of processor time.

Run `python tests/benchmarks/shipped.py [NAME ...]`.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import ltlplan
from ltlplan.missions import shipped_missions
from tests.helpers.benchmarks import run_benchmark


def main() -> None:
    """Print one line for each mission."""
    for name in sys.argv[1:] or sorted(shipped_missions()):
        with tempfile.TemporaryDirectory() as folder:
            began = time.process_time()
            run = ltlplan.run(name, Path(folder) / name)
            print(f"{name:<20} {time.process_time() - began:6.1f} s, {run.rounds} rounds", flush=True)


if __name__ == "__main__":
    run_benchmark(main, ["firefighting"])
