"""What jobs cost beside the command: many queued missions, a stored result, starting; `service_http.py` asks over HTTP.

python tests/benchmarks/service.py                   # 50 missions, minutes
python tests/benchmarks/service.py --missions 10
"""

from __future__ import annotations

import argparse
import asyncio
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))

import ltlplan
from ltlplan.service.execution.workers import LocalWorkers
from ltlplan.service.job_queue.jobs import Jobs
from ltlplan.service.settings import Settings
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.serving import work_for_workers as work

WORKERS = 2
MISSION = "firefighting"


def command_times(folder: Path, seeds: range) -> list[float]:
    """Return the time of `ltlplan run` for each seed, one after the other, in s: the command's own, start and all."""
    times: list[float] = []
    for seed in seeds:
        began = time.perf_counter()
        subprocess.run(
            [sys.executable, "-m", "ltlplan", "run", MISSION, "--seed", str(seed), "--out", str(folder / f"{seed}"), "--json"],
            check=True, stdout=subprocess.DEVNULL, env={**os.environ, "OMP_NUM_THREADS": "1"},
        )  # fmt: skip
        times.append(time.perf_counter() - began)
    return times


def quantile(values: list[float], share: float) -> float:
    return sorted(values)[min(int(share * len(values)), len(values) - 1)]


async def queued(data: Path, seeds: range) -> dict[str, float]:
    """Submit all missions at once and wait for all; then ask for a stored one."""
    data.mkdir()
    mission = ltlplan.load_mission(MISSION)
    workers = LocalWorkers(WORKERS)
    jobs = Jobs(Settings(data=data), workers)
    began = time.perf_counter()
    await jobs.start()
    found = {"start of the jobs": time.perf_counter() - began}
    await asyncio.wrap_future(workers.submit(work.threads))  # the processes are warm, as in a service that has run for a second
    began = time.perf_counter()
    made = [await jobs.submit(mission, seed=seed) for seed in seeds]
    found["submitting, each"] = (time.perf_counter() - began) / len(made)
    for job in made:
        async for _event in jobs.events(job.id):
            pass
    found["queued, all"] = time.perf_counter() - began
    assert {job.state for job in await jobs.jobs(limit=1000)} == {"done"}
    stored: list[float] = []
    for _ in range(50):
        began = time.perf_counter()
        again = await jobs.submit(mission, seed=seeds[0])
        stored.append(time.perf_counter() - began)
        assert again.found
        assert again.state == "done"
    found["stored result, median"] = quantile(stored, 0.5)
    found["stored result, 99 %"] = quantile(stored, 0.99)
    starts: list[float] = []
    for _ in range(20):
        began = time.perf_counter()
        await asyncio.wrap_future(workers.submit(work.threads))
        starts.append(time.perf_counter() - began)
    found["a worker's whole life, median"] = quantile(starts, 0.5)
    await jobs.stop()
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--missions", type=int, default=50)
    seeds = range(parser.parse_args().missions)
    with tempfile.TemporaryDirectory() as scratch:
        half = range(seeds.start, seeds.stop // 2)
        single = command_times(Path(scratch) / "single", half)  # half before and half after: a machine's speed changes
        found = asyncio.run(queued(Path(scratch) / "data", seeds))
        single += command_times(Path(scratch) / "single", range(half.stop, seeds.stop))
    alone = sum(single)
    print(f"| what | s |\n|---|---|\n| `ltlplan run {MISSION}`, {len(seeds)} times, one after the other | {alone:.1f} |")
    for name, value in found.items():
        print(f"| {name} | {value:.4g} |")
    print(f"| queued, beside the commands' time shared by {WORKERS} workers | {found['queued, all'] * WORKERS / alone:.2f} |")


if __name__ == "__main__":
    run_benchmark(main, ["--missions", "1"])
