"""Bounds in seconds at samples: what may be kept between two of them is not called broken."""

from __future__ import annotations

from fractions import Fraction

import pytest

from flight.monitoring.sampled_bounds import may_be_kept
from verify.data import parse_formula

STEP = Fraction(1, 100)
ALL = frozenset({"a"})
NONE = frozenset[str]()


@pytest.mark.parametrize(
    ("formula", "enters", "leaves", "end", "kept"),
    [
        ("F[0,1] a", 100, 200, 3.0, True),  # seen just at the deadline
        ("F[0,1] a", 101, 200, 3.0, False),  # it was not there at 1.00 s, when it was last looked for
        ("F[0,1.005] a", 101, 200, 3.0, True),  # it may have come in between
        ("F[0,0.995] a", 101, 200, 3.0, False),
        ("F[1,2] a", 10, 100, 3.0, False),  # it was in a at 0.99 s, and at 1.00 s no more
        ("F[0.995,2] a", 10, 100, 3.0, True),
        ("G[0,0.995] !a", 100, 200, 3.0, True),
        ("G[0,1] !a", 100, 200, 3.0, False),
        ("F[0,1] G[0,1] a", 50, 150, 3.0, True),  # for 1.00 s where it came just after 0.49 s
        ("F[0,1] G[0,1.02] a", 50, 150, 3.0, False),
        ("G[0,4] !a", 500, 501, 3.0, False),  # nobody wins by landing
        ("F[0,4] a", 100, 200, 3.0, True),
    ],
)
def test_what_may_be_kept_between_samples_is_not_broken(formula: str, enters: int, leaves: int, end: float, kept: bool) -> None:
    changes = [(0, {"r": NONE}), (enters, {"r": ALL}), (leaves, {"r": NONE})]
    flown = [change for change in changes if change[0] <= end * 100]
    assert may_be_kept(parse_formula(formula), flown, STEP, end) == kept


def test_robots_change_between_the_same_samples_in_any_order() -> None:
    changes = [(0, {"r": NONE, "s": ALL}), (100, {"r": ALL, "s": NONE})]
    assert may_be_kept(parse_formula("G[0,2] a"), changes, STEP, 3.0)
    assert may_be_kept(parse_formula("F[0,2] !a"), changes, STEP, 3.0)
    apart = [(0, {"r": NONE, "s": ALL}), (98, {"s": NONE}), (100, {"r": ALL})]
    assert not may_be_kept(parse_formula("G[0,2] a"), apart, STEP, 3.0)


def test_of_laps_for_ever_what_comes_is_not_known() -> None:
    changes = [(0, {"r": NONE})]
    assert not may_be_kept(parse_formula("F[0,1] a"), changes, STEP, 3.0, finite=False)
    assert may_be_kept(parse_formula("F[0,4] a"), changes, STEP, 3.0, finite=False)
    assert not may_be_kept(parse_formula("F[0,4] a"), changes, STEP, 3.0)
