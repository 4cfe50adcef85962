"""Times the run of each shipped mission, in s of processor time: `python tests/benchmarks/shipped.py [NAME ...]`."""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import ltlplan
from ltlplan.missions import shipped_missions


def main(names: list[str]) -> None:
    """Print one line for each mission."""
    for name in names or sorted(shipped_missions()):
        with tempfile.TemporaryDirectory() as folder:
            began = time.process_time()
            run = ltlplan.run(name, Path(folder) / name)
            print(f"{name:<20} {time.process_time() - began:6.1f} s, {run.rounds} rounds", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
