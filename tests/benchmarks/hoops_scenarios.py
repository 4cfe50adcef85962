"""Scenarios 4.1 to 4.3 of the 2019 paper: sequences, lengths of prefix and cycle before and after cross-entropy.

python tests/benchmarks/hoops_scenarios.py [--rounds 60] [--samples 200]

Lengths are those of the planned splines. The paper asks that prefix and suffix are at most 5 m each (Fig. 7, J <= 5); on the course
for that the nominal lap is longer, and the search stops at the first path that it finds short enough.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from ltlplan.missions import load_mission
from ltlplan.paths.costs import WeightedCost
from ltlplan.paths.cross_entropy.cross_entropy import Options, improve
from ltlplan.paths.hoops import route, route_sequence
from ltlplan.reproduction.hoops_flights import LIMIT, lengths, under_the_limit
from ltlplan.search.exact import assign
from tests.helpers.benchmarks import run_benchmark


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=60)
    parser.add_argument("--samples", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    print(f"{'mission':<16} {'path':<10} {'prefix m':>9} {'cycle m':>9}  visits")
    for name in ("hoops-sequence", "hoops-ltl", "hoops-published"):
        mission = load_mission(name)
        if mission.passages is not None:
            nominal = route_sequence(mission)
        else:
            itinerary = assign(mission).robots["quad0"]
            nominal = route(mission, "quad0", itinerary.visits, itinerary.cycle_visit, word=itinerary.word)
        found = improve(
            mission,
            "quad0",
            nominal,
            rng=np.random.default_rng(arguments.seed),
            options=Options(samples=arguments.samples, rounds=arguments.rounds),
            cost=WeightedCost.of({"length": 1.0}),
        )
        for label, plan in (("nominal", nominal), ("optimised", found.plan)):
            prefix, cycle = lengths(plan)
            lap = "-" if cycle is None else f"{cycle:.2f}"
            visits = " ".join(f"{v.region}{v.direction or ''}" for v in plan.visits)
            print(f"{name:<16} {label:<10} {prefix:>9.2f} {lap:>9}  {visits}  word {plan.word}")
    print(f"Scenario 4.3, J <= {LIMIT:g} for prefix and suffix each, on a course where that is not so at first")
    for seed in range(3):
        nominal, found, _ = under_the_limit(seed)
        before, after = lengths(nominal), lengths(found.plan)
        print(
            f"  seed {seed}: prefix {before[0]:.2f} m, suffix {before[1]:.2f} m; after {len(found.history)} rounds of 50 samples "
            f"{after[0]:.2f} m and {after[1]:.2f} m; J by rounds {' '.join(f'{value:.2f}' for value in found.history)}"
        )


if __name__ == "__main__":
    run_benchmark(main, ["--rounds", "2", "--samples", "50"])
