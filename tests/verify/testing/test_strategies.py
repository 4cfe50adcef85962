"""The strategies that are shipped: what they draw is valid, varied, and shrinks to what is short; the page on them runs."""

from __future__ import annotations

import importlib
import re
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, find, given, settings

from ltlplan.systems.visit_words import word_of
from verify import check_team
from verify.data import BadInput, MissingEngine, check_mission, parse_formula
from verify.data.plan import check_plan
from verify.testing import formulas, lassos, letters, missions, plans, soft_parts, team_words, words

PAGE = Path(__file__).parents[3] / "docs" / "testing.md"
ROBOTS = ("quad0", "quad1")
quick = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@quick
@given(formulas(("a", "free"), robots=ROBOTS))
def test_formulas_read_as_they_are_written(formula):
    assert parse_formula(str(formula), {"a", "free"}, robots=ROBOTS) == formula
    assert not formula.uses_next()


@quick
@given(formulas(with_next=True, size=4))
def test_formulas_without_robots_count_nobody(formula):
    assert not formula.counts
    assert formula.names() <= {"a", "b", "c"}


def drawn(strategy, number):
    """Return some values, the same in every run."""
    found = []

    @settings(max_examples=number, derandomize=True, database=None, deadline=None, phases=[Phase.generate])
    @given(strategy)
    def collect(value):
        found.append(value)

    collect()
    return found


def simplest(strategy):
    """Return what hypothesis tries first, and shrinks to."""
    return drawn(strategy, 1)[0]


def shortest(strategy, asked):
    return find(strategy, asked, settings=settings(max_examples=60, derandomize=True, database=None))


def test_every_operator_is_drawn():
    found = drawn(formulas(robots=ROBOTS), 150)
    nodes = [node for formula in found for node in formula.nodes()]
    assert {node.operator for node in nodes} == {
        *("true", "false", "name", "!", "F", "G", "&", "|", "xor", "->", "<->", "U", "W", "R", "M"),
        *("count", "all", "some", "ever", "each"),
    }
    assert {node.bound for node in nodes if node.bound} >= {(sign, k) for sign in (">=", "<=", "==") for k in (1, 2)}
    assert {node.robot for node in nodes} == {"", *ROBOTS}
    assert len(set(found)) > 75


@pytest.mark.slow
def test_what_is_drawn_shrinks_to_what_is_short():
    assert str(simplest(formulas(robots=ROBOTS))) == "a"
    assert str(simplest(lassos())) == "({})^w"
    assert {str(word) for word in simplest(team_words()).values()} == {"{}"}
    assert simplest(soft_parts()) == ()
    mission = simplest(missions())
    assert (mission.spec.formula, list(mission.agents), list(mission.regions)) == ("a", ["quad0"], ["a"])
    assert not simplest(plans()).robots["quad0"].visits
    assert shortest(letters(), lambda letter: "b" in letter) == {"b"}
    assert str(shortest(words(), lambda word: "b" in word.names())) == "{b}"
    counting = shortest(formulas(robots=ROBOTS), lambda f: any(node.operator == "count" for node in f.nodes()))
    assert str(counting) == "count(a) >= 1"


@quick
@given(formulas(("a", "b"), robots=ROBOTS, size=5), team_words(ROBOTS, ("a", "b")))
def test_teams_are_judged(formula, team):
    verdict = check_team(formula, team, "joint")
    assert verdict.sequential or not verdict.parallel


@quick
@given(missions(soft=1))
def test_missions_are_sound(mission):
    assert check_mission(mission) == mission
    assert mission.spec.team == "joint" or not mission.written.counts


@pytest.mark.slow
def test_missions_are_varied():
    found = drawn(missions(soft=2), 60)
    assert {len(m.agents) for m in found} == {len(m.regions) for m in found} == {1, 2, 3}
    assert {len(m.soft_parts) for m in found} == {0, 1, 2}
    assert {m.spec.team for m in found} == {"own", "joint"}
    assert {None if m.environment is None else m.environment.directed for m in found} == {None, True, False}
    assert any(m.written.counts for m in found)
    assert any("load" in m.written.names() for m in found)


@pytest.mark.slow
@quick
@given(plans(missions(robots=2)))
def test_plans_are_sound_and_say_what_their_visits_show(plan):
    assert check_plan(plan) == plan
    for name, robot in plan.robots.items():
        assert robot.word == word_of(plan.mission, name, robot.visits)


@pytest.mark.slow
@quick
@given(plans(missions(trace="infinite")))
def test_plans_of_infinite_traces_are_lassos(plan):
    assert check_plan(plan) == plan
    ((name, robot),) = plan.robots.items()
    assert robot.word == word_of(plan.mission, name, robot.visits, robot.cycle_visit)
    assert robot.waypoints[-1].position == robot.waypoints[robot.cycle_waypoint].position


@pytest.mark.slow
def test_laps_and_hovers_are_drawn():
    robots = [plan.robots["quad0"] for plan in drawn(plans(missions(trace="infinite")), 60)]
    assert any(robot.hovers and not robot.visits for robot in robots)
    assert any(robot.hovers and robot.visits for robot in robots)
    assert any(not robot.hovers for robot in robots)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: formulas("ab"), "names must be a sequence of one name or more"),
        (lambda: formulas(()), "names must be a sequence"),
        (lambda: formulas(size=0), "size must be 1 or more, not 0"),
        (lambda: simplest(missions(robots=9)), "robots must be from 1 to 6, not 9"),
    ],
)
def test_what_cannot_be_drawn_is_refused(make, says):
    with pytest.raises(BadInput, match=says):
        make()


def test_without_hypothesis_the_strategies_say_what_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "hypothesis", None)
    monkeypatch.delitem(sys.modules, "verify.testing.engine", raising=False)
    with pytest.raises(MissingEngine, match=r"pip install 'ltlplan\[hypothesis\]'"):
        importlib.import_module("verify.testing.engine")


def test_the_page_on_testing_runs(tmp_path, monkeypatch):
    blocks = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    (tmp_path / "from_the_page.py").write_text("\n".join(blocks), encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    page = importlib.import_module("from_the_page")
    tests = [value for name, value in vars(page).items() if name.startswith("test_")]
    assert len(tests) == 3
    for test in tests:
        assert test() is None
