"""The hunt: winds from the loop's own response, worst for a linear loop, and worse than chance for the simulated one."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import flight
from flight.model.airframe import airframe_of
from flight.model.timing import CONTROL_STEP
from flight.rehearsal.hunt import gain_of, hunt, input_towards, response
from tests.helpers.motion.flights import plan_of, small_mission
from tests.helpers.motion.stand_ins import hop, rest_to_rest, stand_in
from verify import certify
from verify.data import BadInput, Trajectory, Visit, load_vehicle
from verify.data.airframe import load_airframe
from verify.data.autopilot import load_autopilot
from verify.data.disturbance import Disturbance


@functools.cache
def kernel() -> np.ndarray:
    return response(airframe_of(load_vehicle("crazyflie-2.1")))


def answered(winds: np.ndarray, ticks: int) -> np.ndarray:
    """Return where a linear loop is after so many control steps of wind. Shape (3,)."""
    own = kernel()
    return sum((winds[ticks - 1 - k] @ own[k] for k in range(min(ticks, len(own)))), np.zeros(3))


def test_a_response_is_that_of_a_loop_that_comes_back():
    own = kernel()
    length = np.linalg.norm(own.reshape(len(own), -1), axis=1)
    assert length.max() > 10 * length[-1]
    assert abs(own[:, 0, 0]).max() > 20 * abs(own[:, 0, 1]).max()  # along the wind
    assert own[20, 0, 0] > 0.0


@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.6, 0.8, 0.0)])
def test_the_aimed_wind_reaches_the_gain_and_no_other_goes_farther(direction):
    """Of a linear loop the l1 gain is reached by the signs of the response read backwards, and bounds every other wind."""
    ticks, towards = len(kernel()), np.array(direction)
    aimed = input_towards(kernel(), towards, ticks, ticks * CONTROL_STEP)
    assert np.linalg.norm(aimed, axis=1) == pytest.approx(1.0)
    far = float(answered(aimed, ticks) @ towards)
    assert far == pytest.approx(float(np.sum(np.linalg.norm(kernel() @ towards, axis=1))))
    if max(abs(towards)) == 1.0:
        assert far <= gain_of(kernel()) + 1e-12
    rng = np.random.default_rng(0)
    for _ in range(50):
        winds = rng.standard_normal((ticks, 3))
        winds = np.cumsum(winds, axis=0) if rng.random() < 0.5 else winds
        winds /= np.linalg.norm(winds, axis=1, keepdims=True)
        assert float(answered(winds, ticks) @ towards) <= far


def test_a_hunt_finds_more_than_chance_does():
    plan, team = hop()
    start = team["quad0"].evaluate(0)[:3]
    team = {"quad0": rest_to_rest([start, (start[0] - 0.15, start[1], start[2])], [2.0])}
    few = flight.Combinations(("mellinger",), (1.0,), (0.015,), ("0.35+0.05",), hunt=0.4)
    found = flight.rehearse(plan, team, stand_in(plan, team), combinations=few, runs=4)
    assert found.hunt is not None
    assert found.hunt.worst > max(cell.worst for cell in found.cells)
    assert found.hunt.worst < found.hunt.linear["quad0"] + 0.02
    assert found.to_dict()["hunt"]["flights"] == found.hunt.flights
    assert any("A hunt proves nothing" in sentence for sentence in found.sentences)


def test_errors_of_cameras_are_aimed_as_winds_are():
    """A slow error that turns against the loop moves a hovering vehicle farther than the same error along one way."""
    airframe = airframe_of(load_vehicle("crazyflie-2.1"))
    seen = response(airframe, "position")
    assert abs(seen[:, 0, 0]).max() > 20 * abs(seen[:, 0, 1]).max()
    assert seen[5:60, 0, 0].sum() < 0.0, "who is seen ahead of its place flies back"
    assert gain_of(seen) > abs(seen.sum(axis=0)).max() > 0.9, "an error that stays is followed"


@pytest.mark.slow
@pytest.mark.parametrize(("controller", "aimed"), [("geometric", set()), ("mellinger", {"position", "attitude", "gyroscope"})])
def test_nothing_is_found_beyond_the_proved_bound_within_the_stated_disturbances(controller, aimed):
    stock = load_autopilot("crazyflie-2")
    quick = stock.changed(ekf=stock.ekf.changed(least_turn=0.0))
    told = Disturbance(
        airframe=load_airframe("crazyflie-2.1"), wind=0.01, position=0.0001, attitude=0.0001, latency=(0.0, 0.002), gyroscope=0.0005,
        mass=0.001, thrust=0.001, sag=0.0,
    )  # fmt: skip
    told = told if controller == "mellinger" else told.changed(wind=0.1, attitude=0.0)
    mission = small_mission("F a", regions="a: {center: [0.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}", margin=0.05)
    vehicle = load_vehicle("crazyflie-2.1").changed(controller=controller, autopilot=quick)
    plan = plan_of(mission.changed(vehicle=vehicle, disturbance=told), {"r0": [Visit(region="a")]})
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, 2, 0] = 1.0
    team = {"r0": Trajectory([3.0], coefficients)}
    certificate = certify(plan, team)
    claim = next(claim for claim in certificate.claims if claim.name == "tracking")
    assert claim.outcome == "holds"
    found = hunt(plan.mission, team, certificate, wind=told.wind)
    assert set(found.errors) == aimed
    assert found.worst < claim.bound == found.bound
    assert claim.bound < 4.0 * found.worst
    assert f"The proved bound is {claim.bound / found.worst:.1f} times that." in found.sentence
    assert hunt(plan.mission, team, certificate, wind=2.0 * told.wind).bound is None


@pytest.mark.parametrize("wind", [0.0, -1.0, float("nan"), 21.0])
def test_a_wind_that_is_none_is_refused(wind):
    plan, team = hop()
    with pytest.raises(BadInput, match="above 0 m/s and at most 20"):
        hunt(plan.mission, team, None, wind=wind)
    with pytest.raises(BadInput, match="above 0 m/s and at most 20"):
        flight.Combinations(hunt=wind)
