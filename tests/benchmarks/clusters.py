"""Campaigns and batches, measured: on processes of this machine and on workers of a Dask cluster of this machine.

Run as `python tests/benchmarks/clusters.py [--runs 2000] [--missions 6]`. Findings and folders are compared byte by byte on the way.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import flight
import ltlplan
from flight.processes import Workers
from ltlplan.pipeline import certified_team
from ltlplan.service.execution.batches import run_batch
from ltlplan.service.execution.clusters import Cluster
from ltlplan.service.execution.workers import LocalWorkers
from tests.helpers.benchmarks import is_smallest, run_benchmark
from tests.helpers.serving import work_for_workers
from tests.helpers.serving.clusters import local_cluster

CONDITIONS = {"wind": "0.5+0.3", "noise": 0.001}


def on_each(
    measure: Callable[[int | Workers], tuple[bytes, float]],
    local: Callable[[int], tuple[bytes, float]],
) -> set[bytes]:
    """Measure on processes and on as many Dask workers, print a row for each, and return what was found: one thing, if all is well."""
    found: set[bytes] = set()
    counts = (1,) if is_smallest() else (1, 2)
    for count in counts:
        bytes_, seconds = local(count)
        found.add(bytes_)
        print(f"{count} processes of this machine: {seconds:.1f} s")
    for count in counts:
        with local_cluster(workers=count) as machines, Cluster(machines.address) as cluster:
            while cluster.count < count:
                time.sleep(0.1)
            time.sleep(10.0)  # until they have loaded what work needs
            bytes_, seconds = measure(cluster)
            found.add(bytes_)
            print(f"{count} Dask workers: {seconds:.1f} s")
    return found


def campaigns(runs: int) -> set[bytes]:
    """Measure one campaign of the firefighting mission, and return its findings, wherever they were made."""
    done = certified_team(ltlplan.plan("firefighting"))

    def measure(workers: int | Workers) -> tuple[bytes, float]:
        began = time.perf_counter()
        found = flight.campaign(done.plan, done.team, done.certificate, runs=runs, workers=workers, **CONDITIONS)
        seconds = time.perf_counter() - began
        return found.worst_error.tobytes() + found.satisfied.tobytes() + found.error_over_time.tobytes(), seconds

    print(f"campaign: firefighting, {done.certificate.duration:.1f} s of flight, {runs} runs")
    return on_each(measure, measure)


def batches(missions: int) -> set[bytes]:
    """Measure a folder of firefighting missions that differ in their names, and return what was written, wherever it was made."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "missions"
        folder.mkdir()
        text = ltlplan.missions.shipped_mission_text("firefighting")
        for number in range(missions):
            (folder / f"m{number}.yaml").write_text(text.replace("name: firefighting", f"name: firefighting{number}"))

        def measure(workers: Workers) -> tuple[bytes, float]:
            began = time.perf_counter()
            entries = run_batch(folder, out := Path(tempfile.mkdtemp(dir=scratch)), workers=workers)
            seconds = time.perf_counter() - began
            assert not any(entry.exit_code for entry in entries)
            return b"".join(path.read_bytes() for path in sorted(out.rglob("*")) if path.is_file()), seconds

        def local(count: int) -> tuple[bytes, float]:
            pool = LocalWorkers(count)
            pool.submit(work_for_workers.add, 1, 2).result()  # until it has loaded what work needs
            try:
                return measure(pool)
            finally:
                pool.close()

        print(f"batch: {missions} missions, firefighting with other names")
        return on_each(measure, local)


def main() -> None:
    """Measure and print; findings that depend on where they were made end it with an error."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=2000)
    parser.add_argument("--missions", type=int, default=6)
    options = parser.parse_args()
    for found in (campaigns(options.runs), batches(options.missions)):
        if len(found) != 1:
            sys.exit("findings depend on where they were made")


def test_benchmark(capsys) -> None:
    """Runs all of it in small, so that `pytest tests/benchmarks/clusters.py -s` prints the figures."""
    with capsys.disabled():
        assert len(campaigns(20)) == 1
        assert len(batches(2)) == 1


if __name__ == "__main__":
    run_benchmark(main, ["--runs", "2", "--missions", "1"])
