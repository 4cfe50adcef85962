"""Actions to and fro inside one region under an infinite trace: no lap of a flight rests, so such words are not planned."""

from __future__ import annotations

import math

import pytest

from ltlplan.search.exact import assign
from tests.helpers.missions.worlds import world
from verify import check_word
from verify.data import Unsatisfiable

TO_AND_FRO = (
    "robot: {initial: dry, states: {dry: [], wet: [wet]}, actions: [{from: dry, to: wet, at: a}, {from: wet, to: dry, at: a}]}"
)


@pytest.mark.parametrize("formula", ["G F wet & G F !wet", "G F wet & G F !wet & G F(a & wet)", "G(F wet & F !wet) & F b"])
def test_the_robot_leaves_and_comes_again(formula: str) -> None:
    mission = world(formula, trace="infinite", extra=TO_AND_FRO)
    robot = assign(mission).robots["quad0"]
    assert check_word(mission.formula, robot.word)
    assert robot.cycle_visit is not None
    lap = robot.visits[robot.cycle_visit :]
    assert [action.target for visit in lap for action in visit.actions] == ["wet", "dry"]
    assert frozenset() in robot.word.cycle


@pytest.mark.parametrize("formula", ["G F wet & G F !wet & F G a", "F G a & G(F wet & F !wet)"])
def test_what_needs_a_rest_with_actions_is_refused_with_the_reason(formula: str) -> None:
    with pytest.raises(Unsatisfiable, match="actions to and fro inside one region"):
        assign(world(formula, trace="infinite", extra=TO_AND_FRO))


def test_a_rest_after_the_last_action_is_a_rest() -> None:
    mission = world("G F wet & F(wet & F !wet) & F G a", trace="infinite", extra=TO_AND_FRO)
    robot = assign(mission).robots["quad0"]
    assert robot.word.cycle == (frozenset({"a", "wet"}),)
    assert robot.cycle_visit == len(robot.visits)


def test_a_lap_that_is_flown_in_part_before_the_first_one_is_not_said_to_be_the_cheapest() -> None:
    once = "robot: {initial: dry, states: {dry: [], wet: [wet]}, actions: [{from: dry, to: wet, at: a}]}"
    plan = assign(world("G F(a & wet) & G F free", regions={"a": (0.0, 0.0)}, trace="infinite", extra=once))
    there, again = math.sqrt(2.0), 2 * 0.2
    assert plan.cost == pytest.approx(there + 2 * again)
    assert not plan.complete
    assert plan.lower_bound == pytest.approx(there + again, abs=1e-5)
