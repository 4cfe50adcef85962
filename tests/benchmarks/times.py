"""Bounds in seconds: judging formulas, and planning ten robots with deadlines.

`OMP_NUM_THREADS=1 python -m tests.benchmarks.times` prints milliseconds of processor time of one verdict, with and without its slack, for a formula of
20 operators over timelines of more and more changes; and seconds from a mission of ten robots to its certificate.
"""

from __future__ import annotations

import random
import sys
import time
from dataclasses import replace
from fractions import Fraction

import ltlplan
from ltlplan.pipeline import certified_team
from verify.data.files.mission_file import parse_mission
from verify.data.language.formula_reader import parse_formula
from verify.model_checking.timeline import Change, Enclosure, Relations, Timeline
from verify.model_checking.timing.timed_verdict import TimedJudge

FORMULA = (
    "G[0,50] (a -> F[0,20] b) & G[0,50] (b -> F[0,20] a) & F[0,40] (a & F[0,20] b) & F[0,90] G[0,1] c & G[0,80] (!c | F[0,30] a) & "
    "(!c U[0,60] b) & F[0,70] (b & (!a U[0,9] c)) & G[0,60] F[0,40] a"
)


def timeline(changes: int, seed: int = 0) -> Timeline:
    """Return a robot that enters and leaves three regions in turn, within 100 s."""
    rng = random.Random(seed)
    times = sorted(Fraction(rng.randrange(1, 100 * 2**20), 2**20) for _ in range(2 * changes))
    found, inside = list[Change](), None
    for one, other in zip(times[::2], times[1::2], strict=True):
        region = inside or rng.choice("abc")
        found.append(Change(Enclosure(one, one), region, "may"))
        found.append(Change(Enclosure(other, other), region, "no" if inside else "must"))
        inside = None if inside else region
    return Timeline("r", dict.fromkeys("abc", "no"), tuple(found), Fraction(100))


def judged(changes: int, *, slack: bool, cycle: Fraction | None = None) -> float:
    """Return the milliseconds of one verdict; with a cycle of laps for ever."""
    formula, times = parse_formula(FORMULA), []
    for seed in range(5):
        judge = TimedJudge({"r": replace(timeline(changes, seed), cycle=cycle)}, Relations(), Fraction(1, 50))
        begin = time.process_time()
        for part in formula.conjuncts():
            judge.judge(part, slack=slack)
        times.append(time.process_time() - begin)
    return 1000 * sorted(times)[2]


def ten_robots(robots: int = 10) -> str:
    """Return a mission: a deadline for each robot, and three counts."""
    places = [(1.0 + 1.2 * (i % 5), 1.0 + 3.0 * (i // 5)) for i in range(robots)]
    goals = "".join(f"  goal{i}: {{center: [{x}, {y + 1.2}, 1.0], size: [0.6, 0.6, 0.8]}}\n" for i, (x, y) in enumerate(places))
    starts = "".join(f"  quad{i}: {{start: [{x}, {y - 0.6}, 1.0]}}\n" for i, (x, y) in enumerate(places))
    asked = [f"F[0,{6 + i % 3}] quad{i}.goal{i}" for i in range(robots)]
    asked += ["F[0,20] count(hall) >= 2", "G[0,20] count(hall) <= 4", "F[0,20] count(goal0 | goal1 | goal2) >= 2"]
    return (
        f"format: 1\nname: ten\nspec:\n  team: joint\n  formula: {' & '.join(asked)}\nregions:\n{goals}"
        f"  hall: {{center: [7.6, 3.0, 1.0], size: [1.6, 2.0, 0.8]}}\nagents:\n{starts}"
        "vehicle: crazyflie-2.1\nseparation: 0.3\nworkspace: {min: [0, 0, 0.3], max: [9, 7, 2]}\nmargin: 0.05\n"
    )


def main(sizes: tuple[int, ...] = (25, 50, 100, 200)) -> None:
    """Print the figures."""
    print("| changes | verdict, ms | with slack, ms | laps, ms | with slack, ms |\n|---|---|---|---|---|")
    for size in sizes:
        times = [judged(size, slack=slack, cycle=cycle) for cycle in (None, Fraction(20)) for slack in (False, True)]
        print(f"| {2 * size} | {' | '.join(f'{each:.1f}' for each in times)} |")
    begin = time.process_time()
    found = certified_team(ltlplan.plan(parse_mission(ten_robots())))
    lasts, took = found.certificate.duration, time.process_time() - begin
    print(f"\nTen robots with a deadline each and three counts: {lasts:.1f} s of flight, {took:.1f} s of processor time.")


if __name__ == "__main__":
    main((25, 50) if "--small" in sys.argv else (25, 50, 100, 200))
