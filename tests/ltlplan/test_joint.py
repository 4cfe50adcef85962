from __future__ import annotations

import itertools

import pytest
from hypothesis import given, settings

from ltlplan.automata import translate
from ltlplan.best_paths import best_paths
from ltlplan.budget import Budget, TooLarge
from ltlplan.joint import joint_possible
from ltlplan.search import assign
from ltlplan.systems import Systems, word_of
from ltlplan.why_not import NoPlan
from tests.strategies import formulas
from tests.worlds import world
from verify import check_team
from verify.data import Formula, Visit

NEAR = {"a": (0.0, 0.0), "b": (2.0, 0.0)}


@settings(max_examples=25, deadline=None)
@given(formulas(names=("a", "b"), size=4))
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
        check_team(mission.formula, dict(zip(mission.agents, choice, strict=True)), reading="joint").sequential
        for choice in itertools.product(*words.values())
    )
    try:
        plan = assign(mission, budget=Budget(states=100_000, candidates=100))
    except NoPlan:
        assert not possible
        return
    except TooLarge:
        return
    assert check_team(mission.formula, {n: r.word for n, r in plan.robots.items()}, reading="joint").sequential


def test_meetings_need_two_robots() -> None:
    with pytest.raises(NoPlan):
        assign(world("F(a & b)", regions=NEAR, robots=1, team="joint"))
    assert assign(world("F(a & b)", regions=NEAR, robots=3, team="joint")).complete


def test_one_robot_s_action_serves_another() -> None:
    robot = "robot: {initial: dry, states: {dry: [], wet: [wet]}, actions: [{from: dry, to: wet, at: a}]}"
    starts = ((-0.5, 0.0), (2.5, 0.0))
    alone = assign(world("F b & G(b -> wet)", regions=NEAR, robots=2, starts=starts, extra=robot))
    assert alone.cost == pytest.approx(2.5)  # whoever goes to b needs water of its own


def test_many_flying_robots_are_too_many_orders(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ltlplan.joint.MAX_ACTIVE", 1)
    with pytest.raises(TooLarge, match="robots that fly"):
        assign(world("F a & F b", regions=NEAR, robots=2, starts=((-0.5, 0.0), (2.5, 0.0)), team="joint"))


def test_possible_or_not() -> None:
    mission = world("true", regions=NEAR, robots=2)
    systems = Systems(mission)
    each = [systems.of(name) for name in mission.agents]
    assert joint_possible(each, [translate("F(a & b)")], Budget())  # type: ignore[list-item]
    assert not joint_possible(each[:1], [translate("F(a & b)")], Budget())  # type: ignore[list-item]


def test_best_paths_come_in_order() -> None:
    graph = {"s": [("x", 1.0), ("y", 2.0)], "x": [("t", 2.0)], "y": [("t", 0.5)], "t": [("s", 0.0)]}
    found = itertools.islice(
        best_paths(["s"], lambda key: graph[key], lambda key: 0.0 if key == "t" else None, each=4, states=100), 4
    )
    assert [round(path.cost, 6) for path in found] == [2.5, 3.0, 5.0, 5.5]
