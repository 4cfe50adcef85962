"""The flight that links to Crazyflies are tried with."""

import pytest

from flight.link.phases import Stage


@pytest.fixture(scope="module")
def flown() -> tuple[Stage, ...]:
    from tests.helpers.vehicles.crazyflie_stages import (
        short_flight,  # here: it is planned, which other links' tests do not need
    )

    return short_flight()


@pytest.fixture(scope="module")
def mission(flown):
    return flown[0].plan.mission
