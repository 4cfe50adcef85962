"""What being seen at a service costs a flight: ten simulated robots in real time, alone, seen, and with a service that is frozen half of the time.

    OMP_NUM_THREADS=1 python tests/benchmarks/live_view.py [SECONDS]

For each it says the time between two looks of the monitor (which are to be 20 ms apart), its 99th percentile and the most, and the longest that showing an
observation took in the flight's thread.
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.helpers.benchmarks import run_benchmark
from tests.helpers.services import serving
from tests.helpers.ten_robots import TenRobots

FROZEN = 10.0
"""s that the service is frozen, and not, in turn."""


def measured(name: str, team: TenRobots) -> None:
    """Fly, and print how evenly the monitor looked."""
    team.begin().join()
    assert team.done is not None
    gaps = team.gaps
    cost = f"; showing took {1e3 * max(team.shown):.2f} ms at most" if team.shown else ""
    how = "flown" if team.done.flown else team.done.reason
    print(f"{name}: looks {1e3 * gaps[len(gaps) // 2]:.1f} ms apart, 99th percentile {1e3 * gaps[int(0.99 * len(gaps))]:.1f} ms, at most "
          f"{1e3 * gaps[-1]:.1f} ms{cost}; {how}")  # fmt: skip


def main() -> None:
    """Print the three."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 600.0
    measured("alone", TenRobots(seconds))
    with tempfile.TemporaryDirectory() as folder, serving(Path(folder) / "data") as served:
        measured("seen", TenRobots(seconds, f"{served.url}/live/hall"))
        ended = threading.Event()

        def freeze() -> None:
            while not ended.wait(FROZEN):
                os.kill(served.pid, signal.SIGSTOP)
                time.sleep(FROZEN)
                os.kill(served.pid, signal.SIGCONT)

        freezing = threading.Thread(target=freeze)
        freezing.start()
        try:
            measured("seen at a service that freezes", TenRobots(seconds, f"{served.url}/live/yard"))
        finally:
            ended.set()
            freezing.join()


if __name__ == "__main__":
    run_benchmark(main, ("5",))
