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

ROOT = Path(__file__).parents[3]
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
        self._joining: list[threading.Event] = []
        self.scheduler = _started("dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard", piped=True)
        assert self.scheduler.stderr is not None
        found = next(match for line in self.scheduler.stderr if (match := _ADDRESS.search(line.decode())))
        self.address = found[1]
        threading.Thread(target=self.scheduler.stderr.read, daemon=True).start()

    def work(self, count: int) -> None:
        """Start workers, of one thread each."""
        options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--death-timeout", "60")
        for _ in range(count):
            worker, joined = _started("dask_worker", self.address, *options, piped=True), threading.Event()
            threading.Thread(target=_read, args=(worker, joined), daemon=True).start()
            self.workers.append(worker)
            self._joining.append(joined)

    def joined(self) -> None:
        """Wait until the scheduler has registered all workers that were started, or they have ended."""
        for event in self._joining:
            event.wait()

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
    """Run a cluster whose workers have joined it, however long their start takes on a busy machine."""
    cluster = LocalCluster()
    try:
        cluster.work(workers)
        cluster.joined()
        yield cluster
    finally:
        cluster.kill()


def _read(worker: subprocess.Popen[bytes], joined: threading.Event) -> None:
    """Read what a worker prints to its end; say when the scheduler has registered it, or it has ended."""
    assert worker.stderr is not None
    with worker.stderr:
        for line in worker.stderr:
            if b"Registered to" in line:
                joined.set()
    joined.set()


def _started(program: str, *arguments: str, piped: bool = False) -> subprocess.Popen[bytes]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "PYTHONWARNINGS": "ignore"}
    return subprocess.Popen(
        [sys.executable, "-m", f"distributed.cli.{program}", *arguments],
        env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE if piped else subprocess.DEVNULL,
    )  # fmt: skip
