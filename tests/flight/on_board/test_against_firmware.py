"""The shipped sequence of hoops, flown by what is on board: in the order of, and near, what the compiled firmware gave."""

from __future__ import annotations

import pytest

import flight
import ltlplan
from flight.control.lee import Lee
from flight.control.mellinger import Mellinger
from flight.control.on_board import autopilot_of
from flight.model.sensing import MotionCapture
from ltlplan.pipeline import certified_team

LATE = MotionCapture(noise=0.0, attitude_noise=0.0, rate_noise=0.0, dropout=0.0, delay=0.015)
UNSET = {"position_noise": 0.01, "attitude_noise": 0.0045}
FIRMWARE = [
    # controller, motion capture, the filter's noise where nobody set it; RMS and worst in mm
    (Mellinger(), None, {}, 12, 22),
    (Mellinger(), LATE, {}, 14, 24),
    (Lee(), None, {}, 15, 31),
    (Mellinger(mass=0.029), None, {}, 28, 40),
    (Mellinger(mass=0.029), LATE, UNSET, 39, 64),
    (Lee(mass=0.029), None, {}, 194, 202),
    ("pid", None, {}, 234, 491),
]


@pytest.mark.slow
def test_flights_are_near_those_of_the_compiled_firmware_and_in_their_order():
    done = certified_team(ltlplan.plan("hoops-sequence"))
    airframe = flight.airframe_of(done.plan.mission.vehicle)
    found = []
    for controller, noise, unset, rms, worst in FIRMWARE:
        autopilot = autopilot_of(airframe)
        vehicle = airframe.vehicle.changed(autopilot=autopilot.changed(ekf=autopilot.ekf.changed(**unset)))
        log = flight.fly(done.plan, done.team, controller=controller, noise=noise, airframe=airframe.changed(vehicle=vehicle))
        found.append((1000 * log.rms_error("quad0"), 1000 * log.worst_error()))
        assert found[-1] == pytest.approx((rms, worst), rel=0.4)
    assert [rms for rms, _ in found] == sorted(rms for rms, _ in found)
    assert [worst for _, worst in found] == sorted(worst for _, worst in found)
