"""Live flights say who flies, and of whom tracking is not proved."""

from __future__ import annotations

import ltlplan
from ltlplan.commands.support.links import controllers_said
from tests.helpers.live.live_missions import HOP
from verify.data.airframe import load_airframe
from verify.data.disturbance import Disturbance


def test_a_link_that_flies_another_controller_says_that_tracking_is_not_proved() -> None:
    mission = ltlplan.parse_mission(HOP)
    told = mission.changed(disturbance=Disturbance(airframe=load_airframe("crazyflie-2.1")))
    for flown, said in ((mission, False), (told, True)):
        assert ("Tracking is not proved for them." in controllers_said({"one": "px4"}, flown)) is said
    assert "not proved" not in controllers_said({"one": "mellinger"}, told)
