"""Cross-entropy on random courses beside CMA-ES with ten times the computing time.

python tests/benchmarks/cross_entropy.py [--courses 30] [--rounds 200] [--samples 1000]

Both minimise length + 0.5 effort over the same points of the same nominal path; only paths that keep the word count. Times
are processor times of this process, so that other work on the machine does not count. `cmaes` comes from the package
index: pip install cmaes.
"""

from __future__ import annotations

import argparse
import math
import os
import platform
import sys
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from ltlplan.paths.costs import WeightedCost
from ltlplan.paths.cross_entropy.cross_entropy import minimise, searches
from ltlplan.paths.cross_entropy.gaussian import Options
from ltlplan.paths.sampling.path_problem import PathProblem, path_problem
from tests.helpers.benchmarks import installed, run_benchmark
from tests.helpers.missions.courses import courses

COST = WeightedCost.of({"length": 1.0, "effort": 0.5})


def ours(problem: PathProblem, rounds: int, samples: int, seed: int) -> tuple[float, float]:
    """Best cost and processor seconds of our search."""
    begin = time.process_time()
    options = Options(samples=samples, rounds=rounds)
    search, *others = searches(problem, options)
    found, _ = minimise(problem.costs, search, rng=np.random.default_rng(seed), others=others)
    return found.best_cost, time.process_time() - begin


def cma(problem: PathProblem, seconds: float, population: int, seed: int) -> tuple[float, int]:
    """Best cost and number of paths of CMA-ES, in the coordinates of our initial covariance."""
    if not installed("cmaes", "cmaes"):
        return math.nan, 0
    from cmaes import CMA

    root = np.linalg.cholesky(problem.covariance(1.0))
    size = len(problem.mean)
    optimiser = CMA(mean=np.zeros(size), sigma=0.06, seed=seed, population_size=population)
    best, count, begin = math.inf, 0, time.process_time()
    while time.process_time() - begin < seconds and not optimiser.should_stop():
        asked = [optimiser.ask() for _ in range(population)]
        costs = problem.costs(problem.mean + np.array(asked) @ root.T)
        optimiser.tell([(x, float(c) if math.isfinite(c) else 1e9) for x, c in zip(asked, costs, strict=True)])
        best, count = min(best, float(costs.min())), count + population
    return best, count


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--courses", type=int, default=30)
    parser.add_argument("--first", type=int, default=0, help="course to begin with, to share the work among processes")
    parser.add_argument("--rounds", type=int, default=200)
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--population", type=int, default=100, help="of CMA-ES")
    arguments = parser.parse_args()
    print(f"{platform.machine()}, Python {platform.python_version()}, numpy {np.__version__}")
    print(
        f"{'course':>6} {'size':>5} {'nominal':>8} {'ours':>8} {'s':>6} {'cmaes':>8} {'s':>6} {'paths':>8} {'ours/cmaes':>11}"
    )
    ratios = []
    for index, (mission, plan) in enumerate(courses(seed=2019, count=arguments.courses)):
        if index < arguments.first:
            continue
        problem = path_problem(mission, plan, COST)
        nominal = float(problem.costs(problem.mean[None])[0])
        best, seconds = ours(problem, arguments.rounds, arguments.samples, seed=0)
        other, paths = cma(problem, 10 * seconds, arguments.population, seed=0)
        ratios.append(best / other)
        print(
            f"{index:>6} {len(problem.mean):>5} {nominal:>8.3f} {best:>8.3f} {seconds:>6.1f} {other:>8.3f} "
            f"{10 * seconds:>6.1f} {paths:>8} {100 * (ratios[-1] - 1):>+10.2f}%",
            flush=True,
        )
    print(f"worst {100 * (max(ratios) - 1):+.2f} %, median {100 * (np.median(ratios) - 1):+.2f} %, target +1 %")


if __name__ == "__main__":
    run_benchmark(main, ["--courses", "1", "--rounds", "2", "--samples", "50"])
