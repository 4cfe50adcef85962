"""One round of candidate paths: sampled, labelled against every hoop, run through the planned word, and costed.

python tests/benchmarks/sampled_paths.py [--paths 1000] [--repeats 20]

1000 paths of 20 waypoints, 6 hoops, 200 instants; processor time, the least of several repeats on one core. The target is 20 ms.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from ltlplan.paths.costs import Sampling, WeightedCost
from ltlplan.paths.sampling.path_problem import path_problem
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.missions.courses import courses
from tests.helpers.words.sampled_labels import label, run


class Visits:
    """Accepts words that visit regions in an order, as an automaton over letters."""

    def __init__(self, regions: list[str]) -> None:
        self.regions, self.initial, self.accepting = regions, 0, (len(regions),)

    def successor(self, state: int, letter: frozenset[str]) -> int:
        """Advance where the next region is in the letter."""
        return state + (state < len(self.regions) and self.regions[state] in letter)


def least(function: Callable[[], object], repeats: int) -> float:
    """Processor milliseconds of the fastest of several calls."""
    best = float("inf")
    for _ in range(repeats):
        begin = time.process_time()
        function()
        best = min(best, time.process_time() - begin)
    return 1e3 * best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--paths", type=int, default=1000)
    parser.add_argument("--repeats", type=int, default=20)
    arguments = parser.parse_args()
    mission, plan = courses(seed=7, count=1, hoops=6, passages=6)[0]
    cost = WeightedCost.of({"length": 1.0, "effort": 0.5})
    problem = path_problem(mission, plan, cost, points=18, instants=200)
    assert len(problem.nominal) == 20
    points = problem.nominal + 0.01 * np.random.default_rng(0).standard_normal((arguments.paths, 20, 3))
    points[:, [0, -1]] = problem.nominal[[0, -1]]
    automaton = Visits([visit.region for visit in plan.visits])
    sampling = Sampling(problem.spline, 200)
    sampling.matrix(0), sampling.matrix(1), sampling.matrix(2)
    positions = sampling.paths(points).axes(0)
    labels = label(mission, positions)

    def labelled_and_costed() -> None:
        for block in np.array_split(points, max(1, arguments.paths // 250)):  # as the search does, to stay in the cache
            paths = sampling.paths(block)
            run(automaton, label(mission, paths.axes(0)))
            cost(paths.rescaled(paths.length / problem.length))

    candidates = points[:, problem.free].reshape(arguments.paths, -1)

    rows = [
        ("sample positions", lambda: sampling.paths(points).axes(0)),
        ("label against 6 hoops", lambda: label(mission, positions)),
        ("run an automaton", lambda: run(automaton, labels)),
        ("length and effort", lambda: cost(sampling.paths(points))),
        ("all of these (target 20)", labelled_and_costed),
        ("with passages, rings, walls and margins", lambda: problem.costs(candidates)),
    ]
    print(f"{platform.machine()}, Python {platform.python_version()}, numpy {np.__version__}, {arguments.paths} paths")
    for name, function in rows:
        print(f"{name:<42} {least(function, arguments.repeats):8.2f} ms")


if __name__ == "__main__":
    run_benchmark(main, ["--paths", "50", "--repeats", "1"])
