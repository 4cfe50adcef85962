"""A certified team to export."""

from __future__ import annotations

import pytest

import flight
from tests.helpers.stand_ins import flight as made_flight
from tests.helpers.stand_ins import stand_in


@pytest.fixture(scope="module")
def certified():
    plan, team = made_flight()
    team = flight.with_hovers(team)
    return team, stand_in(plan, team)
