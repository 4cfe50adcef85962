"""Laps of random teams, for ever together: how many plans are proved cheapest, and how far the others may be from it.

Run `python tests/benchmarks/laps.py [TEAMS [ROBOTS...]]`: so many random missions (40) for each number of robots (2, 3 and 4) and each reading, by the
sum of costs and by the dearest robot. Times are CPU seconds of this process, automata made anew.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from ltlplan.logic.budget import TooLarge
from ltlplan.logic.conjunction import conjunct_automaton
from ltlplan.search.exact import assign
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.missions.worlds import world
from verify.data import Infeasible, Mission, Unsatisfiable

PLACES = ("a", "b", "c", "d")
OWN = (
    "G F a", "G F b", "G F c", "G F d", "F a", "F d", "G F(a | b)", "!b U a", "!d U c", "G(a -> F b)", "G(c -> (c W d))", "F G !a",
)  # fmt: skip
JOINT = (
    *OWN, "G F(count(a) >= 2)", "G F(count(b | c) >= 2)", "G(count(d) <= 1)", "G F some(c)", "F quad1.b", "G F quad0.a", "G F all(free)",
    "G(quad0.a -> !quad1.b)", "G F(a & F c)",
)  # fmt: skip


def drawn(number: int, robots: int, team: str, objective: str) -> Mission:
    """Return a mission with two to four parts over four places."""
    rng = Random(f"{number} {robots} {team}")
    regions = {name: (rng.uniform(-3.0, 3.0), 3.0 * at - 4.5 + rng.uniform(-0.8, 0.8)) for at, name in enumerate(PLACES)}
    starts = tuple((4.5 + rng.uniform(-0.5, 0.5), 2.0 * robot - 3.0) for robot in range(robots))
    parts = rng.sample(OWN if team == "own" else JOINT, rng.randint(2, 4))
    return world(
        " & ".join(f"({part})" for part in parts),
        robots=robots, regions=regions, radii=dict.fromkeys(PLACES, 0.6), starts=starts, team=team, trace="infinite", objective=objective,
        repeat=rng.choice((1, 1, 3)),
    )  # fmt: skip


def main() -> None:
    """Print a row for each number of robots, reading and objective."""
    teams, *robots = sys.argv[1:] or ("40",)
    print("robots | reading | objective | planned | proved cheapest | no bound | greatest gap | mean, greatest time")
    for size in map(int, robots or ("2", "3", "4")):
        for team in ("own", "joint"):
            for objective in ("sum", "longest"):
                print(f"{size} | {team} | {objective} | {row(int(teams), size, team, objective)}", flush=True)


def row(teams: int, size: int, team: str, objective: str) -> str:
    """Return what came of some teams of one size."""
    times: list[float] = []
    gaps: list[float] = []
    planned = proved = boundless = 0
    for number in range(teams):
        mission = drawn(number, size, team, objective)
        conjunct_automaton.cache_clear()
        begin = time.process_time()
        try:
            found = assign(mission)
        except (Unsatisfiable, Infeasible, TooLarge):
            continue
        times.append(time.process_time() - begin)
        planned, proved = planned + 1, proved + found.complete
        boundless += found.lower_bound is None
        if not found.complete and found.lower_bound is not None:
            gaps.append(1.0 - found.lower_bound / found.cost)
    gap = f"{100 * max(gaps, default=0.0):.0f} %"
    return f"{planned} of {teams} | {proved} | {boundless} | {gap} | {sum(times) / len(times):.2f} s, {max(times):.2f} s"


if __name__ == "__main__":
    run_benchmark(main, ["2", "2"])
