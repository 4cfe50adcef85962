from fractions import Fraction

import pytest

from verify.data import parse_formula
from verify.model_checking.repair_precedences import mending_waits
from verify.model_checking.timeline import Change, Enclosure, Status, Timeline


def change(time: int, region: str, status: Status) -> Change:
    return Change(Enclosure(Fraction(time), Fraction(time)), region, status)


@pytest.mark.parametrize("unplanned", [False, True])
def test_visits_are_numbered_as_the_plan_numbers_them_whether_or_not_it_counts_the_start(unplanned: bool) -> None:
    status: dict[str, Status] = {"a": "must", "b": "no", "c": "no"}
    stays = (change(1, "a", "no"), change(4, "b", "must"), change(5, "b", "no"))
    first = Timeline("quad0", status, stays, Fraction(9), unplanned=unplanned)
    then = Timeline("quad1", dict.fromkeys("abc", "no"), (change(2, "c", "must"), change(3, "c", "no")), Fraction(9))
    order = mending_waits(parse_formula("!c U b"), "own", {"quad0": first, "quad1": then})
    assert order == ((("quad0", 0 if unplanned else 1), ("quad1", 0)),)


def test_no_waits_are_found_beyond_the_steps_that_are_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("verify.model_checking.repair_precedences.ALLOWED", 1)
    first = Timeline("quad0", dict.fromkeys("abc", "no"), (change(1, "a", "must"), change(4, "a", "no")), Fraction(9))
    then = Timeline("quad1", dict.fromkeys("abc", "no"), (change(2, "c", "must"), change(3, "c", "no")), Fraction(9))
    assert mending_waits(parse_formula("!c U a"), "own", {"quad0": first, "quad1": then}) == ()
