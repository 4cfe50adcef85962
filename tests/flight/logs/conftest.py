"""A flight whose log is looked at."""

from __future__ import annotations

import pytest

import flight
from tests.helpers.motion.stand_ins import flight as made_flight
from tests.helpers.motion.stand_ins import stand_in


@pytest.fixture(scope="module")
def flown():
    plan, team = made_flight()
    cert = stand_in(plan, team)
    return team, cert, flight.fly(plan, team, cert, noise=0.001, seed=5)
