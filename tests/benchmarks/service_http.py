"""The service over HTTP: how soon it starts, how soon it answers readers while two plans compute, how soon a stored job is found.

python tests/benchmarks/service_http.py
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))

import httpx

import ltlplan
from ltlplan.missions import shipped_mission_text
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.serving.services import ONE_HOOP, serving, start

YAML = {"content-type": "application/yaml"}
FOUND = 1000
"""Times that a stored job is asked for: of 100, the 99th in a hundred would be the slowest of all."""
PLENTY = {"reads": [1e6, 1e6], "questions_asked": [1e6, 1e6]}


def quantile(values: list[float], share: float) -> float:
    return sorted(values)[min(int(share * len(values)), len(values) - 1)]


def timed(ask: Callable[[], httpx.Response]) -> float:
    began = time.perf_counter()
    answer = ask()
    took = time.perf_counter() - began
    assert answer.is_success, answer.text
    return took


@dataclass(frozen=True)
class Start:
    """How long a start took, in s.

    Attributes:
        page: From the command to the first page, on the clock.
        processor: Of the serving process, until then.
        question: From the first page to the answer to a first question, which is asked at once.
    """

    page: float
    processor: float
    question: float


def timed_start(data: Path, *, page: bool) -> Start:
    """Start a service in a new folder and ask for its first page, then a question."""
    began = time.perf_counter()
    process, served = start(data, page=page)
    try:
        with httpx.Client(base_url=served.url, follow_redirects=True, timeout=60) as http:
            assert http.get("/" if page else "/docs").is_success
            shown = time.perf_counter()
            processor = processor_seconds(process.pid)
            timed(lambda: http.post("/api/missions/check", content=ONE_HOOP, headers=YAML))
            return Start(shown - began, processor, time.perf_counter() - shown)
    finally:
        process.terminate()
        process.wait()


def processor_seconds(pid: int) -> float:
    """Return s of processor time that a process has taken, without what it started."""
    user, system = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def reads_while_computing(http: httpx.Client, done: str) -> list[float]:
    """Return how long reads take while two plans compute, in s each."""
    text = shipped_mission_text("firefighting")
    busy = [http.post("/api/jobs", content=text, headers=YAML, params={"seed": seed}).json()["id"] for seed in (10_001, 10_002)]
    paths = ("/api/jobs", f"/api/jobs/{done}", f"/api/jobs/{done}/files/plan.json", f"/api/jobs/{done}/files", "/health")
    times: list[float] = []
    while any(http.get(f"/api/jobs/{job}").json()["state"] in ("queued", "running") for job in busy):
        times += [timed(lambda path=path: http.get(path)) for path in paths]
        time.sleep(0.01)
    return times


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        whole, bare = timed_start(folder / "page", page=True), timed_start(folder / "docs", page=False)
        rows = {
            "from the command to the first page": whole.page,
            "processor time until then": whole.processor,
            "from the first page to a first question's answer": whole.question,
            "from the command to the API's documentation": bare.page,
        }
        with (
            serving(folder / "data", workers=2, limits=PLENTY) as served,
            httpx.Client(base_url=served.url, timeout=60) as http,
        ):
            with ltlplan.Client(served.url) as client:
                done = client.submit_text(ONE_HOOP).wait().id
            stored = [timed(lambda: http.post("/api/jobs", content=ONE_HOOP, headers=YAML)) for _ in range(FOUND)]
            reads = reads_while_computing(http, done)
            checks = [timed(lambda: http.post("/api/missions/check", content=ONE_HOOP, headers=YAML)) for _ in range(20)]
        rows |= {
            "a stored job is found, median": quantile(stored, 0.5),
            "a stored job is found, 99 %": quantile(stored, 0.99),
            "a read while two plans compute, median": quantile(reads, 0.5),
            "a read while two plans compute, 99 %": quantile(reads, 0.99),
            "a mission is checked, median": quantile(checks, 0.5),
        }
    print("| what | s |\n|---|---|")
    for name, value in rows.items():
        print(f"| {name} | {value:.4f} |")
    print(f"| number of those reads | {len(reads)} |")


if __name__ == "__main__":
    run_benchmark(main)
