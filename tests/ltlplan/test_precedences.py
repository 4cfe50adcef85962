import pytest

from ltlplan.precedences import with_waits
from tests.verify.data.test_plan import firefighting_plan
from verify.data import NotCertified, Plan, Visit, Witness
from verify.data.plan import Precedence


def plan() -> Plan:
    base = firefighting_plan()
    robots = dict(base.robots)
    robots["quad0"] = robots["quad0"].model_copy(update={"visits": (Visit(region="water"), Visit(region="smoke"))})
    robots["quad1"] = robots["quad1"].model_copy(update={"visits": (Visit(region="loc1"), Visit(region="smoke"))})
    return base.model_copy(update={"robots": robots})


def refusal(first: tuple[str, int], then: tuple[str, int]) -> Witness:
    return Witness(claim="formula", sentence="", order=((first, then),))


def test_waits_are_kept_once() -> None:
    once = with_waits(plan(), [refusal(("quad0", 0), ("quad1", 1))])
    assert once.precedences == (Precedence(first=("quad0", 0), then=("quad1", 1)),)
    assert with_waits(once, [refusal(("quad0", 0), ("quad1", 1))]) is once


def test_witnesses_without_order_change_nothing() -> None:
    made = plan()
    assert with_waits(made, [Witness(claim="limits.speed", sentence="")]) is made


def test_a_circle_of_waits_is_refused_by_name() -> None:
    first = with_waits(plan(), [refusal(("quad0", 1), ("quad1", 0))])
    with pytest.raises(NotCertified, match=r"quad1's visit of smoke|quad0's visit of smoke"):
        with_waits(first, [refusal(("quad1", 1), ("quad0", 0))])
