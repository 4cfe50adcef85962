"""How what a robot did is read: in the order of its times, where they tell one."""

from __future__ import annotations

import pytest

from verify.recordings.recorded_visits import Token, unreadable


@pytest.mark.parametrize(("begins", "either"), [(0.5, True), (1.0, True), (1.001, False)])
def test_what_may_happen_at_one_time_is_read_in_either_order(begins: float, either: bool) -> None:
    first = Token("a", frozenset({"a"}), sure=True, start=0.0, stop=1.0)
    second = Token("b", frozenset({"b"}), sure=True, start=begins, stop=2.0)
    assert unreadable(["a", "b"], [first, second]) is None
    assert (unreadable(["b", "a"], [first, second]) is None) == either
