"""Laps whose dearest robot pays least, against all short laps of small worlds."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from random import Random

import pytest

from ltlplan.logic.budget import DEFAULT_BUDGET, Budget
from ltlplan.search.exact import assign
from ltlplan.search.lassos.labels.dearest_team_laps import laps_for_dearest, least_for_dearest
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.transition_systems import TransitionSystem
from tests.helpers.short_laps import World, least_dearest
from tests.helpers.timelines import mission
from tests.helpers.worlds import world
from verify.data import BadInput, Infeasible, Unsatisfiable

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


def drawn(rng: Random, team: str, robots: int) -> World:
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
    return World(tuple(each), asked.formula, tuple(asked.agents), team, rng.choice((1, 1, 2)))


def paid(systems: tuple[TransitionSystem, ...], found, repeat: int) -> float:
    """Return what the dearest robot of planned laps pays."""

    def cost(system: TransitionSystem, way: tuple[int, ...]) -> float:
        return sum(min(price for node, price in system.edges[a] if node == b) for a, b in pairwise(way))

    return max(cost(s, p) + repeat * cost(s, lap) for s, p, lap in zip(systems, found.prefixes, found.laps, strict=True))


def agrees(seed: int, team: str, robots: int, most: float) -> bool:
    """Hold the search against all laps whose robots pay less than `most`; tell whether there were laps."""
    rng = Random(f"{team} {robots} {seed}")
    drawn_world = drawn(rng, team, robots)
    asked = mission("true", team=team, robots=robots, trace="infinite")
    asked = asked.model_copy(update={"spec": asked.spec.model_copy(update={"repeat": drawn_world.repeat})})
    try:
        found = laps_for_dearest(asked, drawn_world.each, drawn_world.formula, DEFAULT_BUDGET, math.inf)
    except BadInput:  # a conjunct has to guess under `own`
        return False
    if found is None:
        assert least_dearest(drawn_world, most) == math.inf
        return False
    cost = paid(drawn_world.each, found, drawn_world.repeat)
    by_hand = least_dearest(drawn_world, min(cost + 1e-3, most))
    assert by_hand == pytest.approx(cost) if cost < most else by_hand == math.inf
    least = least_for_dearest(asked, drawn_world.each, drawn_world.formula, DEFAULT_BUDGET, cost)
    assert least == pytest.approx(cost, abs=1e-5)  # everybody may rest anywhere, so that to fly at the same time helps nobody
    return True


TEAMS = [("joint", 2, 4.0), ("joint", 3, 3.0), ("own", 2, 4.0), ("own", 3, 2.0)]


@pytest.mark.parametrize(("team", "robots", "most"), TEAMS)
def test_no_short_laps_have_a_cheaper_dearest_robot(team: str, robots: int, most: float):
    assert sum(agrees(seed, team, robots, most) for seed in range(4)) >= 1


@pytest.mark.slow
@pytest.mark.parametrize(("team", "robots", "most"), TEAMS)
def test_no_laps_of_many_small_teams_have_a_cheaper_dearest_robot(team: str, robots: int, most: float):
    assert sum(agrees(seed, team, robots, most) for seed in range(4, 104)) >= 30


PATROLS = (
    "G F a", "G F b", "G F c", "F a", "F c", "G F(a | b)", "!b U a", "G F(count(a) >= 2)", "G(count(b) <= 1)", "G F some(c)", "F quad1.b",
    "G F quad0.a", "G F all(free)", "G F(count(free) >= 1 & quad0.b)", "G(quad0.a -> !quad1.b)",
)  # fmt: skip
FLIGHTS = {"a": (0.0, 0.0), "b": (1.2, 0.0), "c": (0.6, 1.1)}


def patrol_agrees(seed: int, team: str) -> bool:
    """Hold a plan against laps in which one robot flies at a time, and its bound against all others; tell whether there is one."""
    rng = Random(f"patrol {team} {seed}")
    parts = PATROLS[:7] if team == "own" else PATROLS
    starts = tuple((rng.uniform(-1.0, 2.0), rng.uniform(1.8, 2.3) + robot) for robot in range(2))
    asked = world(
        " & ".join(f"({part})" for part in rng.sample(parts, rng.randint(1, 3))),
        robots=2, regions=FLIGHTS, radii=dict.fromkeys(FLIGHTS, 0.4), starts=starts, team=team, trace="infinite", objective="longest",
        repeat=rng.choice((1, 2)),
    )  # fmt: skip
    try:
        plan = assign(asked)
    except (Infeasible, Unsatisfiable):
        return False
    each = tuple(map(Systems(asked).of, asked.agents))
    one = World(each, asked.formula, tuple(asked.agents), team, asked.spec.repeat)
    assert plan.lower_bound is not None
    assert plan.cost == max(robot.cost for robot in plan.robots.values())
    assert plan.complete == (plan.lower_bound == pytest.approx(plan.cost, abs=1e-5))
    assert least_dearest(one, min(plan.cost, MOST)) == math.inf
    assert least_dearest(replace(one, together=True), min(plan.lower_bound, MOST)) == math.inf
    return plan.complete


MOST = 2.2


@pytest.mark.slow
@pytest.mark.parametrize("team", ["own", "joint"])
def test_patrols_are_the_cheapest_by_their_dearest_robot(team: str):
    assert sum(patrol_agrees(seed, team) for seed in range(60)) >= 30


def meeting(budget: Budget):
    """Return a plan of two robots that meet in each lap, and see to two places."""
    places, starts = {"a": (0.0, 0.0), "b": (2.0, 0.0), "c": (0.0, 2.5)}, ((-1.0, 0.3), (-1.5, 2.5))
    formula = "G F(count(a) >= 2) & G F some(b) & G F some(c)"
    return assign(
        world(
            formula, robots=2, regions=places, radii={"a": 0.6}, starts=starts, team="joint", trace="infinite", objective="longest",
        ),
        budget=budget,
    )  # fmt: skip


def test_where_the_search_is_stopped_the_plan_says_that_cheaper_laps_may_exist():
    proved, stopped = meeting(DEFAULT_BUDGET), meeting(Budget(states=1_000))
    assert proved.complete
    assert not any("may exist" in note for note in proved.notes)
    assert stopped.lower_bound is not None
    assert stopped.lower_bound <= proved.cost + 1e-5
    assert proved.cost <= stopped.cost
    assert stopped.complete or any("may exist" in note for note in stopped.notes)


def test_a_robot_that_rests_is_known_to_be_read_in_each_lap():
    """Both may wait in their places for ever: whoever is read in b, the other one is read in c in the next lap at the latest."""
    places = (
        TransitionSystem((frozenset(), frozenset("b")), (((1, 1.0),), ())),
        TransitionSystem((frozenset(), frozenset("c")), (((1, 1.0),), ())),
    )
    asked = mission("G F b & G(b -> F c)", team="own", robots=2, trace="infinite")
    found = laps_for_dearest(asked, places, asked.formula, DEFAULT_BUDGET, math.inf)
    assert found is not None
    assert found.prefixes == ((0, 1), (0, 1))
    assert found.laps == ((1,), (1,))
