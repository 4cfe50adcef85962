"""Times of discrete planning: the formula patterns of Spot, twelve goals, growing teams, an office grid.

Run `python tests/benchmarks/discrete.py`, or through pytest with `-s`. Times are CPU seconds of this process (the few large
formulas that are translated in a process of their own: wall-clock seconds), the least of several runs.
"""

from __future__ import annotations

import itertools
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from ltlplan.automata import translate
from ltlplan.budget import TooLarge
from ltlplan.conjunction import Task, conjunct_automata
from ltlplan.lasso import cheapest_lasso
from ltlplan.missions import load_mission
from ltlplan.products import TeamAutomaton, full_product, full_product_size
from ltlplan.search import assign
from ltlplan.systems import Systems
from ltlplan.team import Team
from ltlplan.team_search import plan_team
from tests.worlds import world
from verify.data import Formula, Mission, parse_formula

PATTERNS = ("DAC", "EH", "HKRSS", "SB", "P")


def places(
    count: int, robots: int = 1, seed: int = 0
) -> tuple[dict[str, tuple[float, float]], tuple[tuple[float, float], ...]]:
    """Return disjoint places and starts, drawn from a square of ten metres."""
    rng = np.random.default_rng(seed)
    points: list[tuple[float, float]] = []
    while len(points) < count + robots:
        x, y = (float(v) for v in rng.uniform(-5, 5, 2))
        if all(math.dist((x, y), p) > 0.7 for p in points):
            points.append((round(x, 3), round(y, 3)))
    return {f"p{i + 1}": p for i, p in enumerate(points[:count])}, tuple(points[count:])


def least(run: Callable[[], Any], times: int = 3, clock: Callable[[], float] = time.process_time) -> float:
    """Return the least time of some runs, s."""
    taken: list[float] = []
    for _ in range(times):
        start = clock()
        run()
        taken.append(clock() - start)
    return min(taken)


def written(formula: Any) -> str:
    """Return one of Spot's formulas in full, in the grammar of missions."""
    kind = formula.kindstr()
    if kind in ("ap", "tt", "ff"):
        return {"ap": f'"{formula.ap_name()}"' if kind == "ap" else "", "tt": "1", "ff": "0"}[kind]
    inner = [written(child) for child in formula]
    prefix = {"Not": "!", "X": "X ", "F": "F ", "G": "G ", "strong_X": "X[!] "}
    if kind in prefix:
        return f"{prefix[kind]}({inner[0]})"
    infix = {"And": "&", "Or": "|", "Implies": "->", "Equiv": "<->", "Xor": "xor"}
    return "(" + f" {infix.get(kind, kind)} ".join(inner) + ")"


def pattern_times(trace: str) -> list[tuple[float, str, str]]:
    """Translate and plan each pattern over twenty disjoint regions; return (s, outcome, formula), slowest first."""
    import spot
    import spot.gen as gen

    spot_patterns = gen.ltl_patterns(*[getattr(gen, f"LTL_{name}_PATTERNS") for name in PATTERNS])
    regions, starts = places(20)
    system = Systems(world("true", regions=regions, starts=starts)).of("quad0")
    found: list[tuple[float, str, str]] = []
    for pattern in spot_patterns:
        formula = parse_formula(written(pattern))
        names = {n: Formula("name", (), f"p{i + 1}") for i, n in enumerate(sorted(formula.names()))}
        formula = formula.substitute(names)
        start = time.perf_counter()
        if trace == "finite":
            team = Team([system])
            run = plan_team(team, Task(conjunct_automata(formula, "finite"), team.letters), _budget()).run
        else:
            run = cheapest_lasso(system, conjunct_automata(formula, "infinite"))
        found.append((time.perf_counter() - start, "unsatisfiable" if run is None else "planned", str(pattern)))
    assert spot.version()
    return sorted(found, reverse=True)


def _budget() -> Any:
    from ltlplan.budget import DEFAULT_BUDGET

    return DEFAULT_BUDGET


def team_of(robots: int) -> Mission:
    """Return the fire-fighting mission with more robots, drawn at random beside the course."""
    mission = load_mission("firefighting")
    starts = np.random.default_rng(1).uniform([0.8, -1.0, 0.5], [1.5, 1.0, 1.5], (robots, 3))
    agents = {
        f"quad{i}": mission.agents["quad0"].model_copy(update={"start": tuple(map(float, start))})
        for i, start in enumerate(starts)
    }
    return mission.model_copy(update={"agents": agents})


def test_patterns() -> None:
    for trace in ("finite", "infinite"):
        times = pattern_times(trace)
        planned = sum(outcome == "planned" for _, outcome, _ in times)
        print(f"\n{len(times)} patterns, {trace}: {planned} planned, {len(times) - planned} unsatisfiable")
        for seconds, outcome, formula in times[:3]:
            print(f"  {seconds:7.3f} s  {outcome:13}  {formula[:80]}")
        assert len(times) == 169
        assert times[0][0] < 1.0


def test_twelve_goals() -> None:
    print("\nF p1 & ... & F p12 over twelve regions, smallest sum of costs")
    for robots in (1, 4):
        regions, starts = places(12, robots)
        mission = world(" & ".join(f"F p{i + 1}" for i in range(12)), regions=regions, starts=starts, robots=robots)
        seconds = least(lambda mission=mission: assign(mission), 2)
        print(f"  {robots} robots: {seconds:6.3f} s, {assign(mission).cost:.3f} m")
        assert seconds < 2.0


def test_growing_teams() -> None:
    print("\nFire-fighting, N robots: search, states of the team automaton and of the full product")
    sizes, times = (1, 2, 3, 4, 5, 10, 20, 50, 100), []
    automaton = translate(load_mission("firefighting").formula)
    for robots in sizes:
        mission = team_of(robots)
        seconds = least(lambda mission=mission: assign(mission), 5)
        times.append(seconds)
        systems = Systems(mission)
        each = [systems.of(name) for name in mission.agents]
        product = f"{float(full_product_size(each, automaton)):.3g}"
        built = ""
        if robots <= 5:
            start = time.process_time()
            try:
                built = f"walked: {full_product(each, automaton, limit=3_000_000):,} in {time.process_time() - start:.2f} s"
            except TooLarge:
                built = f"not walked: more than 3,000,000 after {time.process_time() - start:.0f} s"
        print(
            f"  {robots:4} {seconds * 1000:8.2f} ms  {TeamAutomaton(each, automaton).size():6} states  {product:>10}  {built}"
        )
    slope = np.polyfit(np.log(sizes), np.log(times), 1)[0]
    print(f"  fitted exponent: {slope:.2f}")
    assert slope <= 1.1
    assert times[-1] <= 0.060


def test_office_grid() -> None:
    width, height = 14, 8
    regions = {f"n{x}_{y}": (float(x), float(y)) for x in range(width) for y in range(height)}
    edges = [f"[home, n{x}_0]" for x in range(0, width, 3)]
    for x, y in itertools.product(range(width), range(height)):
        edges += [f"[n{x}_{y}, n{x + 1}_{y}]"] if x + 1 < width and not (x == 6 and y not in (0, 5)) else []
        edges += [f"[n{x}_{y}, n{x}_{y + 1}]"] if y + 1 < height else []
    starts = tuple((float(x), -1.0) for x in range(0, 18, 3))
    print("\nSix robots on a grid of 112 places")
    for formula in ("F n0_7 & F n5_5 & F n9_3 & F n13_7", "F n0_7 & F n5_5 & F n9_3 & F n13_7 & F(n3_3 & F n12_1)"):
        extra = f"environment: {{start: home, edges: [{', '.join(edges)}]}}"
        mission = world(formula, robots=6, regions=regions, starts=starts, extra=extra)
        seconds = least(lambda mission=mission: assign(mission), 1)
        print(f"  {seconds:6.2f} s, {assign(mission).tried} plans tried: {formula}")
        assert seconds < 30


if __name__ == "__main__":
    test_patterns()
    test_twelve_goals()
    test_growing_teams()
    test_office_grid()
