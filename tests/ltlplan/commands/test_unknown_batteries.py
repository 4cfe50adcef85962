"""Vehicles whose battery cannot be held against a live flight's length are refused, unless that is accepted."""

import pytest

import ltlplan
from ltlplan.commands.support.links import Asked, require_batteries
from tests.helpers.live.live_missions import pair
from verify.data import BadInput

MISSION = pair("[-1.0, 0.4, 1.0]", "[1.0, 0.4, 1.0]")


def asked(kind: str, *unchecked: str) -> Asked:
    return Asked(kind, (), (), None, False, unchecked)


@pytest.mark.parametrize("kind", ["crazyflie", "mavlink"])
def test_batteries_that_cannot_be_checked_are_refused_before_anything_is_proved(kind: str) -> None:
    mission = ltlplan.parse_mission(MISSION)
    with pytest.raises(BadInput, match=r"the battery of one, two lasts .* add --unchecked battery"):
        require_batteries(asked(kind, "heading"), mission)
    assert "the battery of one, two lasts" in require_batteries(asked(kind, "battery"), mission)


def test_simulated_vehicles_and_those_with_an_endurance_are_checked() -> None:
    mission = ltlplan.parse_mission(MISSION)
    assert require_batteries(asked("simulated"), mission) == ""
    vehicle = mission.vehicle_of("one").model_copy(update={"endurance": 300.0})
    assert require_batteries(asked("crazyflie"), mission.model_copy(update={"vehicle": vehicle})) == ""
