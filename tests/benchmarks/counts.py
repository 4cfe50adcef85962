"""Times of counts under `team: joint`: planning teams of 2 to 30 robots, and counts beside the same written out with names; and formulas that come apart.

Run `python tests/benchmarks/counts.py`. Times are CPU seconds of this process, the least of several runs.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from fractions import Fraction
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import ltlplan
from ltlplan.logic.conjunction import conjunct_automaton
from ltlplan.search.exact import assign, under_precedences
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.missions.apart_missions import goals, parcels, patrol, show
from tests.helpers.missions.worlds import world
from verify.data import Mission
from verify.model_checking.timeline import Change, Enclosure, Relations, Timeline
from verify.model_checking.word_claims import judge_formula

PLACES = {"a": (0.0, 0.0), "b": (6.0, 0.0), "home": (0.0, 8.0)}
RADII = dict.fromkeys(PLACES, 2.0)
STARTS = tuple((-8.0 + 1.6 * (i % 10), -6.0 - 1.6 * (i // 10)) for i in range(40))
TEN = "F(count(a) >= 5) & G(count(b) <= 2) & F all(home)"
THIRTY = "F(count(a) >= 15) & F(count(b) >= 2) & G(count(b) <= 2) & F all(home)"


def team(formula: str, robots: int) -> Mission:
    """Return a mission of some robots over three places."""
    return world(formula, robots=robots, regions=PLACES, radii=RADII, starts=STARTS, team="joint")


def planned(formula: str, robots: int, runs: int = 3) -> float:
    """Return the least CPU time of planning, s, automata made anew."""
    taken: list[float] = []
    for _ in range(runs):
        mission = team(formula, robots)
        conjunct_automaton.cache_clear()
        begin = time.process_time()
        assign(mission)
        taken.append(time.process_time() - begin)
    return min(taken)


def judged(formula: str, robots: int) -> float:
    """Return the CPU time of judging stays that overlap, s."""
    mission = team(formula, robots)
    lines = {}
    for i, name in enumerate(mission.agents):
        stay = [(Fraction(1) + Fraction(i, 50), "must"), (Fraction(8) + Fraction(i, 50), "no")]
        changes = tuple(Change(Enclosure(at, at + Fraction(1, 4)), "a", status) for at, status in stay)
        lines[name] = Timeline(name, dict.fromkeys(PLACES, "no"), changes, Fraction(12))
    begin = time.process_time()
    (verdict,) = judge_formula(mission, lines, Relations(), detail="answer")
    assert verdict, verdict.sentence
    return time.process_time() - begin


def with_names(robots: int, least: int) -> str:
    """Return `F(count(a) >= least)` written out with names."""
    ways = ("&".join(f"quad{i}.a" for i in chosen) for chosen in itertools.combinations(range(robots), least))
    return f"F({' | '.join(f'({way})' for way in ways)})"


def come_apart(robots: int, count: int) -> None:
    """Print what formulas take, from mission to plan, of which each part concerns one robot, or anybody."""
    missions = {f"show of {n}, by names": show(n) for n in (4, 5, 12) if n <= robots}
    missions |= {f"patrol of four places, {n} robots": patrol(n) for n in (2, 3) if n <= robots}
    missions |= {f"three parcels, {n} robots": parcels(n) for n in (2, 3, 6) if n <= robots}
    missions |= {
        f"{count} goals, one robot, {'on a grid' if seed == 0 else f'seed {seed}'}": goals(count, seed) for seed in range(6)
    }
    own = {f"three parcels under `own` and precedences, {n} robots": parcels(n, team="own") for n in (2, 6) if n <= robots}
    for name, mission in (missions | own).items():
        conjunct_automaton.cache_clear()
        begin = time.process_time()
        plan = ltlplan.plan(mission, method=under_precedences if name in own else None)
        taken = time.process_time() - begin
        print(f"| {name} | {taken:.2f} s | {plan.cost:.2f} | {'yes' if plan.complete else 'no'} |")


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=6, help="most robots beside formulas with names")
    parser.add_argument("--apart", type=int, default=12, help="most robots of formulas that come apart")
    parser.add_argument("--goals", type=int, default=32, help="goals of one robot")
    asked = parser.parse_args()
    print("| formula that comes apart | time | cost | proved cheapest |")
    come_apart(asked.apart, asked.goals)
    print("robots: count planned, with names planned, count judged, with names judged (s)")
    for robots in range(2, asked.robots + 1):
        count, names = "F(count(a) >= 2)", with_names(robots, 2)
        row = planned(count, robots), planned(names, robots, 1), judged(count, robots), judged(names, robots)
        print(robots, *(f"{seconds:.3f}" for seconds in row))
    print(f"ten robots, {TEN}: {planned(TEN, 10):.2f} s")
    print(f"thirty robots, {THIRTY}: {planned(THIRTY, 30, 1):.2f} s")
    print(f"thirty robots judged, F(count(a) >= 30): {judged('F(count(a) >= 30)', 30):.3f} s")


if __name__ == "__main__":
    run_benchmark(main, ["--robots", "2", "--apart", "2", "--goals", "6"])
