"""What many robots cost: planning, refining and judging as many goals as robots, all flying at once; files; swaps; MTAC-E; words;
separation.

python tests/benchmarks/scale.py                     # 4, 8 and 12 robots
python tests/benchmarks/scale.py 4 8 16 --only words # or only: mission, files, circle, hall, mtac, words, separation
"""

from __future__ import annotations

import argparse
import math
import resource
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))

import ltlplan
import refine
import verify
from ltlplan.pipeline import certified_team
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.motion.flights import small_mission, wandering
from tests.helpers.words.timelines import APART, mission, timeline
from verify.data import Mission, parse_mission
from verify.model_checking.compositional import team_answers
from verify.model_checking.word_claims import judge_formula
from verify.motion.paths import read_team
from verify.motion.separation import minimum_distances, pairwise_distances


def scale_mission(robots: int, *, goals: int | None = None, objective: str = "longest") -> Mission:
    """Return a mission with robots on a grid of 1.5 m, and as many goals on a grid beyond, or as are asked for."""
    count = goals or robots
    side, deep = math.ceil(math.sqrt(robots)), math.ceil(count / math.ceil(math.sqrt(robots)))
    places = [(i % side * 1.5, i // side * 1.5) for i in range(max(robots, count))]
    lines = [f"format: 1\nname: scale{robots}\nspec: {{formula: {' & '.join(f'F g{i}' for i in range(count))}}}\nregions:"]
    lines += [
        f"  g{i}: {{center: [{x}, {y + side * 1.5 + 2}, 1.0], radii: [0.2, 0.2, 0.2]}}"
        for i, (x, y) in enumerate(places[:count])
    ]
    lines += ["agents:", *(f"  q{i}: {{start: [{x}, {y}, 1.0]}}" for i, (x, y) in enumerate(places[:robots]))]
    depth = side * 3 + 6 if goals is None else (side + deep) * 1.5 + 6
    lines += ["vehicle: crazyflie-2.1", f"workspace: {{min: [-3, -3, 0.2], max: [{side * 1.5 + 3}, {depth}, 4]}}"]
    return parse_mission("\n".join([*lines, f"planner: {{objective: {objective}}}", ""]))


def seconds(function: Callable[[], Any]) -> tuple[float, Any]:  # of any type: whatever the call returns
    """Return the processor time that a call takes, and what it returns."""
    start = time.process_time()
    found = function()
    return time.process_time() - start, found


def missions(sizes: Sequence[int]) -> None:
    """Time each stage of a mission."""
    for robots in sizes:
        asked = scale_mission(robots)
        planning, plan = seconds(lambda asked=asked: ltlplan.plan(asked))
        refining, team = seconds(lambda plan=plan: refine.refine(plan))
        team_answers._ANSWERS.clear()
        judging, certificate = seconds(lambda plan=plan, team=team: verify.judge(plan, team))
        print(f"| {robots} robots | {planning:.2f} | {refining:.2f} | {judging:.2f} | {certificate.holds} |", flush=True)


def mtac(sizes: Sequence[int]) -> None:
    """Time MTAC-E for as many tasks as robots, and for fifty tasks of twenty robots where that is asked for."""
    for robots in sizes:
        goals = 50 if robots == 20 else robots
        for objective in ("sum", "longest"):
            asked = scale_mission(robots, goals=goals, objective=objective)
            taken, plan = seconds(lambda asked=asked: ltlplan.plan(asked, method="mtac-e"))
            print(
                f"| {goals} tasks, {robots} robots, {objective} | {taken:.2f} | {plan.cost:.2f} | {plan.notes[1]} |", flush=True
            )


def files(sizes: Sequence[int]) -> None:
    """Time whole runs, to their certified files, and how the time grows from size to size."""
    before: tuple[int, float] | None = None
    for robots in sizes:
        asked = scale_mission(robots)
        with tempfile.TemporaryDirectory() as folder:
            taken, result = seconds(lambda asked=asked, folder=folder: ltlplan.run(asked, Path(folder) / "run"))
        grown = "" if before is None else f"{math.log(taken / before[1]) / math.log(robots / before[0]):.2f}"
        before = robots, taken
        most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"| {robots} robots | {taken:.1f} | {most:.0f} MB | {grown} | {result.certificate.holds} |", flush=True)


def circle_mission(robots: int) -> Mission:
    """Return a mission whose robots change sides of a circle, 0.94 m apart from their neighbours."""
    radius = round(0.94 * robots / (2 * math.pi), 2)
    angles = [2 * math.pi * i / robots for i in range(robots)]
    ends = [((x := radius * math.cos(a), y := radius * math.sin(a), 1.0), (-x, -y, 1.0)) for a in angles]
    return swaps(f"circle{robots}", ends, (-radius - 2, -radius - 2, 0.2), (radius + 2, radius + 2, 4))


def hall_mission(robots: int) -> Mission:
    """Return a mission whose robots take each other's places at random, in a hall of 20 by 20 by 4 m."""
    rng, places = np.random.default_rng(0), list[tuple[float, ...]]()
    while len(places) < robots:
        place = tuple(rng.uniform([0.6, 0.6, 0.6], [19.4, 19.4, 3.4]).round(3).tolist())
        if all(math.dist(place, other) > 0.8 for other in places):
            places.append(place)
    ends = rng.permutation(robots)
    return swaps(f"hall{robots}", [(places[i], places[ends[i]]) for i in range(robots)], (0, 0, 0), (20, 20, 4))


def swaps(
    name: str, ends: Sequence[tuple[Sequence[float], Sequence[float]]], low: Sequence[float], high: Sequence[float]
) -> Mission:
    """Return a mission that asks for nothing but ends."""
    lines = [f"format: 1\nname: {name}\nspec: {{formula: 'true'}}\nvehicle: crazyflie-2.1\nseparation: 0.3"]
    lines += [f"regions: {{far: {{center: [{high[0] - 0.3}, {high[1] - 0.3}, {high[2] - 0.3}], radii: [0.1, 0.1, 0.1]}}}}"]
    lines += [f"workspace: {{min: {list(low)}, max: {list(high)}}}", "agents:"]
    lines += [f"  q{i}: {{start: {list(start)}, end: {list(end)}}}" for i, (start, end) in enumerate(ends)]
    return parse_mission("\n".join([*lines, ""]))


def swapping(sizes: Sequence[int], made: Callable[[int], Mission]) -> None:
    """Time swaps from the mission to the certificate, and compare the team's flight with the longest that is planned alone."""
    for robots in sizes:
        asked = made(robots)
        taken, done = seconds(lambda asked=asked: certified_team(ltlplan.plan(asked)))
        flown = max(flight.duration for flight in done.team.values())
        alone = max(robot.times[-1] for robot in done.plan.robots.values())
        print(f"| {robots} robots | {taken:.1f} | {flown:.1f} | {alone:.1f} | {done.rounds} |", flush=True)


def words(sizes: Sequence[int]) -> None:
    """Time formulas about robots that deliver from a to b all at once."""
    formulas = ("F a & F b & G !c", "G(a -> F b)", "F(a & F b)", "F G !a", "G !(a & b)")
    for robots in sizes:
        row: list[str] = []
        for team in ("own", "joint"):
            flown = [timeline(f"q{i}", ("a", 2 + i / 100, 5), ("b", 8, 11 + i / 100), edge=0.3) for i in range(robots)]
            if team == "joint":  # unions of robots that are at one place together are what grows; so one after another
                flown = [timeline(f"q{i}", ("ab"[i % 2], 1 + i / 8, 1.1 + i / 8), edge=0.01) for i in range(robots)]
            lines = {line.robot: line for line in flown}
            for formula in formulas:
                team_answers._ANSWERS.clear()
                asked = mission(formula, robots=robots, team=team)
                taken, (verdict,) = seconds(
                    lambda asked=asked, lines=lines: judge_formula(asked, lines, APART, detail="answer")
                )
                row.append(f"{taken * 1e3:.0f} {verdict.outcome}")
        print(f"| {robots} robots | {' | '.join(row)} |", flush=True)


def separation(sizes: Sequence[int]) -> None:
    """Time the least distances of all pairs of robots that wander in one cube, thirty pieces each."""
    for robots in sizes:
        rng = np.random.default_rng(0)
        team = {f"r{i}": wandering(rng, pieces=30) for i in range(robots)}
        asked = small_mission(regions="", starts=[[0.0, 0.0, 1.0]])
        (agent,) = asked.agents.values()
        starts = {name: tuple(flight.coefficients[0, :3, 0].tolist()) for name, flight in team.items()}
        agents = {name: agent.model_copy(update={"start": start}) for name, start in starts.items()}
        paths = read_team(asked.model_copy(update={"agents": agents}), team)
        taken, found = seconds(lambda paths=paths: pairwise_distances(paths))
        more, _ = seconds(lambda found=found: minimum_distances(found))
        print(f"| {robots} robots | {len(found.pairs)} | {len(found.intervals)} | {taken + more:.2f} |", flush=True)


def main() -> None:
    """Print what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sizes", nargs="*", type=int, default=[4, 8, 12])
    measures: dict[str, Callable[[Sequence[int]], None]] = {
        "mission": missions,
        "files": files,
        "circle": lambda sizes: swapping(sizes, circle_mission),
        "hall": lambda sizes: swapping(sizes, hall_mission),
        "mtac": mtac,
        "words": words,
        "separation": separation,
    }
    parser.add_argument("--only", choices=tuple(measures))
    asked = parser.parse_args()
    for name, measure in measures.items():
        if asked.only in (None, name):
            print(f"\n{name}")
            measure(asked.sizes)


if __name__ == "__main__":
    run_benchmark(main, ["2"])
