"""The service over HTTP: how soon it starts, how soon it answers readers while two plans compute, how soon a stored job is found.

python tests/benchmarks/service_http.py
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))

import httpx

import ltlplan
from ltlplan.missions import shipped_mission_text
from tests.helpers.services import ONE_HOOP, serving, start

YAML = {"content-type": "application/yaml"}
PLENTY = {"reads": [1e6, 1e6], "questions_asked": [1e6, 1e6]}


def quantile(values: list[float], share: float) -> float:
    return sorted(values)[min(int(share * len(values)), len(values) - 1)]


def timed(ask: Callable[[], httpx.Response]) -> float:
    began = time.perf_counter()
    answer = ask()
    took = time.perf_counter() - began
    assert answer.is_success, answer.text
    return took


def start_time(data: Path, *, page: bool) -> float:
    """Return how long it takes from the command to the first page, in s."""
    began = time.perf_counter()
    process, served = start(data, page=page)
    try:
        assert httpx.get(f"{served.url}/{'' if page else 'docs'}", follow_redirects=True, timeout=60).is_success
        return time.perf_counter() - began
    finally:
        process.terminate()
        process.wait()


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
        rows = {
            "from the command to the first page": start_time(folder / "page", page=True),
            "from the command to the API's documentation": start_time(folder / "docs", page=False),
        }
        with (
            serving(folder / "data", workers=2, limits=PLENTY) as served,
            httpx.Client(base_url=served.url, timeout=60) as http,
        ):
            with ltlplan.Client(served.url) as client:
                done = client.submit_text(ONE_HOOP).wait().id
            stored = [timed(lambda: http.post("/api/jobs", content=ONE_HOOP, headers=YAML)) for _ in range(100)]
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
    main()
