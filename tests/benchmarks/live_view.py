"""What being seen at a service costs a flight: ten simulated robots in real time, alone, seen, and with a service that does not do its part.

    OMP_NUM_THREADS=1 python tests/benchmarks/live_view.py [SECONDS]

For each it says the time between two looks of the monitor (which are to be 20 ms apart), its 99th percentile and the most, and the longest that showing an
observation took in the flight's thread. A service is frozen, or the network to it is cut off, half of the time; it is killed, and started again; or the
flight's own process that feeds it is killed.
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Generator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.helpers.benchmarks import run_benchmark
from tests.helpers.live.live_feeds import Network
from tests.helpers.live.ten_robots import TenRobots
from tests.helpers.serving.services import serving

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
          f"{1e3 * gaps[-1]:.1f} ms{cost}; {how}", flush=True)  # fmt: skip


@contextmanager
def in_turn(one: Callable[[], object], other: Callable[[], object]) -> Generator[None]:
    """Do one and the other in turn, `FROZEN` s apart; the other comes last."""
    ended = threading.Event()

    def go_on() -> None:
        while not ended.wait(FROZEN):
            one()
            ended.wait(FROZEN)
            other()

    turning = threading.Thread(target=go_on)
    turning.start()
    try:
        yield
    finally:
        ended.set()
        turning.join()


def main() -> None:
    """Print all."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 600.0
    measured("alone", TenRobots(seconds))
    with ExitStack() as opened:
        folder = Path(opened.enter_context(tempfile.TemporaryDirectory())) / "data"
        served = opened.enter_context(serving(folder))
        network = opened.enter_context(closing(Network(served.url)))
        measured("seen", TenRobots(seconds, f"{served.url}/live/hall"))
        with in_turn(lambda: os.kill(served.pid, signal.SIGSTOP), lambda: os.kill(served.pid, signal.SIGCONT)):
            measured("seen at a service that freezes", TenRobots(seconds, f"{served.url}/live/yard"))
        with in_turn(network.flows.clear, network.flows.set):
            measured("seen over a line that is cut off", TenRobots(seconds, f"{network.url}/live/cage"))
        team = TenRobots(seconds, f"{served.url}/live/roof")

        def kill_feed() -> None:
            if team.feed is not None and team.feed.process is not None:
                os.kill(team.feed.process, signal.SIGKILL)

        with in_turn(kill_feed, lambda: None):
            measured("seen by a process that is killed", team)
        again = opened.enter_context(ExitStack())
        port, pids = int(served.url.rpartition(":")[2]), [served.pid]

        def kill() -> None:
            os.kill(pids.pop(), signal.SIGKILL)

        with in_turn(kill, lambda: pids.append(again.enter_context(serving(folder, port=port)).pid)):
            measured("seen at a service that is killed", TenRobots(seconds, f"{served.url}/live/lawn"))


if __name__ == "__main__":
    run_benchmark(main, ("5",))
