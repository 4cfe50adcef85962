"""Work for the service's processes to do: what returns, what fails, and what takes too much."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from ltlplan.logic.budget import watched
from ltlplan.service.execution.serialization import from_bytes
from ltlplan.service.execution.stages import Outcome
from ltlplan.service.execution.stop_requests import is_asked
from verify.data import MissionError
from verify.data.progress import Progress
from verify.data.validation.faults import Fault


def add(first: int, second: int, report: Progress) -> tuple[int, int]:
    report("adding", 0.5)
    return first + second, os.getpid()


def leave_file(mark: str, report: Progress) -> None:
    with tempfile.NamedTemporaryFile(delete=False) as file:
        Path(mark).write_text(file.name, encoding="utf-8")
    sleep(60.0, report)


def threads(_report: Progress) -> str | None:
    return os.environ.get("OMP_NUM_THREADS")


def wrong_mission(_report: Progress) -> None:
    raise MissionError("mission", [Fault(("hoops", "a"), 3, "there is no such hoop.")])


def wrong_question(_question: object, report: Progress) -> None:
    wrong_mission(report)


def own_process(_question: object, _report: Progress) -> int:
    return os.getpid()


def bug(_report: Progress) -> float:
    return 1 / int("0")


def take_memory(_report: Progress) -> None:
    taken: list[bytearray] = []
    while True:
        taken.append(bytearray(10_000_000))


def start_one_that_takes_memory(_report: Progress) -> None:
    subprocess.run([sys.executable, "-c", "taken = [bytearray(10_000_000) for _ in range(100)]; input()"], check=True)


def spin(seconds: float, _report: Progress) -> float:
    began = time.process_time()
    while time.process_time() - began < seconds:
        pass
    return seconds


def sleep(seconds: float, *rest: object) -> float:
    if isinstance(rest[0], str):
        Path(rest[0]).write_text(str(os.getpid()), encoding="ascii")
    time.sleep(seconds)
    return seconds


def die(_report: Progress) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def die_once(mark: str, _report: Progress) -> str:
    if not Path(mark).exists():
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return "lived"


def search_until_ended(name: str, value: bytes, report: Progress) -> Outcome:
    """Stand in for a job's stages: a search that goes on until it is asked to end; a seed of 1 has it end by itself at once."""
    mission = from_bytes(value)
    states = 0
    with watched(is_asked) as watch:
        while mission.planner.seed != 1 and not watch.ends(states):
            report(f"{name}: searching, {states} states", 0.1)
            states += 1
            time.sleep(0.01)
    return Outcome(b"", {}, stopped=watch.states is not None)


def stand_in_stage(name: str, value: bytes, report: Progress) -> Outcome:
    """Stand in for a job's stages: one that takes as much processor time as the mission's seed says, in hundredths of a second."""
    report(name, 0.0)
    mission = from_bytes(value)
    spin(mission.planner.seed % 1000 / 100, report)
    return Outcome(b"", {})
