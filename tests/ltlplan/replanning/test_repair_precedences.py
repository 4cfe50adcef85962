from fractions import Fraction

import pytest

from ltlplan.replanning.repair_precedences import Wait, repairing_waits
from tests.helpers.timelines import timeline
from verify.data import parse_formula
from verify.data.sections import TeamReading
from verify.model_checking.timeline import Change, Enclosure, Status, Timeline


def change(time: int, region: str, status: Status) -> Change:
    return Change(Enclosure(Fraction(time), Fraction(time)), region, status)


@pytest.mark.parametrize("unplanned", [False, True])
def test_visits_are_numbered_as_the_plan_numbers_them_whether_or_not_it_counts_the_start(unplanned: bool) -> None:
    status: dict[str, Status] = {"a": "must", "b": "no", "c": "no"}
    stays = (change(1, "a", "no"), change(4, "b", "must"), change(5, "b", "no"))
    first = Timeline("quad0", status, stays, Fraction(9), unplanned=unplanned)
    then = Timeline("quad1", dict.fromkeys("abc", "no"), (change(2, "c", "must"), change(3, "c", "no")), Fraction(9))
    order = repairing_waits(parse_formula("G !(b & c)"), "joint", {"quad0": first, "quad1": then})
    assert order == ((("quad1", 0), ("quad0", 0 if unplanned else 1)),)


def test_no_waits_are_found_beyond_the_steps_that_are_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ltlplan.replanning.repair_precedences.ALLOWED", 1)
    first = Timeline("quad0", dict.fromkeys("abc", "no"), (change(1, "a", "must"), change(4, "a", "no")), Fraction(9))
    then = Timeline("quad1", dict.fromkeys("abc", "no"), (change(2, "c", "must"), change(3, "c", "no")), Fraction(9))
    assert repairing_waits(parse_formula("!F(c & F a)"), "own", {"quad0": first, "quad1": then}) == ()


def waits(formula: str, *lines: Timeline, team: TeamReading = "own") -> tuple[Wait, ...]:
    return repairing_waits(parse_formula(formula), team, {line.robot: line for line in lines})


def test_a_robot_that_hovers_is_over_before_another_comes():
    asked = "!F(a & F(b & F a))"
    assert waits(asked, timeline("q0", ("a", 2, 8)), timeline("q1", ("b", 4, 6))) == ((("q0", 0), ("q1", 0)),)


def test_waits_part_what_is_not_to_be_shown_together():
    docks = timeline("q0", ("a", 2, 5)), timeline("q1", ("b", 5, 7))
    assert waits("G !(a & b)", *docks, team="joint") == ((("q0", 0), ("q1", 0)),)


def test_waits_that_repair_are_named_together():
    asked = "F a & F c & G(a -> (!c U b)) & G(c -> (!a U b))"
    found = waits(asked, timeline("q0", ("a", 2, 3), ("b", 8, 9)), timeline("q1", ("c", 5, 6), ("b", 11, 12)))
    assert found in (((("q0", 1), ("q1", 0)),), ((("q1", 1), ("q0", 0)),))


def test_robots_whose_letters_cannot_matter_are_in_no_wait():
    others = [timeline(f"q{i}", ("c", 10 - i, 11)) for i in range(2, 7)]
    found = waits("F a & F b & (!b W a)", timeline("q0", ("b", 2, 3)), timeline("q1", ("a", 5, 6)), *others)
    assert found == ((("q1", 0), ("q0", 0)),)
    found = waits("G !(a & b)", timeline("q0", ("a", 2, 5)), timeline("q1", ("b", 5, 7)), *others, team="joint")
    assert found == ((("q0", 0), ("q1", 0)),)


def test_what_no_wait_can_repair_names_none():
    assert waits("G !b", timeline("q0", ("a", 2, 3)), timeline("q1", ("b", 5, 6))) == ()


def test_a_hundred_robots_of_which_two_matter():
    lines = [timeline("q0", ("a", 2, 8)), timeline("q1", ("b", 4, 6)), *(timeline(f"q{i}") for i in range(2, 100))]
    assert waits("!F(a & F(b & F a))", *lines) == ((("q0", 0), ("q1", 0)),)
