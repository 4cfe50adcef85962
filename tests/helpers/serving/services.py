"""Services in processes of their own, for tests: started by `ltlplan serve`, or with limits that tests can reach."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Generator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ONE_HOOP = """\
format: 1
name: one-hoop
spec: {formula: F hoop0}
hoops:
  hoop0: {center: [1.0, 0.0, 1.2], radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}
agents:
  quad0: {start: [0.0, 0.0, 1.0]}
vehicle: crazyflie-2.1
workspace: {min: [-3, -3, 0.2], max: [3, 3, 2.5]}
planner: {pace: nominal, samples: 20, iterations: 2}
"""
"""A mission that is planned, proved and flown within seconds."""


@dataclass(frozen=True)
class Served:
    """A service that is running.

    Attributes:
        url: Where it is.
        data: Its folder.
        pid: Its process.
    """

    url: str
    data: Path
    pid: int


def start(data: Path, *, limits: Mapping[str, Any] | None = None, **settings: Any) -> tuple[subprocess.Popen[bytes], Served]:
    """Start a service on a free port and wait until it answers; without its page, and with one worker, unless it is told otherwise."""
    asked = json.dumps({"data": str(data), "limits": dict(limits or {}), **settings})
    out, log = (data.parent / f"{data.name}.{kind}" for kind in ("out", "log"))
    with out.open("w") as stdout, log.open("w") as stderr:  # its own session: a terminal's Ctrl-C ends it after its tests
        own = {name: value for name, value in os.environ.items() if name != "PYTEST_CURRENT_TEST"}  # as users have it
        process = subprocess.Popen(
            [sys.executable, __file__, asked], stdout=stdout, stderr=stderr, env=own, start_new_session=True
        )
    while process.poll() is None and not out.read_text().endswith("\n"):
        time.sleep(0.05)
    told = out.read_text()
    assert told.startswith("ltlplan serves at "), log.read_text()[-2000:]
    return process, Served(told.split()[3].rstrip("/"), data, process.pid)


@contextmanager
def serving(data: Path, **asked: Any) -> Generator[Served]:
    """Have a service while something is tested."""
    process, served = start(data, **asked)
    try:
        yield served
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(30)


@contextmanager
def submitting(url: str) -> Generator[set[str]]:
    """Have somebody submit jobs one after another and delete every second one, and yield the ids of those that stay."""
    from ltlplan import Client
    from verify.data import LtlplanError

    over, accepted = threading.Event(), set[str]()

    def churn() -> None:
        seed = 100
        with Client(url) as client:
            while not over.is_set():
                seed += 1
                job = client.submit_text(ONE_HOOP, seed=seed)
                if seed % 2:
                    with suppress(LtlplanError):
                        client.cancel(job)
                        client.delete(job)
                else:
                    accepted.add(job.id)

    churning = threading.Thread(target=churn)
    churning.start()
    try:
        yield accepted
    finally:
        over.set()
        churning.join()


def resident_megabytes(pid: int) -> float:
    """Return how much memory a process holds, in MB."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _end_with(pid: int) -> None:
    """End this process when another has ended."""
    while Path(f"/proc/{pid}").exists():
        time.sleep(0.5)
    os.kill(os.getpid(), signal.SIGTERM)


def _main() -> None:
    from ltlplan.service.server import serve
    from ltlplan.service.settings import Limits, Rate, Settings

    asked = json.loads(sys.argv[1])
    limits = {name: Rate(*value) if isinstance(value, list) else value for name, value in asked.pop("limits").items()}
    data, guard = Path(asked.pop("data")), asked.pop("guard", None)
    if guard is not None:
        threading.Thread(target=_end_with, args=(guard,), daemon=True).start()
    names = tuple(asked.pop("names", ()))
    page, workers = asked.pop("page", False), asked.pop("workers", 1)
    settings = Settings(data=data, port=asked.pop("port", 0), names=names, workers=workers, limits=Limits(**limits), **asked)
    serve(settings, page=page, announce=lambda said: print(said, flush=True))


if __name__ == "__main__":
    _main()
