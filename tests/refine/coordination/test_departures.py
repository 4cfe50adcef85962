"""Departures keep the order that was planned, however far clocks may be apart."""

from __future__ import annotations

import numpy as np
import pytest

from refine.coordination.departures import DepartureConflict, ScheduledPath, departures
from refine.spline.spline import Spline
from tests.helpers.few import few_of
from verify.data.plan import Precedence

SKEW = 0.02
WAIT = Precedence(first=("one", 0), then=("other", 0))


def hovering(name: str, begins: float, ends: float) -> ScheduledPath:
    """Return a flight that stays far from the other one's, with a visit from one time to another."""
    states = np.zeros((2, 4, 3))
    states[:, 0] = [0.0, 3.0 if name == "other" else 0.0, 1.0]
    return ScheduledPath(name, Spline(np.array([4.0]), states), ((begins, ends),), 0.0)


@few_of(2, "gap", [0.03, 2 * SKEW - 0.001, 2 * SKEW + 2 / 64 + 0.001])
def test_settled_departures_leave_what_clocks_may_be_apart_between_two_visits(gap: float) -> None:
    flights = [hovering("one", 1.0, 2.0), hovering("other", 2.0 + gap, 3.0)]
    given = {"one": 0.0, "other": 0.0}
    found = departures(flights, distance=0.4, z_scale=1.0, skew=SKEW, precedences=(WAIT,), given=given)
    assert isinstance(found, DepartureConflict) is (gap < 2 * SKEW)


@pytest.mark.parametrize("late", [0.0, 0.05, 0.1])
def test_departures_that_are_found_leave_it_too(late: float) -> None:
    flights = [hovering("one", 1.0, 2.0 + late), hovering("other", 1.5, 3.0)]
    found = departures(flights, distance=0.4, z_scale=1.0, skew=SKEW, precedences=(WAIT,))
    assert not isinstance(found, DepartureConflict)
    assert found["other"] + 1.5 - (found["one"] + 2.0 + late) >= 2 * SKEW
