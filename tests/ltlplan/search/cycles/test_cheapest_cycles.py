"""The cheapest laps, in sum and by the dearest robot, against all short laps of small worlds."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from random import Random

import pytest

from ltlplan import plan as plan_mission
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget
from ltlplan.pipeline import certified_team
from ltlplan.search.cycles.cheapest_cycles import cycles_below, least_of_all_cycles
from ltlplan.search.exact import assign
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.transition_systems import TransitionSystem
from tests.helpers.few import few_of
from tests.helpers.missions.worlds import world
from tests.helpers.words.short_laps import World, least_cost
from tests.helpers.words.timelines import mission
from verify.data import BadInput, Infeasible, Mission, Unsatisfiable

OWN = (
    "G F a",
    "G F b",
    "G F c",
    "F a",
    "F b",
    "G !c",
    "F G !a",
    "!b U a",
    "!c U (a | b)",
    "G(a -> F c)",
    "G(a -> (a W b))",
    "G F a -> G F b",
)
JOINT = (
    *OWN, "G F(count(a) >= 2)", "G F(count(a | b) >= 2)", "G(count(a) <= 1)", "G F q0.b", "G F(q1.a & b)", "F(a & b)", "G F(a & F c)",
    "F G(q0.a | q1.a)", "G F a | F G c",
)  # fmt: skip


def drawn(rng: Random, team: str, robots: int, objective: str) -> World:
    """Return two or three robots in two or three places each, joined at random, with a formula of up to four parts."""
    each = []
    for _ in range(robots):
        size = rng.choice((2, 3))
        labels = tuple(frozenset(rng.sample("abc", rng.choice((0, 1, 1, 1, 2)))) for _ in range(size))
        ways = [(i, j) for i in range(size) for j in range(size) if i != j and rng.random() < 0.9]
        each.append(
            TransitionSystem(
                labels, tuple(tuple((j, float(rng.randint(1, 3))) for i, j in ways if i == k) for k in range(size))
            )
        )
    formula = " & ".join(f"({part})" for part in rng.sample(OWN if team == "own" else JOINT, rng.randint(1, 3)))
    asked = mission(formula, team=team, robots=robots, trace="infinite")
    return World(tuple(each), asked.formula, tuple(asked.agents), team, rng.choice((1, 1, 2)), objective=objective)


def paid(there: World, found) -> float:
    """Return what planned laps cost."""

    def cost(system: TransitionSystem, way: tuple[int, ...]) -> float:
        return sum(min(price for node, price in system.edges[a] if node == b) for a, b in pairwise(way))

    costs = [
        cost(s, p) + there.repeat * cost(s, lap) for s, p, lap in zip(there.each, found.prefixes, found.cycles, strict=True)
    ]
    return max(costs) if there.objective == "longest" else sum(costs)


def by(objective: str, repeat: int, team: str, robots: int) -> Mission:
    """Return a mission that says what is to be least, of how many laps."""
    asked = mission("true", team=team, robots=robots, trace="infinite")
    changes = {
        "spec": asked.spec.model_copy(update={"repeat": repeat}),
        "planner": asked.planner.model_copy(update={"objective": objective}),
    }
    return asked.model_copy(update=changes)


def agrees(seed: int, team: str, robots: int, most: float, objective: str) -> bool:
    """Hold the search against all laps that cost less than `most`; tell whether there were laps."""
    rng = Random(f"{team} {robots} {seed}")
    drawn_world = drawn(rng, team, robots, objective)
    asked = by(objective, drawn_world.repeat, team, robots)
    try:
        found = cycles_below(asked, drawn_world.each, drawn_world.formula, DEFAULT_BUDGET, math.inf).cycles
    except BadInput:  # a conjunct has to guess under `own`
        return False
    if found is None:
        assert least_cost(drawn_world, most) == math.inf
        return False
    cost = paid(drawn_world, found)
    by_hand = least_cost(drawn_world, min(cost + 1e-3, most))
    assert by_hand == pytest.approx(cost) if cost < most else by_hand == math.inf
    least = least_of_all_cycles(asked, drawn_world.each, drawn_world.formula, DEFAULT_BUDGET, cost)
    assert least == pytest.approx(cost, abs=1e-5)  # everybody may rest anywhere, so that to fly at the same time helps nobody
    return True


TEAMS = [
    ("joint", 2, 4.0, "longest"),
    ("joint", 3, 3.0, "longest"),
    ("own", 2, 4.0, "longest"),
    ("own", 3, 2.0, "longest"),
    ("joint", 2, 6.0, "sum"),
    ("joint", 3, 5.0, "sum"),
    ("own", 2, 6.0, "sum"),
    ("own", 3, 4.0, "sum"),
]
"""Reading, robots, what laps cost at the most that are tried, and what is to be least."""


@few_of(3, ("team", "robots", "most", "objective"), TEAMS)
def test_no_short_laps_are_cheaper(team: str, robots: int, most: float, objective: str):
    assert sum(agrees(seed, team, robots, most, objective) for seed in range(4)) >= 1


@pytest.mark.slow
@pytest.mark.parametrize(("team", "robots", "most", "objective"), TEAMS)
def test_no_laps_of_many_small_teams_are_cheaper(team: str, robots: int, most: float, objective: str):
    assert sum(agrees(seed, team, robots, most, objective) for seed in range(4, 104)) >= 30


PATROLS = (
    "G F a", "G F b", "G F c", "F a", "F c", "G F(a | b)", "!b U a", "G F(count(a) >= 2)", "G(count(b) <= 1)", "G F some(c)", "F quad1.b",
    "G F quad0.a", "G F all(free)", "G F(count(free) >= 1 & quad0.b)", "G(quad0.a -> !quad1.b)",
)  # fmt: skip
FLIGHTS = {"a": (0.0, 0.0), "b": (1.2, 0.0), "c": (0.6, 1.1)}


def patrol_agrees(seed: int, team: str, objective: str) -> bool:
    """Hold a plan against laps in which one robot flies at a time, and its bound against all others; tell whether there is one."""
    rng = Random(f"patrol {team} {seed}")
    parts = PATROLS[:7] if team == "own" else PATROLS
    starts = tuple((rng.uniform(-1.0, 2.0), rng.uniform(1.8, 2.3) + robot) for robot in range(2))
    asked = world(
        " & ".join(f"({part})" for part in rng.sample(parts, rng.randint(1, 3))),
        robots=2, regions=FLIGHTS, radii=dict.fromkeys(FLIGHTS, 0.4), starts=starts, team=team, trace="infinite", objective=objective,
        repeat=rng.choice((1, 2)),
    )  # fmt: skip
    try:
        plan = assign(asked)
    except (Infeasible, Unsatisfiable):
        return False
    each = tuple(map(Systems(asked).of, asked.agents))
    one = World(each, asked.formula, tuple(asked.agents), team, asked.spec.repeat, objective=objective)
    assert plan.lower_bound is not None
    total, most = (max, 2.2) if objective == "longest" else (sum, 3.6)
    assert plan.cost == pytest.approx(total(robot.cost for robot in plan.robots.values()))
    assert plan.complete == (plan.lower_bound == pytest.approx(plan.cost, abs=1e-5))
    assert least_cost(one, min(plan.cost, most)) == math.inf
    assert least_cost(replace(one, together=True), min(plan.lower_bound, most)) == math.inf
    return plan.complete


@pytest.mark.slow
@pytest.mark.parametrize("objective", ["sum", "longest"])
@pytest.mark.parametrize("team", ["own", "joint"])
def test_patrols_are_the_cheapest(team: str, objective: str):
    assert sum(patrol_agrees(seed, team, objective) for seed in range(60)) >= 30


def meeting(budget: Budget, objective: str):
    """Return a plan of two robots that meet in each lap, and see to two places."""
    places, starts = {"a": (0.0, 0.0), "b": (2.0, 0.0), "c": (0.0, 2.5)}, ((-1.0, 0.3), (-1.5, 2.5))
    formula = "G F(count(a) >= 2) & G F some(b) & G F some(c)"
    return assign(
        world(
            formula, robots=2, regions=places, radii={"a": 0.6}, starts=starts, team="joint", trace="infinite", objective=objective,
        ),
        budget=budget,
    )  # fmt: skip


GAPS = {"longest": "may exist", "sum": "was not ruled out"}


@pytest.mark.parametrize("objective", ["sum", "longest"])
def test_where_the_search_is_stopped_the_plan_says_that_cheaper_laps_may_exist(objective: str):
    proved, stopped = meeting(DEFAULT_BUDGET, objective), meeting(Budget(states=1_000), objective)
    assert proved.complete
    assert not any(GAPS[objective] in note for note in proved.notes)
    assert stopped.lower_bound is not None
    assert stopped.lower_bound <= proved.cost + 1e-5
    assert proved.cost <= stopped.cost
    assert stopped.complete or any(GAPS[objective] in note for note in stopped.notes)


def test_a_robot_that_rests_is_known_to_be_read_in_each_lap():
    """Both may wait in their places for ever: whoever is read in b, the other one is read in c in the next lap at the latest."""
    places = (
        TransitionSystem((frozenset(), frozenset("b")), (((1, 1.0),), ())),
        TransitionSystem((frozenset(), frozenset("c")), (((1, 1.0),), ())),
    )
    asked = mission("G F b & G(b -> F c)", team="own", robots=2, trace="infinite")
    found = cycles_below(asked, places, asked.formula, DEFAULT_BUDGET, math.inf).cycles
    assert found is not None
    assert found.prefixes == ((0, 1), (0, 1))
    assert found.cycles == ((1,), (1,))


@few_of(1, "objective", ["sum", "longest"])
def test_what_is_found_and_proved_among_few_places_is_true(objective: str):
    """Too many places for a search below any limit: it goes on below shares of what few flying robots pay."""
    proved = bounded = 0
    for seed in range(10):
        there = drawn(Random(f"few places {seed}"), "joint", 3, objective)
        asked = by(objective, there.repeat, "joint", 3)
        found = cycles_below(asked, there.each, there.formula, DEFAULT_BUDGET, math.inf).cycles
        if found is None or (cost := paid(there, found)) == 0.0:
            continue
        few = Budget(lasso=9)
        some = cycles_below(asked, there.each, there.formula, few, math.inf).cycles
        if some is not None:
            assert paid(there, some) >= cost - 1e-6
            assert not some.exact or paid(there, some) == pytest.approx(cost)
            proved += some.exact
        least = least_of_all_cycles(asked, there.each, there.formula, few, 1.5 * cost)
        assert least is None or least <= cost + 1e-6
        bounded += least is not None and least > 0.0
    assert proved >= 1
    assert bounded >= 1


FILLS = "robot:\n  initial: dry\n  states: {dry: [], wet: [water]}\n  actions: [{from: dry, to: wet, at: a}, {from: wet, to: dry, at: b}]\n"


def filling(robots: int, repeat: int, objective: str) -> Mission:
    """Return robots that all carry water again and again, and all carry none."""
    return world(
        "G F all(water) & G F all(!water)",
        robots=robots, regions={"a": (0.0, 0.0), "b": (3.0, 0.0)}, radii={"a": 0.9, "b": 0.9}, starts=((-1.0, -1.0), (4.0, 1.5), (-2.0, 0.5)),
        trace="infinite", team="joint", repeat=repeat, objective=objective, extra=FILLS,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("objective", ["sum", pytest.param("longest", marks=pytest.mark.slow)])
def test_robots_that_wait_for_each_others_actions_act_where_they_come_to(objective: str):
    plan = assign(filling(3, 2, objective))
    assert plan.complete
    assert plan.meetings
    for robot in plan.robots.values():
        assert robot.cycle_visit is not None
        assert [len(visit.actions) for visit in robot.visits[robot.cycle_visit :]] == [1, 1]


@pytest.mark.slow
@pytest.mark.parametrize("repeat", [1, 2])
def test_robots_that_all_fill_and_all_empty_in_each_lap_are_certified(repeat: int):
    assert certified_team(plan_mission(filling(2, repeat, "sum"))).certificate.holds
