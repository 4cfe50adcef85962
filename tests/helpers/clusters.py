"""A Dask cluster of this machine for tests: a scheduler and workers, each a process that a test may kill."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]
_ADDRESS = re.compile(r"Scheduler at:\s+(tcp://\S+)")


class LocalCluster:
    """A scheduler and its workers.

    Attributes:
        address: Of the scheduler.
        scheduler: Its process.
        workers: Theirs, those that were killed too.
    """

    def __init__(self, port: int = 0) -> None:
        self.workers: list[subprocess.Popen[bytes]] = []
        self.scheduler = _started("dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard", piped=True)
        assert self.scheduler.stderr is not None
        found = next(match for line in self.scheduler.stderr if (match := _ADDRESS.search(line.decode())))
        self.address = found[1]
        threading.Thread(target=self.scheduler.stderr.read, daemon=True).start()

    def work(self, count: int) -> None:
        """Start workers, of one thread each."""
        options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--death-timeout", "60")
        self.workers += [_started("dask_worker", self.address, *options) for _ in range(count)]

    def kill(self) -> None:
        """Kill all that is left."""
        for process in (*self.workers, self.scheduler):
            process.kill()
        for process in (*self.workers, self.scheduler):
            process.wait()
        if self.scheduler.stderr is not None:
            self.scheduler.stderr.close()


@contextmanager
def local_cluster(workers: int) -> Iterator[LocalCluster]:
    """Run a cluster; workers are there some seconds later."""
    cluster = LocalCluster()
    try:
        cluster.work(workers)
        yield cluster
    finally:
        cluster.kill()


def _started(program: str, *arguments: str, piped: bool = False) -> subprocess.Popen[bytes]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "PYTHONWARNINGS": "ignore"}
    return subprocess.Popen(
        [sys.executable, "-m", f"distributed.cli.{program}", *arguments],
        env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE if piped else subprocess.DEVNULL,
    )  # fmt: skip
