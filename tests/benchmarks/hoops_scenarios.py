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
from ltlplan.paths.costs import Cost, SampledPaths, WeightedCost
from ltlplan.paths.cross_entropy.cross_entropy import Improvement, Options, improve
from ltlplan.paths.hoops import route, route_sequence
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.search.exact import assign
from tests.helpers.benchmarks import run_benchmark
from verify.data import Mission, RobotPlan
from verify.data.mission import check_mission
from verify.data.shapes.region import Hoop

LIMIT = 5.0
"""m for prefix and suffix each (2019 paper, Scenario 4.3)."""


def lengths(plan: RobotPlan) -> tuple[float, float | None]:
    """Length of the prefix and of one lap, in m; no lap for a finite flight."""
    spline = LeastSnapSpline(plan.times, plan.cycle_waypoint)
    points = np.array([w.position for w in plan.waypoints])

    def along(begin: float, end: float) -> float:
        return float(np.linalg.norm(np.diff(spline.sampling(np.linspace(begin, end, 4000)) @ points, axis=0), axis=1).sum())

    if plan.cycle_waypoint is None:
        return along(plan.times[0], plan.times[-1]), None
    split = plan.times[plan.cycle_waypoint]
    return along(plan.times[0], split), along(split, plan.times[-1])


def wide_course() -> Mission:
    """Return the published run of Scenario 4.2 on a course whose control points lie far out, so that the nominal lap is above 5 m."""
    mission = load_mission("hoops-published")
    places = {
        "hoop0": {"center": (1.0, 0.8, 1.0)},
        "hoop1": {"center": (0.9, -0.8, 1.0)},
        "hoop2": {"center": (-0.2, 0.0, 1.0), "yaw_deg": 180.0, "reach": 1.1, "clearance": 1.1},
    }
    hoops = {
        name: Hoop.model_validate({**hoop.model_dump(exclude={"matrix", "normal"}), **places[name]})
        for name, hoop in mission.hoops.items()
    }
    return check_mission(mission.model_copy(update={"name": "hoops-wide", "hoops": hoops}))


def longer_segment(plan: RobotPlan) -> Cost:
    """Return the cost J of Scenario 4.3 for each segment by itself: the length of the longer one of prefix and suffix, m."""
    assert plan.cycle_waypoint is not None
    share = (plan.times[plan.cycle_waypoint] - plan.times[0]) / (plan.times[-1] - plan.times[0])

    def cost(paths: SampledPaths) -> np.ndarray:
        steps = np.linalg.norm(np.diff(paths.position, axis=1), axis=2)
        begun = np.clip(share * steps.shape[1] - np.arange(steps.shape[1]), 0.0, 1.0)  # share of each step before the cycle
        return np.maximum((steps * begun).sum(axis=1), (steps * (1.0 - begun)).sum(axis=1))

    return cost


def under_the_limit(seed: int, rounds: int = 60, samples: int = 50) -> tuple[RobotPlan, Improvement]:
    """Search for a path on the wide course whose prefix and suffix are at most 5 m each; return the nominal path and what was found."""
    mission = wide_course()
    nominal = route_sequence(mission)
    options = Options(samples=samples, rounds=rounds, target=LIMIT)
    rng = np.random.default_rng(seed)
    return nominal, improve(mission, "quad0", nominal, rng=rng, options=options, cost=longer_segment(nominal))


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
        nominal, found = under_the_limit(seed)
        before, after = lengths(nominal), lengths(found.plan)
        print(
            f"  seed {seed}: prefix {before[0]:.2f} m, suffix {before[1]:.2f} m; after {len(found.history)} rounds of 50 samples "
            f"{after[0]:.2f} m and {after[1]:.2f} m; J by rounds {' '.join(f'{value:.2f}' for value in found.history)}"
        )


if __name__ == "__main__":
    run_benchmark(main, ["--rounds", "2", "--samples", "50"])
