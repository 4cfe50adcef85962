from __future__ import annotations

import itertools
import math
from collections.abc import Collection

import pytest
from hypothesis import strategies as st

from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.logic.translation import translate
from ltlplan.search.exact import assign
from ltlplan.search.explanations.unsatisfiable_cores import NoPlan
from ltlplan.search.joint.reading import JointReading, JointTask
from ltlplan.search.sequential_reading import Objective
from ltlplan.search.team_planning import least_in_one_order, plan_team
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.transition_systems import TransitionSystem
from ltlplan.systems.visit_words import word_of
from tests.helpers.few import few_of, given_few
from tests.helpers.missions.apart_missions import parcels
from tests.helpers.missions.worlds import world
from tests.helpers.words.graphs import simple_words, systems, tasks
from tests.strategies import formulas
from verify import check_team
from verify.data import Formula, Visit, Word
from verify.data.sections import TeamReading

NEAR = {"a": (0.0, 0.0), "b": (2.0, 0.0)}


@given_few(2, 15, formulas(names=("a", "b"), size=4))
def test_joint_plans_against_brute_force(formula: Formula) -> None:
    mission = world(str(formula), regions=NEAR, robots=2, team="joint")
    tours = [(), ("a",), ("b",), ("a", "b"), ("b", "a")]
    words = {
        name: [
            word_of(mission, name, [Visit(region=r) for r in tour], stays=stays)
            for tour in tours
            for stays in ((True, False) if tour else (False,))
        ]
        for name in mission.agents
    }
    possible = any(
        check_team(mission.formula, dict(zip(mission.agents, choice, strict=True)), team="joint").sequential
        for choice in itertools.product(*words.values())
    )
    try:
        plan = assign(mission, budget=Budget(states=100_000, candidates=100))
    except NoPlan:
        assert not possible
        return
    except TooLarge:
        return
    assert check_team(mission.formula, {n: r.word for n, r in plan.robots.items()}, team="joint").sequential


@few_of(
    1,
    "formula",
    ["F a & F b & G !(a & b)", "F a & F b", "F(a & F b)", "F(a & b)", "F b & G(b -> a)", "F a & F G b", "F(a & F(b & F a))"],
)
def test_the_dearest_robot_of_a_joint_team_against_brute_force(formula: str) -> None:
    starts = ((-0.5, -0.5), (1.0, 2.5))
    mission = world(formula, regions=NEAR, robots=2, team="joint", objective="longest", starts=starts)
    tours = [(), ("a",), ("b",), ("a", "b"), ("b", "a"), ("a", "b", "a"), ("b", "a", "b")]
    options = []
    for name, start in zip(mission.agents, starts, strict=True):
        shown = [(tour, stays) for tour in tours for stays in ((True, False) if tour else (False,))]
        lengths = {t: sum(math.dist(p, q) for p, q in itertools.pairwise([start, *(NEAR[r] for r in t)])) for t in tours}
        options.append([(lengths[t], word_of(mission, name, [Visit(region=r) for r in t], stays=stays)) for t, stays in shown])
    kept = [
        max(one[0], two[0])
        for one, two in itertools.product(*options)
        if check_team(mission.formula, {"quad0": one[1], "quad1": two[1]}, team="joint").sequential
    ]
    plan = assign(mission)
    if not kept:
        assert plan.precedences
        return
    assert plan.complete
    assert plan.cost == pytest.approx(min(kept))
    assert plan.lower_bound == pytest.approx(min(kept), abs=1e-5)


def test_meetings_need_two_robots() -> None:
    with pytest.raises(NoPlan):
        assign(world("F(a & b)", regions=NEAR, robots=1, team="joint"))
    assert assign(world("F(a & b)", regions=NEAR, robots=3, team="joint")).complete


def test_one_robot_s_action_serves_another() -> None:
    robot = "robot: {initial: dry, states: {dry: [], wet: [wet]}, actions: [{from: dry, to: wet, at: a}]}"
    starts = ((-0.5, 0.0), (2.5, 0.0))
    alone = assign(world("F b & G(b -> wet)", regions=NEAR, robots=2, starts=starts, extra=robot))
    assert alone.cost == pytest.approx(2.5)  # whoever goes to b needs water of its own


def test_too_many_orders_to_try(monkeypatch: pytest.MonkeyPatch) -> None:
    """What cannot be tried in every order is not claimed; one robot that flies alone needs no orders."""
    monkeypatch.setattr("ltlplan.search.joint.conjuncts.MAX_STEPS", 1)
    with pytest.raises(TooLarge, match="every order"):
        assign(world("F(a & b)", regions=NEAR, robots=2, starts=((-0.5, 0.0), (2.5, 0.0)), team="joint"))
    alone = assign(world("F(a | b & F a) & (!b U a)", regions=NEAR, robots=2, starts=((-0.5, 0.0), (2.5, 0.0)), team="joint"))
    assert alone.cost == pytest.approx(0.5)


GOALS = {f"p{i}": (2.0 * (i % 3), 1.5 * (i // 3)) for i in range(8)}
HOMES = tuple((-1.0 + 0.8 * i, -1.5) for i in range(8))


def test_eight_robots_that_watch_each_other() -> None:
    text = " & ".join(f"F p{i}" for i in range(8)) + " & G !(p0 & p1) & F(p3 & p5)"
    mission = world(text, regions=GOALS, robots=8, starts=HOMES, team="joint")
    plan = assign(mission)
    assert plan.complete
    assert check_team(mission.formula, {n: r.word for n, r in plan.robots.items()}, team="joint").sequential
    alone = assign(world(text.replace(" & F(p3 & p5)", ""), regions=GOALS, robots=8, starts=HOMES, team="joint"))
    assert alone.cost <= plan.cost + 1e-9  # less is asked


def test_conjuncts_of_one_form_are_tracked_at_once_where_most_of_them_break(monkeypatch: pytest.MonkeyPatch) -> None:
    tracked = list[int]()
    reading = JointTask.reading

    def recorded(task: JointTask, conjuncts: Collection[int], *rest: Objective) -> JointReading:
        tracked.append(len(conjuncts))
        return reading(task, conjuncts, *rest)

    monkeypatch.setattr(JointTask, "reading", recorded)
    mission = parcels(3)
    plan = assign(mission)
    assert tracked == [0, 3]  # some order breaks two of three, and no search follows that tracks these two alone
    assert plan.complete
    assert check_team(mission.formula, {n: r.word for n, r in plan.robots.items()}, team="joint").sequential


@few_of(
    1,
    ("team", "robots", "rest", "budgets"),
    [
        ("joint", 8, "F(p1 & F(p2 & F p3)) & F(p6 & p4)", (5_000,)),
        ("joint", 8, "F(p1 & F(p2 & F p3)) & F(p6 & p4)", (20_000,)),
        ("own", 4, "G(p0 -> F p7) & G(p7 -> F p5) & (F p5 -> F(p5 & F p0)) & (!p6 U p7)", (3000, 1000)),
    ],
)
@pytest.mark.slow
def test_a_budget_leaves_a_plan_and_a_bound(team: TeamReading, robots: int, rest: str, budgets: tuple[int, ...]) -> None:
    text = " & ".join(f"F p{i}" for i in range(8)) + " & " + rest
    mission = world(text, regions=GOALS, robots=robots, starts=HOMES, team=team)
    best = assign(mission)
    assert best.complete
    for states in budgets:
        plan = assign(mission, budget=Budget(states=states))
        assert check_team(mission.formula, {n: r.word for n, r in plan.robots.items()}, team=team).sequential
        assert not plan.complete
        assert plan.lower_bound is not None
        assert 0.5 * best.cost < plan.lower_bound <= best.cost + 1e-9
        assert best.cost <= plan.cost + 1e-9
        assert any("a cheaper one may exist" in note for note in plan.notes)


@given_few(10, 60, st.lists(systems(4), min_size=2, max_size=3), tasks(with_next=False))
def test_joint_plans_of_any_graphs(each: list[TransitionSystem], formula: Formula) -> None:
    try:
        found = plan_team(JointTask(each, conjunct_automata(formula, "finite")), Budget(states=200_000, candidates=1000))
    except TooLarge:
        return
    words = [simple_words(system, 3) for system in each]
    best = min(
        (
            sum(cost for cost, _ in choice)
            for choice in itertools.product(*words)
            if check_team(formula, {f"r{i}": word for i, (_, word) in enumerate(choice)}, team="joint").sequential
        ),
        default=math.inf,
    )
    if found.run is None:
        assert best == math.inf
        return
    assert found.stopped is None
    assert found.run.cost <= best + 1e-6
    paths = found.run.paths
    shown = {f"r{i}": Word(tuple(each[i].labels[node] for node in path)).compressed() for i, path in enumerate(paths)}
    assert check_team(formula, shown, team="joint").sequential
    if all(len(path) <= 3 for path in paths):
        assert found.run.cost == pytest.approx(best, abs=1e-6)


def test_possible_or_not() -> None:
    mission = world("true", regions=NEAR, robots=2)
    systems = Systems(mission)
    each = [systems.of(name) for name in mission.agents]
    together, alone = (JointTask(systems, [translate("F(a & b)")]) for systems in (each, each[:1]))  # type: ignore[list-item]
    assert least_in_one_order(together, Budget()) is not None
    assert least_in_one_order(alone, Budget()) is None
