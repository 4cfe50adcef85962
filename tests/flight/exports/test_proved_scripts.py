"""Exported scripts begin a flight whose tracking is proved within what the proof assumes, by the same checks as live links."""

from __future__ import annotations

import json

import numpy as np
import pytest

from flight.exports.bundled_scripts import STREAM, SWARM, about
from flight.exports.scripts.flying.checks import Pose
from flight.exports.scripts.flying.watch import Refused, Team
from flight.exports.target import Request
from tests.helpers.motion.flights import legs, small_mission
from tests.helpers.vehicles.crazyswarm_flights import ACCEPTED, all_off, begun, on_the_ground
from verify.data.airframe import load_airframe
from verify.data.disturbance import Disturbance


def data_of(start: float | None, accuracy: float = 0.01):
    told = None if start is None else Disturbance(airframe=load_airframe("crazyflie-2.1"), start=start)
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
