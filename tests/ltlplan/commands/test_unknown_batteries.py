"""Whose battery cannot be held against a live flight's length is said."""

import pytest

import ltlplan
from ltlplan.commands.shared.live_flight import say_unknown_batteries
from tests.helpers.live_missions import pair


@pytest.mark.parametrize(
    ("kind", "named"),
    [
        ("crazyflie", "one, two"),
        ("mavlink", "one, two"),
        ("simulated", ""),
    ],
)
def test_whose_battery_is_not_checked_is_named(capsys, kind: str, named: str) -> None:
    mission = ltlplan.parse_mission(pair("[-1.0, 0.4, 1.0]", "[1.0, 0.4, 1.0]"))
    say_unknown_batteries(kind, mission)
    said = capsys.readouterr().out
    assert (f"the battery of {named} lasts" in said) if named else not said


def test_vehicles_with_an_endurance_are_not_named(capsys) -> None:
    mission = ltlplan.parse_mission(pair("[-1.0, 0.4, 1.0]", "[1.0, 0.4, 1.0]"))
    vehicle = mission.vehicle_of("one").model_copy(update={"endurance": 300.0})
    say_unknown_batteries("crazyflie", mission.model_copy(update={"vehicle": vehicle}))
    assert capsys.readouterr().out == ""
