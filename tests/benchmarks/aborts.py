"""What certificates of aborts cost, and whether the judge ever says yes where a dense sampler says no.

python tests/benchmarks/aborts.py                 # times: shipped missions, then thirty and a hundred robots
python tests/benchmarks/aborts.py --teams 1000    # random teams against dense sampling of separation, instead
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))

import ltlplan
from ltlplan.pipeline import certified_team
from ltlplan.result import aborts_of
from tests.benchmarks.scale import circle_mission, hall_mission, scale_mission
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.motion.braking import closest, random_team
from tests.helpers.motion.flights import small_mission
from verify.data import Mission, parse_mission
from verify.motion.braking.pairs import closest_braking
from verify.motion.paths import read_team

SHIPPED = ("firefighting", "office", "wall-swap", "warehouse")
LENGTH = 1.0


def times(shipped: Sequence[str], robots: int) -> None:
    """Time the certificates of aborts."""
    folder = Path(ltlplan.__file__).parent / "missions"
    asked: list[Mission] = [parse_mission((folder / f"{name}.yaml").read_text()) for name in shipped]
    asked += [scale_mission(robots), circle_mission(robots), hall_mission(robots)]
    if robots >= 30:
        asked.append(hall_mission(100))
    for mission in asked:
        done = certified_team(ltlplan.plan(mission))
        start = time.process_time()
        verdict = aborts_of(mission, done.team, done.certificate)
        taken = time.process_time() - start
        print(f"| {mission.name} | {len(done.team)} | {taken:.2f} | {bool(verdict)} |", flush=True)


def against_sampling(teams: int) -> None:
    """Ask random teams for a little more, and for a little less, than a dense sampler finds, and count what is said."""
    count: Counter[tuple[str, str]] = Counter()
    for seed in range(teams):
        team, error = random_team(np.random.default_rng(seed)), (0.0, 0.02, 0.2)[seed % 3]
        sampled = closest(team, LENGTH, error=error, instants=500, shares=20)
        agents = {name: {"start": tuple(path.coefficients[0, :3, 0].tolist())} for name, path in team.items()}
        base = small_mission()
        first = next(iter(base.agents.values()))
        world = base.model_copy(update={"agents": {name: first.model_copy(update=start) for name, start in agents.items()}})
        paths = read_team(world, team)
        for label, more in (("0.5 mm more", 0.0005), ("5 mm less", -0.005)) if sampled > 0.03 else (("5 cm more", 0.05),):
            asked = [[Fraction(sampled + more)] * len(team)] * len(team)
            found = closest_braking(paths, Fraction(LENGTH), asked, Fraction(error))
            said = "proved" if found is None else "refuted" if found.fails else "undecided"
            count[label, said] += 1
            assert more < 0 or found is not None, f"team {seed} is proved to keep what a sampler denies"
    for (label, said), number in sorted(count.items()):
        print(f"| {label} than sampled | {said} | {number} |")


def main() -> None:
    """Do what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--teams", type=int, default=0)
    parser.add_argument("--missions", nargs="*", default=SHIPPED)
    parser.add_argument("--robots", type=int, default=30)
    given = parser.parse_args()
    if given.teams:
        against_sampling(given.teams)
    else:
        times(given.missions, given.robots)


if __name__ == "__main__":
    run_benchmark(main, ["--missions", "firefighting", "--robots", "4"], ["--teams", "3"])
