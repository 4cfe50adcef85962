"""The hunt: winds from the loop's own response, worst for a linear loop, and worse than chance for the simulated one."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import flight
from flight.control.controller import CONTROLLERS
from flight.mixed_fleet import kinds_of
from flight.model.airframe import airframe_of, airframes_of
from flight.model.timing import CONTROL_STEP, STEP
from flight.onboard_simulation.commanded import CommandedLaws
from flight.onboard_simulation.fleet import Differences, Fleet, Sight
from flight.rehearsal.hunt import gain_of, hunt, input_towards, response
from tests.helpers.motion.flights import plan_of, small_mission
from tests.helpers.motion.stand_ins import hop, rest_to_rest, stand_in
from tests.helpers.vehicles.disturbed_flights import Disturbed
from verify import certify
from verify.data import BadInput, Trajectory, Visit, load_vehicle
from verify.data.airframe import load_airframe
from verify.data.autopilot import load_autopilot
from verify.data.disturbance import Disturbance, StreamedSetpoints


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


def hovering(seconds: float) -> Trajectory:
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, 2, 0] = 1.0
    return Trajectory([seconds], coefficients)


def test_what_a_controller_on_the_ground_is_given_is_late_and_off_as_elsewhere():
    """A fleet whose controllers are given late positions and velocities that are off flies as the flights do that the proof is held against."""
    airframe, ticks, late, rng = airframe_of(load_vehicle("crazyflie-2.1")), 60, 4, np.random.default_rng(3)
    place, speed, wind = (size * rng.normal(size=(ticks, 3, 1)) for size in (1e-3, 5e-3, 0.1))

    def at(values: np.ndarray):
        return lambda time: values[min(int(time / CONTROL_STEP + 1e-9), ticks - 1)]

    path = hovering(ticks * CONTROL_STEP)
    other = Disturbed(1, wind=at(wind), place=at(place), speed=at(speed), late=late).fly(airframe.vehicle, path, path.duration)
    start = path.evaluate(0.0)[:, None]
    fleet = Fleet(kinds_of((airframe,), 1), CONTROLLERS.find("geometric"), start, Differences(age=np.array([late * STEP])))
    flat, none, mine = np.zeros((5, 4, 1)), np.zeros((3, 1)), []
    flat[0] = start
    for tick in range(ticks):
        for half in range(2):
            fleet.look(Sight(place[tick], none, np.ones(1, dtype=np.bool_), none, speed[tick]))
            mine.append(fleet.fly(flat, half, wind[tick]) - start[:3])
    assert np.concatenate(mine) == pytest.approx(other, abs=1e-9)
    assert np.abs(other).max() > 1e-3


def test_a_vehicle_of_ones_own_is_hunted_and_flown_with_the_airframe_that_is_proved():
    stated = load_airframe("crazyflie-brushless").changed(drag_range=None)
    told = Disturbance(airframe=stated, wind=0.05)
    own = load_vehicle("crazyflie-brushless").changed(name="mine", controller="geometric", autopilot=None)
    mission = small_mission("F a", regions="a: {center: [0.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}", margin=0.05)
    mission = mission.changed(vehicle=own, disturbance=told)
    (flies,) = airframes_of(mission, mission.agents)
    assert {name: getattr(flies, name) for name in type(stated).model_fields} == dict(stated)
    assert airframes_of(mission.changed(disturbance=None), mission.agents) == (airframe_of(own),)
    plan, team = plan_of(mission, {"r0": [Visit(region="a")]}), {"r0": hovering(1.0)}
    certificate = certify(plan, team)
    found = hunt(mission, team, certificate, wind=told.wind)
    assert found.bound is not None
    assert 0.0 < found.worst < found.bound < 4.0 * found.worst
    log = flight.fly(plan, team, certificate, conditions=flight.conditions_of(mission))
    assert 0.0 < log.worst_error() < found.bound


def test_a_hunt_begins_as_far_off_as_is_stated():
    told = Disturbance(airframe=load_airframe("crazyflie-2.1"), wind=0.01, sag=0.0)
    mission = small_mission("F a", regions="a: {center: [0.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}", margin=0.05)
    mission = mission.changed(vehicle=load_vehicle("crazyflie-2.1").changed(controller="geometric"))
    still, off = (
        hunt(mission.changed(disturbance=told.changed(start=start)), {"r0": hovering(0.6)}, None, wind=told.wind).worst
        for start in (0.0, 0.004)
    )
    assert still < 0.001
    assert 0.0038 < off < 0.008


@pytest.mark.slow
def test_a_hunt_follows_set_points_that_are_as_old_as_is_stated():
    """Along a way, a set-point that is always 30 ms old leaves a robot behind by what it flies meanwhile."""
    plan, team = hop()
    start = team["quad0"].evaluate(0)[:3]
    team = {"quad0": rest_to_rest([start, (start[0] - 0.3, start[1], start[2])], [2.0])}
    told = Disturbance(airframe=load_airframe("crazyflie-2.1"), wind=0.01, sag=0.0)
    mission = plan.mission.changed(vehicle=load_vehicle("crazyflie-2.1").changed(controller="geometric"), disturbance=told)
    late = mission.changed(disturbance=told.changed(setpoints=StreamedSetpoints(age=(0.03, 0.03))))
    fastest = max(np.linalg.norm(team["quad0"].evaluate(t, 1)[:3]) for t in np.linspace(0.0, 2.0, 200))
    on_time, behind = (hunt(each, team, None, wind=told.wind).worst for each in (mission, late))
    assert 0.7 * 0.03 * fastest < behind - on_time < 1.3 * 0.03 * fastest


LAG = 0.1
"""s, of a lag between commands and rotors that no model here has."""


@pytest.mark.parametrize(("behind", "outside"), [(False, False), (True, True)])
def test_a_plant_with_one_more_lag_is_called_outside_the_model(behind, outside, monkeypatch):
    """Rotors whose commands come through one more lag than the proof's model has leave what is proved, and the hunt says so."""
    asked = CommandedLaws.thrusts
    share = -np.expm1(-STEP / LAG)

    def lagging(laws, now, memory):
        wanted, after = asked(laws, now, memory)
        before = getattr(laws, "reached", None)
        before = wanted if before is None or before.shape != wanted.shape else before
        laws.reached = before + share * (wanted - before)
        return laws.reached, after

    if behind:
        monkeypatch.setattr(CommandedLaws, "thrusts", lagging)
        monkeypatch.setattr(CommandedLaws, "traceable", False)
    told = Disturbance(airframe=load_airframe("crazyflie-2.1"), wind=0.1, sag=0.002)
    mission = small_mission("F a", regions="a: {center: [0.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}", margin=0.05)
    mission = mission.changed(vehicle=load_vehicle("crazyflie-2.1").changed(controller="geometric"), disturbance=told)
    plan, team = plan_of(mission, {"r0": [Visit(region="a")]}), {"r0": hovering(1.0)}
    found = hunt(mission, team, certify(plan, team), wind=told.wind)
    assert found.bound is not None
    assert (found.worst > found.bound) is outside
    assert ("That is outside the model: the proved bound is" in found.sentence) is outside


@pytest.mark.slow
@pytest.mark.parametrize(
    ("controller", "aimed"),
    [("geometric", {"position", "velocity", "gyroscope"}), ("mellinger", {"position", "attitude", "gyroscope"})],
)
def test_nothing_is_found_beyond_the_proved_bound_within_the_stated_disturbances(controller, aimed):
    stock = load_autopilot("crazyflie-2")
    quick = stock.changed(ekf=stock.ekf.changed(least_turn=0.0))
    told = Disturbance(
        airframe=load_airframe("crazyflie-2.1"), wind=0.01, position=0.0001, attitude=0.0001, latency=(0.0, 0.002), gyroscope=0.0005,
        mass=0.001, thrust=0.001, sag=0.0,
    )  # fmt: skip
    told = told if controller == "mellinger" else told.changed(wind=0.1, attitude=0.0, velocity=0.001)
    mission = small_mission("F a", regions="a: {center: [0.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}", margin=0.05)
    vehicle = load_vehicle("crazyflie-2.1").changed(controller=controller, autopilot=quick)
    plan = plan_of(mission.changed(vehicle=vehicle, disturbance=told), {"r0": [Visit(region="a")]})
    team = {"r0": hovering(3.0)}
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
