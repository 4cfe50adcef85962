"""Scenarios 4.1 to 4.3 of the 2019 paper: sequences, lengths of prefix and cycle before and after cross-entropy.

python tests/benchmarks/hoops_scenarios.py [--rounds 60] [--samples 200]

Lengths are those of the planned splines. The paper asks that prefix and suffix are under 5 m each (Fig. 7).
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from ltlplan.cost import WeightedCost
from ltlplan.cross_entropy import Options, improve
from ltlplan.hoops import route, route_sequence
from ltlplan.missions import load_mission
from ltlplan.search import assign
from ltlplan.splines import Spline
from verify.data import RobotPlan


def lengths(plan: RobotPlan) -> tuple[float, float | None]:
    """Length of the prefix and of one lap, in m; no lap for a finite flight."""
    spline = Spline(plan.times, plan.cycle_waypoint)
    points = np.array([w.position for w in plan.waypoints])

    def along(begin: float, end: float) -> float:
        return float(np.linalg.norm(np.diff(spline.sampling(np.linspace(begin, end, 4000)) @ points, axis=0), axis=1).sum())

    if plan.cycle_waypoint is None:
        return along(plan.times[0], plan.times[-1]), None
    split = plan.times[plan.cycle_waypoint]
    return along(plan.times[0], split), along(split, plan.times[-1])


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
            cost=WeightedCost({"length": 1.0}),
        )
        for label, plan in (("nominal", nominal), ("optimised", found.plan)):
            prefix, cycle = lengths(plan)
            lap = "-" if cycle is None else f"{cycle:.2f}"
            visits = " ".join(f"{v.region}{v.direction or ''}" for v in plan.visits)
            print(f"{name:<16} {label:<10} {prefix:>9.2f} {lap:>9}  {visits}  word {plan.word}")


if __name__ == "__main__":
    main()
