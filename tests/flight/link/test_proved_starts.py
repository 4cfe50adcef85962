"""Starts of flights whose tracking is proved: live links begin within what the proof assumes, and refuse what cannot be measured so well."""

from __future__ import annotations

import numpy as np
import pytest

import flight
from flight.link.live_executive import fly_live
from flight.link.phases import Stage
from flight.link.preflight_checks import at_start, proved_starts
from flight.link.simulated import SimulatedLink
from tests.helpers.motion.flights import legs, plan_of, small_mission
from verify import certify
from verify.data import Trajectory
from verify.data.airframe import load_airframe
from verify.data.disturbance import Disturbance, Unrest
from verify.data.plan import Visit
from verify.data.vehicle import load_vehicle

START = 0.004
"""m from the start at which the proof lets the robot begin."""


def stage_of(start: float | None, rest: Unrest | None = None) -> Stage:
    """Return a proved flight that may begin so far off, or one of which nothing is proved."""
    mission = small_mission("F a", regions="a: {center: [0.5, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}", margin=0.05)
    told = None if start is None else Disturbance(airframe=load_airframe("crazyflie-2.1"), start=start, sag=0.0, rest=rest)
    mission = mission.changed(vehicle=load_vehicle("crazyflie-2.1").changed(controller="geometric"), disturbance=told)
    plan, team = plan_of(mission, {"r0": [Visit(region="a")]}), {"r0": legs([[0, 0, 1], [0.5, 0, 1]], speed=0.15)}
    return Stage("flight", plan, team, certify(plan, team))


@pytest.fixture(scope="module")
def proved() -> Stage:
    return stage_of(START)


def hovering(stage: Stage, off: float, noise: float | None = None) -> SimulatedLink:
    """Return a link to a robot that is so many m off where the stage begins."""
    return SimulatedLink(stage.plan.mission, {"r0": (off, 0.0, 1.0)}, conditions=flight.Conditions(noise=noise))


@pytest.mark.parametrize(("off", "begins"), [(0.0, True), (0.003, True), (0.005, False), (0.02, False)])
def test_robots_begin_within_what_the_proof_assumes(proved, off, begins) -> None:
    (part,) = proved.parts
    found = [check for check in at_start(hovering(proved, off), part) if check.name == "place"]
    assert [check.passed for check in found] == [begins]
    assert begins or "0.004 m are allowed" in found[0].sentence


def test_without_a_proof_half_a_margin_is_allowed() -> None:
    (part,) = stage_of(None).parts
    assert part.start is None
    assert all(check.passed for check in at_start(hovering(stage_of(None), 0.02), part))


def test_what_a_measurement_may_be_off_is_taken_off_the_start(proved) -> None:
    link, (part,) = hovering(proved, 0.003, noise=0.0003), proved.parts
    assert 0.001 < link.accuracy < START
    assert not all(check.passed for check in at_start(link, part))


def test_starts_that_cannot_be_measured_are_refused_before_anything_spins(proved) -> None:
    link = hovering(proved, 0.0, noise=0.001)
    assert link.accuracy > START
    done = fly_live(link, [proved], grounds={"r0": 1.0})
    assert not done.flown
    assert "the proof of tracking lets robots begin 0.004 m from where the flight begins" in done.reason
    assert "state a greater `disturbance.start`" in done.reason
    assert link.spinning == ()
    assert proved_starts(hovering(proved, 0.0), [proved]) == []


@pytest.mark.parametrize(("rest", "begins"), [(Unrest(speed=0.03, tilt=0.01, turn=0.05), True), (Unrest(speed=1e-4), False)])
def test_simulated_robots_begin_as_near_to_rest_as_the_proof_assumes(rest, begins) -> None:
    """In wind the robot sways at some millimetres a second."""
    stage = stage_of(START, rest)
    link = SimulatedLink(stage.plan.mission, {"r0": (0.0, 0.0, 1.0)}, conditions=flight.Conditions("0.1+0.1"), seed=1)
    link.upload("r0", 0, Trajectory([9.0], np.eye(1, 32, 16).reshape(1, 4, 8)))
    link.start(link.ready("r0", 0) and 0)
    link.sleep(0.5)
    (part,) = stage.parts
    pose = link.pose("r0")
    assert set(pose.unrest) == {"speed", "tilt", "turn"}
    assert 1e-4 < pose.unrest["speed"] < 0.05
    assert [check.passed for check in at_start(link, part) if check.name == "rest"] == [begins] * len(stage.rest)
