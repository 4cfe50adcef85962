"""Planning methods: ours by name, functions, those of other packages, and what a method may not return."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import ltlplan
import verify
from ltlplan.allocation import Allocation, Context
from ltlplan.paths.k_best_words import exact as exact_by_paths
from ltlplan.pipeline import certified_team
from ltlplan.search.exact import exact
from tests.helpers.missions.random_missions import random_mission
from tests.helpers.packages import install
from tests.verify.test_run_folder import write_folder
from verify.data import BadInput, Mission, NotCertified, Plan, mission_to_yaml, parse_mission
from verify.data.files.mission_file import load_mission_file
from verify.data.mission import check_mission
from verify.data.names.choices import COST_TERMS, PLANNING_METHODS
from verify.data.validation.faults import MissionError

MODULE = '''
import numpy as np
from ltlplan.search.exact import exact
from ltlplan.allocation import Allocation

def last_robot(mission, context):
    """Do everything with the last robot."""
    last = list(mission.agents)[-1]
    alone = mission.changed(agents={last: mission.agents[last]})
    does = exact(alone, context).robots[last]
    idle = {name: exact(mission.changed(agents={name: mission.agents[name]}, spec=mission.spec.model_copy(
        update={"formula": "true"})), context).robots[name] for name in mission.agents}
    return Allocation(robots={**idle, last: does}, cost=does.cost)

def climb(paths):
    """Metres that are climbed."""
    rise = np.diff(paths.position[:, :, 2], axis=1)
    return np.maximum(rise, 0.0).sum(axis=1)

def scalar(paths):
    return 1.0
'''
POINTS = {
    "ltlplan.planning_methods": {"last-robot": "brings_methods:last_robot"},
    "ltlplan.cost_terms": {"climb": "brings_methods:climb", "scalar": "brings_methods:scalar"},
}


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another package that brings a planning method and cost terms."""
    install(tmp_path, monkeypatch, "brings_methods", MODULE, POINTS)


@pytest.fixture
def mission() -> Mission:
    return random_mission(2, robots=2, samples=20, rounds=2)


def asking(mission: Mission, old: str, new: str) -> str:
    """Return a mission's file with one word replaced."""
    text = mission_to_yaml(mission)
    assert old in text
    return text.replace(old, new)


def test_a_method_of_another_package_plans_by_its_name(package: None, mission: Mission):
    named = parse_mission(asking(mission, "method: mtac-e", "method: last-robot"))
    made = ltlplan.plan(named)
    assert made.method == "last-robot"
    first, last = made.robots
    assert not made.robots[first].visits
    assert made.robots[last].visits
    assert ltlplan.plan(mission, method="last-robot").robots == made.robots
    assert PLANNING_METHODS.names() == ("exact", "mtac-e", "online-mtac-e", "last-robot")


def test_a_method_may_be_given_as_a_function(mission: Mission):
    seen: list[Context] = []

    def watched(asked: Mission, context: Context) -> Allocation:
        seen.append(context)
        return exact_by_paths(asked, context)

    made = ltlplan.plan(mission, method=watched, seed=4)
    assert made.method == "watched"
    assert [context.blocked for context in seen] == [frozenset()]
    by_name = ltlplan.plan(mission, method="exact", seed=4)
    assert made.robots == by_name.robots
    assert (made.cost, made.lower_bound, made.complete) == (by_name.cost, by_name.lower_bound, by_name.complete)


def test_a_method_that_prices_by_paths_returns_them(mission: Mission):
    first: Plan = ltlplan.plan(mission, method="exact")

    def same_paths(asked: Mission, context: Context) -> Allocation:
        return replace(exact(asked, context), paths=first.robots)

    assert ltlplan.plan(mission, method=same_paths, seed=9).robots == first.robots


def test_what_is_no_allocation_of_this_mission_is_refused(mission: Mission):
    with pytest.raises(BadInput, match="'some' returned a NoneType; it must return an Allocation"):
        ltlplan.plan(mission, method=lambda_named("some", lambda _mission, _context: None))
    one = next(iter(mission.agents))
    with pytest.raises(BadInput, match="the mission's are, in order, quad0, quad1, idle ones too"):
        ltlplan.plan(mission, method=lambda asked, context: replace(only(exact(asked, context), one), paths=None))
    with pytest.raises(BadInput, match="neither a Callable nor a name"):
        ltlplan.plan(mission, method=3)  # type: ignore[arg-type]
    with pytest.raises(BadInput, match="leaves a planning method nothing to choose"):
        ltlplan.plan("hoops-sequence", method="exact")


def lambda_named(name, function):
    function.__name__ = name
    return function


def only(allocation: Allocation, robot: str) -> Allocation:
    return replace(allocation, robots={robot: allocation.robots[robot]})


def test_words_that_break_the_formula_are_not_our_bug_when_another_package_chose_them(mission: Mission):
    def nothing(asked: Mission, context: Context) -> Allocation:
        return exact(asked.model_copy(update={"spec": asked.spec.model_copy(update={"formula": "true"})}), context)

    with pytest.raises(NotCertified, match="words of the planning method 'nothing' break the formula"):
        ltlplan.plan(mission, method=nothing)


def test_names_that_nobody_brings_are_faults_of_the_file_all_at_once_each_at_its_line(mission: Mission):
    text = asking(mission, "method: mtac-e", "method: mtac-f").replace("cost: {length: 1.0}", "cost: {lenth: 1.0, snop: 2}")
    with pytest.raises(MissionError) as refused:
        parse_mission(text)
    faults = {fault.keys: fault for fault in refused.value.faults}
    assert set(faults) == {("planner", "method"), ("planner", "cost", "lenth"), ("planner", "cost", "snop")}
    method = faults["planner", "method"]
    assert method.reason == ("'mtac-f' is not a planning method. Did you mean 'mtac-e'? Names: exact, mtac-e, online-mtac-e.")
    assert method.line is not None
    assert "method: mtac-f" in text.splitlines()[method.line - 1]
    assert "'lenth' is not a cost term. Did you mean 'length'?" in faults["planner", "cost", "lenth"].reason


def test_a_cost_term_of_another_package_is_weighed(package: None, mission: Mission):
    level = ltlplan.plan(parse_mission(asking(mission, "length: 1.0", "length: 1.0, climb: 20.0")))
    assert level.cost > 0
    assert COST_TERMS.knows("climb")
    with pytest.raises(BadInput, match=r"The cost term 'scalar' returned shape \(\)"):
        ltlplan.plan(parse_mission(asking(mission, "length: 1.0", "scalar: 1.0")))


@pytest.mark.slow
def test_what_was_planned_is_judged_without_the_package(tmp_path: Path, mission: Mission):
    with pytest.MonkeyPatch.context() as patch:
        site = tmp_path / "site"
        site.mkdir()
        install(site, patch, "brings_methods", MODULE, POINTS)
        plan = ltlplan.plan(parse_mission(asking(mission, "method: mtac-e", "method: last-robot")))
        made = certified_team(plan)
        write_folder(tmp_path / "out", made.plan, made.team, made.certificate)
        assert made.certificate.holds
    assert not PLANNING_METHODS.knows("last-robot")
    assert verify.recheck(tmp_path / "out").holds
    assert verify.judge(made.plan, made.team).digest() == made.certificate.digest()
    with pytest.raises(BadInput, match="'last-robot' is not a planning method"):
        load_mission_file(tmp_path / "out" / "mission.yaml")
    assert check_mission(plan.mission, to_plan=False) == plan.mission
