"""Gains of a profile's own: set on board where firmware has a parameter for them, refused where it has none."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from flight.exports.crazyflies.crazyswarm import CRAZYSWARM2, crazyswarm2_robots, left_out
from flight.exports.crazyflies.parameters import cannot_fly, firmware_parameters, own_gains, parameters_read
from flight.exports.flown import require_controllers
from flight.exports.notes import readme
from flight.exports.target import EXPORT_TARGETS, Request
from flight.link.crazyflie.setting import wanted
from tests.helpers.motion.flights import legs, small_mission
from verify.data import DoesNotFit, NotCertified, Vehicle, load_vehicle
from verify.data.airframe import load_airframe
from verify.data.autopilot import load_autopilot
from verify.data.disturbance import Disturbance
from verify.data.vehicle import shipped_vehicles

TOLD, TEAM = Disturbance(airframe=load_airframe("crazyflie-2.1")), {"r0": legs([[0, 0, 1], [1, 0, 1]])}
STOCK, TABLE = load_vehicle("crazyflie-2.1"), load_autopilot("crazyflie-2")
STIFFER = TABLE.mellinger.changed(position=(0.8, 0.8, 1.5), velocity=(0.3, 0.3, 0.5))


def tuned(**changes: object) -> Vehicle:
    return STOCK.changed(autopilot=TABLE.changed(**changes))


def test_gains_of_the_firmware_are_left_alone():
    crazyflies = [load_vehicle(name) for name in shipped_vehicles() if name.startswith("crazyflie")]
    assert len(crazyflies) > 1
    assert [own_gains(vehicle) for vehicle in crazyflies] == [{}] * len(crazyflies)
    assert [cannot_fly(vehicle) for vehicle in crazyflies] == [""] * len(crazyflies)


def test_own_gains_are_set_under_the_names_of_the_shipped_table():
    """The table says beside each gain which parameters it is; all of them are set."""
    text = (Path(__file__).parents[3] / "verify" / "data" / "autopilots" / "crazyflie-2.yaml").read_text(encoding="utf-8")
    named = set(re.findall(r"\b(?:k\w+|i_range\w*)_(?:xy|z|rp)\b", text[: text.index("\nlee:")]))
    vehicle = tuned(mellinger=STIFFER)
    found = own_gains(vehicle)
    assert found.keys() == named
    assert (found["kp_xy"], found["kp_z"], found["kd_xy"], found["kd_z"]) == (0.8, 1.5, 0.3, 0.5)
    assert (found["kR_xy"], found["kw_z"], found["kd_omega_rp"], found["i_range_m_z"]) == (70000.0, 12000.0, 200.0, 1500.0)
    assert firmware_parameters(vehicle)["ctrlMel"].items() >= found.items()
    assert parameters_read(vehicle)["ctrlMel.kp_xy"] == 0.8
    assert cannot_fly(vehicle) == ""
    other = STOCK.changed(autopilot=load_autopilot("crazyflie-brushless"))
    assert own_gains(other)["kp_xy"] == other.autopilot.mellinger.position[0], "another platform's are not its firmware's"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"mellinger": STIFFER.changed(moment_limit=40000.0)}, "`moment_limit`"),
        ({"mellinger": STIFFER.changed(rate=(20000.0, 21000.0, 12000.0))}, "`rate` along x and y"),
        ({"mellinger": STIFFER.changed(rate_change=(200.0, 200.0, 50.0))}, "`rate_change` about z"),
        ({"ekf": TABLE.ekf.changed(least_turn=0.0)}, "numbers of `ekf` other than `position_noise` and `attitude_noise`"),
    ],
)
def test_what_no_parameter_sets_is_refused_everywhere(changes, said):
    mission = small_mission("F a", margin=0.05).changed(vehicle=tuned(**changes))
    for name in ("crazyswarm2", "crazyflie", "crazyflie-compressed"):
        with pytest.raises(
            NotCertified, match=f"{name}: no vehicle flies as r0 was simulated: its autopilot has {said} that no parameter sets"
        ):
            require_controllers(EXPORT_TARGETS.find(name), mission, mission.agents, {})
        note = readme(
            Request(mission.changed(disturbance=TOLD), TEAM, 1, 0.05, "digest", {}), EXPORT_TARGETS.find(name), (), ()
        )
        assert f"controller mellinger, which flies otherwise: its autopilot has {said}" in note
        assert "tracking not proved for this target" in note
    with pytest.raises(DoesNotFit, match=said):
        wanted(mission, {})
    assert crazyswarm2_robots(mission) == ()
    assert (
        left_out(mission)
        == f"crazyswarm2 leaves out r0: of 'crazyflie-2.1' its autopilot has {said} that no parameter sets on board."
    )


def test_noise_of_cameras_is_set_and_gains_of_other_controllers_do_not_matter():
    vehicle = tuned(ekf=TABLE.ekf.changed(attitude_noise=0.0045), lee=TABLE.lee.changed(position=(9.0, 9.0, 9.0)))
    assert cannot_fly(vehicle) == ""
    assert firmware_parameters(vehicle)["locSrv"]["extQuatStdDev"] == 0.0045
    assert "gains of `lee`" in cannot_fly(vehicle.changed(controller="lee"))
    mission = small_mission("F a", margin=0.05).changed(vehicle=vehicle)
    require_controllers(CRAZYSWARM2, mission, mission.agents, {})
    assert crazyswarm2_robots(mission) == ("r0",)
