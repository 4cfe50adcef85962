"""Flights that were recorded, and what the judge of recordings says of them, held against the simulator's own truth.

python tests/benchmarks/recordings.py 10000   # none that is called satisfied may have left its tube or broken a claim
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.helpers.benchmarks import run_benchmark
from tests.helpers.live.recorded_flights import campaign


def main() -> int:
    """Fly, record and judge; 1 where the judge said what the truth denies."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flights", type=int, nargs="?", default=1000)
    parser.add_argument("--first", type=int, default=0, help="first batch of 100 flights")
    chosen = parser.parse_args()
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        tally = campaign(
            chosen.first,
            chosen.flights,
            Path(folder),
            say=lambda tally: print(f"{time.monotonic() - begin:.0f} s: {tally.said}", flush=True),
        )
    for fault in tally.faults:
        print(fault)
    return 1 if tally.faults else 0


if __name__ == "__main__":
    run_benchmark(main, ["5"])
