"""Times of discrete planning: the formula patterns of Spot, twelve goals, growing teams, an office grid, robots that interact.

Run `python tests/benchmarks/discrete.py`, or through pytest with `-s`. Times are CPU seconds of this process (the few large
formulas that are translated in a process of their own: wall-clock seconds), the least of several runs.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.logic.translation import translate
from ltlplan.missions import load_mission
from ltlplan.reproduction.published_missions import office_grid
from ltlplan.search.cycles.lasso import cheapest_lasso
from ltlplan.search.exact import assign
from ltlplan.search.own.reading import OwnTask
from ltlplan.search.team_planning import plan_team
from ltlplan.systems.robot_systems import Systems
from tests.helpers.benchmarks import is_smallest, require_time, run_benchmark
from tests.helpers.missions.worlds import world
from tests.helpers.words.team_automaton import TeamAutomaton, full_product, full_product_size
from verify import check_team
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
    for _ in range(1 if is_smallest() else times):
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
            run = plan_team(OwnTask([system], conjunct_automata(formula, "finite")), DEFAULT_BUDGET).run
        else:
            run = cheapest_lasso(system, conjunct_automata(formula, "infinite"))
        found.append((time.perf_counter() - start, "unsatisfiable" if run is None else "planned", str(pattern)))
    assert spot.version()
    return sorted(found, reverse=True)


def team_of(robots: int) -> Mission:
    """Return the fire-fighting mission with more robots, drawn at random beside the course."""
    mission = load_mission("firefighting")
    starts = np.random.default_rng(1).uniform([0.8, -1.0, 0.5], [1.5, 1.0, 1.5], (robots, 3))
    agents = {
        f"quad{i}": mission.agents["quad0"].model_copy(update={"start": tuple(map(float, start))})
        for i, start in enumerate(starts)
    }
    return mission.model_copy(update={"agents": agents})


def shortest_tours(starts: Sequence[tuple[float, float]], goals: Sequence[tuple[float, float]]) -> float:
    """Return the least length of straight ways that begin at the starts and come to all goals (Held and Karp 1962), m."""
    places = np.array(goals)
    between = np.linalg.norm(places[:, None] - places[None], axis=-1)
    done = np.full(1 << len(goals), np.inf)  # by sets of goals: the least length for the robots so far
    done[0] = 0.0
    for start in np.array(starts):
        first = np.linalg.norm(places - start, axis=1)
        ends = np.full((len(done), len(goals)), np.inf)
        for visited in range(1, len(done)):
            for last in range(len(goals)):
                if visited >> last & 1:
                    before = visited ^ 1 << last
                    ends[visited, last] = min(done[before] + first[last], (ends[before] + between[:, last]).min())
        done = np.minimum(done, ends.min(axis=1))
    return float(done[-1])


def cheapest_in(automaton: TeamAutomaton) -> float:
    """Return the cost of the cheapest way through the whole team automaton, by networkx."""
    graph = automaton.to_networkx()
    begin = [node for node, data in graph.nodes(data=True) if data["initial"]]
    costs = nx.multi_source_dijkstra_path_length(graph, begin, weight="cost")
    return min(cost for node, cost in costs.items() if graph.nodes[node]["accepting"])


def test_patterns() -> None:
    for trace in ("finite", "infinite"):
        times = pattern_times(trace)
        planned = sum(outcome == "planned" for _, outcome, _ in times)
        print(f"\n{len(times)} patterns, {trace}: {planned} planned, {len(times) - planned} unsatisfiable")
        for seconds, outcome, formula in times[:3]:
            print(f"  {seconds:7.3f} s  {outcome:13}  {formula[:80]}")
        assert len(times) == 169
        require_time(times[0][0], 1.0)


def test_twelve_goals() -> None:
    print("\nF p1 & ... & F p12 over twelve regions, smallest sum of costs")
    for robots in (1, 4):
        regions, starts = places(12, robots)
        mission = world(" & ".join(f"F p{i + 1}" for i in range(12)), regions=regions, starts=starts, robots=robots)
        seconds = least(lambda mission=mission: assign(mission), 2)
        cost = assign(mission).cost
        print(f"  {robots} robots: {seconds:6.3f} s, {cost:.3f} m")
        assert math.isclose(cost, shortest_tours(starts, list(regions.values())), rel_tol=1e-9)
        require_time(seconds, 2.0)


def test_goals_for_ever() -> None:
    print("goals for ever, CPU s: ", end="")
    for count in (8,) if is_smallest() else (8, 15, 30):
        regions, starts = places(count)
        asked = world(" & ".join(f"G F {name}" for name in regions), regions=regions, starts=starts)
        infinite = asked.model_copy(update={"spec": asked.spec.model_copy(update={"trace": "infinite"})})
        assert assign(infinite).complete
        print(f"{count}: {least(lambda: assign(infinite), 1):.2f}", end="  ", flush=True)  # noqa: B023 - called at once
    print()


def test_growing_teams() -> None:
    print("\nFire-fighting, N robots: search, states of the team automaton and of the full product")
    sizes, times = (1, 2, 4) if is_smallest() else (1, 2, 3, 4, 5, 10, 20, 50, 100), []
    automaton = translate(load_mission("firefighting").formula)
    for robots in sizes:
        mission = team_of(robots)
        seconds = least(lambda mission=mission: assign(mission), 5)
        times.append(seconds)
        systems = Systems(mission)
        each = [systems.of(name) for name in mission.agents]
        product = f"{float(full_product_size(each, automaton)):.3g}"
        built = ""
        if robots <= (2 if is_smallest() else 5):
            start = time.process_time()
            try:
                built = f"walked: {full_product(each, automaton, limit=3_000_000):,} in {time.process_time() - start:.2f} s"
            except TooLarge:
                built = f"not walked: more than 3,000,000 after {time.process_time() - start:.0f} s"
        team = TeamAutomaton(each, automaton)
        print(f"  {robots:4} {seconds * 1000:8.2f} ms  {team.size():6} states  {product:>10}  {built}")
        assert math.isclose(assign(mission).cost, cheapest_in(team), rel_tol=1e-9)
    slope = np.polyfit(np.log(sizes), np.log(times), 1)[0]
    print(f"  fitted exponent: {slope:.2f}")
    require_time(slope, 1.1)
    require_time(times[-1], 0.060)


GRID_GOALS = "F n0_7 & F n5_5 & F n9_3 & F n13_7"
GRID_FORMULAS = (
    GRID_GOALS,
    f"{GRID_GOALS} & F(n3_3 & F n12_1)",
    f"{GRID_GOALS} & F(n3_3 & F n12_1) & (!n9_3 U n10_6)",
    f"{GRID_GOALS} & F(n3_3 & F(n12_1 & F n3_3)) & (!n9_3 U n10_6) & (F n5_5 -> F(n5_5 & F n2_2))",
)


def test_office_grid() -> None:
    print("\nSix robots on a grid of 112 places")
    for formula in GRID_FORMULAS:
        mission = office_grid(formula)
        seconds = least(lambda mission=mission: assign(mission), 3)
        plan = assign(mission)
        print(f"  {seconds:6.3f} s, {plan.cost:.0f} m, {plan.tried} plans tried: {formula}")
        assert plan.complete
        require_time(seconds, 1.0)


INTERACTING = ("", " & G !(p1 & p2)", " & F(p1 & p2)", " & G !(p1 & p2) & F(p3 & p2)", " & F(p1 & p2) & F(p2 & p3)")


def test_robots_that_interact() -> None:
    print("\nteam: joint, N robots, F p1 & ... & F pN and more")
    for more in INTERACTING:
        for robots in (4,) if is_smallest() else (4, 6, 8, 10):
            regions, starts = places(robots, robots)
            goals = " & ".join(f"F p{i + 1}" for i in range(robots))
            mission = world(goals + more, regions=regions, starts=starts, robots=robots, team="joint")
            seconds = least(lambda mission=mission: assign(mission), 1)
            plan = assign(mission)
            gap = 0.0 if plan.complete or not plan.lower_bound else plan.cost / plan.lower_bound - 1
            found = "cheapest" if plan.complete else f"within {gap:.1%} of the cheapest"
            print(f"  {robots:3} robots {seconds:7.3f} s  {plan.cost:7.3f} m, {found}, {plan.tried} tried{more}")
            words = {name: robot.word for name, robot in plan.robots.items()}
            assert check_team(mission.formula, words, team="joint").sequential


def test_a_budget_that_ends_the_search() -> None:
    print("\nteam: joint, 12 robots, F p1 & ... & F p12 and more: what a budget of states leaves")
    more = " & F(p1 & p2) & F(p3 & p4) & G !(p2 & p5) & (!p1 U p7)"
    regions, starts = places(12, 12)
    goals = " & ".join(f"F p{i + 1}" for i in range(12))
    mission = world(goals + more, regions=regions, starts=starts, robots=12, team="joint")
    for states in (100_000,) if is_smallest() else (3_000_000, 300_000, 100_000):
        start = time.process_time()
        plan = assign(mission, budget=Budget(states=states))
        seconds = time.process_time() - start
        print(f"  {states:9,} states {seconds:6.2f} s  {plan.cost:.3f} m, at least {plan.lower_bound:.3f} m{more}")
        words = {name: robot.word for name, robot in plan.robots.items()}
        assert check_team(mission.formula, words, team="joint").sequential
        assert plan.lower_bound is not None
        assert plan.lower_bound <= plan.cost


def main() -> None:
    """Print all tables."""
    test_patterns()
    test_twelve_goals()
    test_goals_for_ever()
    test_growing_teams()
    test_office_grid()
    test_robots_that_interact()
    test_a_budget_that_ends_the_search()


if __name__ == "__main__":
    run_benchmark(main)
