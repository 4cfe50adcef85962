"""Exported scripts begin a flight whose tracking is proved within what the proof assumes, by the same checks as live links."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from flight.exports.bundled_scripts import STREAM, SWARM, about
from flight.exports.scripts.flying.checks import Pose
from flight.exports.scripts.flying.reports import Reports
from flight.exports.scripts.flying.watch import Refused, Team
from flight.exports.target import Request
from tests.helpers.motion.flights import legs, small_mission
from tests.helpers.vehicles.crazyswarm_flights import ACCEPTED, all_off, begun, on_the_ground
from verify.data.airframe import load_airframe
from verify.data.disturbance import Disturbance, Unrest


def data_of(start: float | None, accuracy: float = 0.01, **stated):
    told = None if start is None else Disturbance(airframe=load_airframe("crazyflie-2.1"), start=start, **stated)
    mission = small_mission("F G a", margin=0.05).changed(disturbance=told)
    return about(Request(mission, {"r0": legs([[0, 0, 1], [1, 0, 1]])}, 1, 0.05, "digest", {}), accuracy, {"r0": {}})


@pytest.mark.parametrize(
    ("start", "off", "begins"), [(None, 0.024, True), (0.018, 0.007, True), (0.018, 0.009, False), (0.2, 0.026, False)]
)
def test_a_start_is_held_to_the_proof_and_to_half_a_margin(start, off, begins) -> None:
    team = Team(data_of(start))
    faults = team.start_faults({"r0": Pose(0.0, (off, 0.0, 1.0), None)}, {"r0": (0.0, 0.0, 1.0, 0.0)}, "the start", 0.1)
    assert (faults == []) is begins
    assert begins or f"{min(start - 0.01, 0.025):.3f} m are allowed" in faults[0]


def test_starts_that_cannot_be_measured_are_refused() -> None:
    Team(data_of(0.011)).require_margin()
    with pytest.raises(
        Refused, match=r"robots begin 0\.01 m from where the flight begins, and a measurement may be off by 0\.01 m"
    ):
        Team(data_of(0.01)).require_margin()


RESTS = Unrest(speed=0.02, tilt=0.01, turn=0.05, heading=0.1)


@pytest.mark.parametrize(
    ("unrest", "said"),
    [
        ({}, ""),
        ({"speed": 0.014, "tilt": 0.0079, "turn": 0.039}, ""),
        (
            {"speed": 0.016},
            "r0's speed is 0.016 m/s, and may be 0.005 more; the proof of tracking lets it begin at 0.02: let it settle",
        ),
        ({"tilt": 0.009}, "r0's tilt is 0.009 rad"),
        ({"turn": 0.041}, "r0's turn is 0.041 rad/s"),
        ({"speed": math.nan}, "r0's speed is nan m/s"),
    ],
)
def test_a_robot_begins_as_near_to_rest_as_the_proof_assumes(unrest, said) -> None:
    data = json.loads(json.dumps(data_of(0.2, velocity=0.005, attitude=0.002, gyroscope=0.01, rest=RESTS)))
    pose = Pose(0.0, (0.0, 0.0, 1.0), 0.0, unrest)
    faults = Team(data).start_faults({"r0": pose}, {"r0": (0.0, 0.0, 1.0, 0.0)}, "the start", 0.1)
    assert len(faults) == bool(said)
    assert said in "".join(faults)


def test_a_place_that_is_off_by_less_than_a_millimetre_is_told_apart_from_what_is_allowed() -> None:
    team = Team({**data_of(0.0106), "accuracy": 0.01})
    (fault,) = team.start_faults({"r0": Pose(0.0, (0.0009, 0.0, 1.0), 0.0)}, {"r0": (0.0, 0.0, 1.0, 0.0)}, "the start", 0.1)
    assert "r0 is 0.0009 m from the start; 0.0006 m are allowed" in fault


@pytest.mark.parametrize(("off", "begins"), [(0.097, True), (0.099, False)])
def test_a_heading_is_held_to_what_the_proof_assumes(off, begins) -> None:
    team = Team(data_of(0.2, attitude=0.002, rest=RESTS))
    faults = team.start_faults({"r0": Pose(0.0, (0.0, 0.0, 1.0), off)}, {"r0": (0.0, 0.0, 1.0, 0.0)}, "the start", 0.1)
    assert (faults == []) is begins


def test_what_is_not_stated_of_rest_is_not_measured() -> None:
    pose = Pose(0.0, (0.0, 0.0, 1.0), 0.2, {"speed": 0.1, "tilt": 0.1})
    assert Team(data_of(0.2)).start_faults({"r0": pose}, {"r0": (0.0, 0.0, 1.0, 0.0)}, "the start", 0.1) == []


def test_a_px4_vehicle_reports_speed_tilt_and_rates() -> None:
    mavlink = pytest.importorskip("pymavlink.dialects.v20.common")
    reports = Reports()
    reports.take(mavlink.MAVLink_attitude_message(0, 0.03, -0.04, 0.5, 0.1, 0.2, -0.2), 0.0)
    reports.take(mavlink.MAVLink_local_position_ned_message(0, 1.0, 2.0, -1.0, 0.1, -0.2, 0.2), 0.0)
    assert reports.unrest == pytest.approx({"tilt": 0.05, "turn": 0.3, "speed": 0.3}, rel=1e-3)


def test_every_script_brings_the_checks_of_starts() -> None:
    assert "flying/starts.py" in SWARM
    assert "flying/starts.py" in STREAM


def proved(script, start: float) -> None:
    path = script.FOLDER / "flight.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "start": start}))


@pytest.mark.parametrize(("start", "flies"), [(0.03, True), (0.02, False)])
def test_a_script_flies_only_from_within_the_start_that_is_proved(world_and_script, start, flies, capsys) -> None:
    world, script = world_and_script
    proved(script, start)
    world.off = dict.fromkeys(world.robots, np.array([0.0, 0.015, 0.0]))
    assert script.main(ACCEPTED) == (0 if flies else 1)
    assert ("is 0.015 m from the start; 0.010 m are allowed" in capsys.readouterr().out) is not flies
    assert begun(world) is flies
    assert all_off(world)


def test_nothing_spins_where_the_start_that_is_proved_cannot_be_measured(world_and_script, capsys) -> None:
    world, script = world_and_script
    proved(script, 0.005)
    assert script.main(ACCEPTED) == 1
    assert "state a greater `disturbance.start`" in capsys.readouterr().out
    assert on_the_ground(world)
