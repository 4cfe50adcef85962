"""Live flights say who flies, and of whom tracking is not proved."""

from __future__ import annotations

import ltlplan
from flight import conditions_of
from ltlplan.commands.support.links import controllers_said, flying_controllers
from tests.helpers.live.live_missions import HOP
from verify.data.airframe import load_airframe
from verify.data.disturbance import Disturbance, StreamedSetpoints


def test_a_link_that_flies_another_controller_says_that_tracking_is_not_proved() -> None:
    mission = ltlplan.parse_mission(HOP)
    told = mission.changed(disturbance=Disturbance(airframe=load_airframe("crazyflie-2.1")))
    for flown, said in ((mission, False), (told, True)):
        assert ("Tracking is not proved for them." in controllers_said({"one": "px4"}, flown)) is said
    assert "not proved" not in controllers_said({"one": "mellinger"}, told)


def test_controllers_on_board_that_are_streamed_to_are_said_not_to_be_proved() -> None:
    mission = ltlplan.parse_mission(HOP)
    told = mission.changed(disturbance=Disturbance(airframe=load_airframe("crazyflie-2.1")))
    for flown, said in ((mission, False), (told, True)):
        sentence = controllers_said({"one": "mellinger"}, flown, streamed=True)
        assert ("Tracking is not proved for them, as their set-points are streamed from here." in sentence) is said


def test_a_link_says_whether_it_flies_the_set_points_that_tracking_is_proved_on() -> None:
    told = Disturbance(airframe=load_airframe("crazyflie-2.1"), setpoints=StreamedSetpoints(orders=2))
    mission = ltlplan.parse_mission(HOP)
    mission = mission.changed(disturbance=told, vehicle=mission.vehicle.changed(controller="geometric"))
    flown = flying_controllers("simulated", mission, conditions_of(mission))
    assert flown == {"one": "geometric on streamed set-points"}
    assert "not proved" not in controllers_said(flown, mission)
    assert "not proved" in controllers_said({"one": "geometric"}, mission)
