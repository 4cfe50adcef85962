"""Precedences for words that are planned already, by hand or as a plan whose flight broke the formula."""

from __future__ import annotations

import pytest

from ltlplan.search.orders.planned_words import hold_under_precedences, with_planned_waits
from tests.helpers.missions.worlds import world
from verify.data import Plan, RobotPlan, Unsatisfiable, Visit, Waypoint, Word
from verify.trace_checking.planned_order import check_planned_order

FREE: frozenset[str] = frozenset()


def words(formula: str, *visits: str, team: str = "own") -> Plan:
    """Return a plan of robots that visit regions one after another, each named by a letter; all but the last robots leave them again."""
    starts = tuple((i % 30 - 15.0, -15.0 - i // 30) for i in range(len(visits)))
    mission = world(formula, robots=len(visits), starts=starts, team=team)
    robots: dict[str, RobotPlan] = {}
    for (name, agent), own in zip(mission.agents.items(), visits, strict=True):
        letters = (FREE, *(letter for region in own for letter in (frozenset(region), FREE)))
        robots[name] = RobotPlan(
            word=Word(letters),
            visits=tuple(Visit(region=region) for region in own),
            waypoints=(Waypoint(position=agent.start, role="start"),),
            times=(0.0,),
        )
    return Plan(mission=mission, robots=robots)


def waits(plan: Plan) -> list[str]:
    found = with_planned_waits(plan)
    assert found is not None
    assert check_planned_order(found).outcome == "holds"
    return [each.sentence(found.robots) for each in found.precedences]


@pytest.mark.parametrize("others", [0, 5])
def test_robots_whose_letters_cannot_matter_are_in_no_wait(others: int) -> None:
    also = ["c"] * others
    assert waits(words("F a & F b & (!b W a)", "b", "a", *also)) == ["quad0 enters b only when quad1 has left a"]
    assert waits(words("G !(a & b)", "a", "b", *also, team="joint")) in (
        ["quad1 enters b only when quad0 has left a"],
        ["quad0 enters a only when quad1 has left b"],
    )


def test_a_hundred_robots_of_which_two_matter() -> None:
    plan = words("!F(a & F(b & F a))", "a", "b", *[""] * 98)
    found = with_planned_waits(plan)
    assert found is not None
    assert {robot for wait in found.precedences for robot, _ in (wait.first, wait.then)} == {"quad0", "quad1"}


def test_waits_that_repair_are_named_together() -> None:
    found = waits(words("F a & F c & G(a -> (!c U b)) & G(c -> (!a U b))", "ab", "cb"))
    assert found in (["quad1 enters c only when quad0 has left b"], ["quad0 enters a only when quad1 has left b"])


def test_words_that_hold_in_every_order_get_no_waits() -> None:
    assert with_planned_waits(words("F a & F b", "a", "b")) is None


def test_words_that_no_precedences_mend_are_known_to_be_impossible() -> None:
    plan = words("G !b", "a", "b")
    assert not hold_under_precedences(plan)
    with pytest.raises(Unsatisfiable, match="under no precedences"):
        with_planned_waits(plan)
