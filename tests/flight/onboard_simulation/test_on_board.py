"""What flies on board: alone as among many, in the plan's tube, and worse where it is told a wrong mass."""

from __future__ import annotations

import numpy as np
import pytest

import flight
import ltlplan
from flight.closed_loop import Setup, steps
from flight.control.controller import CONTROLLERS
from flight.control.lee import Lee
from flight.control.mellinger import Mellinger
from flight.control.onboard_controller import attitude_error, axes_towards, body_axes, setpoint_of
from flight.control.pid import Pid
from flight.model.attitude import from_euler, from_matrix
from flight.model.reference import sample_reference
from flight.model.sensing import MotionCapture
from flight.model.timing import CONTROL_STEP, FRAME_STEPS, STEP, SUBSTEPS
from flight.onboard_simulation.commanded import laws_of
from flight.onboard_simulation.rotor_plant import RotorPlant
from tests.helpers.few import few_of
from tests.helpers.motion.stand_ins import hop, mission, rest_to_rest
from verify.data import BadInput, load_vehicle, shipped_vehicles
from verify.data.airframe import load_airframe
from verify.data.autopilot import MellingerGains, load_autopilot, shipped_autopilots
from verify.data.disturbance import Disturbance

KINDS = ("mellinger", "lee", "pid", "geometric")


@pytest.fixture(scope="module")
def short():
    return hop()


@pytest.mark.parametrize(("controller", "worst"), [("mellinger", 0.02), ("lee", 0.03), ("pid", 0.4)])
def test_each_controller_follows_as_near_as_it_is_known_to(short, controller, worst):
    plan, team = short
    log = flight.fly(plan, team, controller=controller)
    assert 0.1 * worst < log.worst_error() < worst


@few_of(1, "controller", KINDS)
def test_a_run_among_many_is_bit_for_bit_the_run_alone(short, controller):
    _, team = short
    start = team["quad0"].evaluate(0)[:3]
    reference = sample_reference({"quad0": rest_to_rest([start, start + 0.05], [0.3])}, CONTROL_STEP, SUBSTEPS)
    conditions = flight.Conditions("0.3+0.2", MotionCapture(dropout=0.1, delay=0.013), controller=controller, estimator="ekf")
    setup = Setup((flight.airframe_of(load_vehicle("crazyflie-2.1")),), reference, conditions)
    alone, together = list(steps(setup, [7]))[-1], list(steps(setup, range(45)))[-1]
    assert np.array_equal(together.position[:, 7:8], alone.position)
    assert np.array_equal(together.attitude[:, 7:8], alone.attitude)
    assert np.array_equal(together.estimated[:, 7:8], alone.estimated)


def hovers(controller, vehicle: str, seconds: float, height: float = 1.0):
    """Return how far a vehicle that hovers in still air is from its place after each 10 ms, in m, knowing the truth. Batteries stay full."""
    airframe = flight.airframe_of(load_vehicle(vehicle))
    start = np.array([[0.3], [-0.2], [height], [0.4]])
    flat = np.zeros((5, 4, 1))
    flat[0] = start
    setpoint = setpoint_of(flat, 0.0)
    plant = RotorPlant(airframe, laws_of(controller, airframe), start, setpoint)
    away = np.empty((round(seconds / (FRAME_STEPS * STEP)), 3))
    for frame in range(len(away)):
        plant.aim(None if frame % 2 else flat, setpoint, plant.truth())
        away[frame] = plant.fly(setpoint, None, 0.0, 0.0, FRAME_STEPS)[-1, :3, 0] - start[:3, 0]
    return away


@few_of(1, "vehicle", [name for name in shipped_vehicles() if load_vehicle(name).autopilot])
@pytest.mark.parametrize("controller", KINDS)
def test_a_robot_that_hovers_goes_on_hovering(controller, vehicle):
    """A flight begins behind a hover: what sums of errors hold by then is not learnt anew in it."""
    assert np.linalg.norm(hovers(CONTROLLERS.find(controller), vehicle, 3.0), axis=1).max() < 0.0005


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", ["crazyflie-2.1", "crazyflie-brushless"])
@pytest.mark.parametrize(("law", "seconds"), [(Pid, 25.0), (Mellinger, 200.0)])
def test_sums_begin_where_a_long_hover_brings_them(law, seconds, vehicle):
    """The same law with all sums at zero errs for seconds or minutes, and is in the end where the settled one was all the time."""
    settled, from_zero = (hovers(law(settled=settled), vehicle, seconds) for settled in (True, False))
    assert np.linalg.norm(settled, axis=1).max() < 0.0005
    assert np.linalg.norm(from_zero[-1] - settled[-1]) < 0.0002
    if vehicle == "crazyflie-2.1":
        assert np.linalg.norm(from_zero, axis=1).max() > 0.008


@pytest.mark.parametrize("mass", [0.0, -0.03, float("nan")])
def test_a_mass_that_is_none_is_refused(mass):
    with pytest.raises(BadInput, match="mass is above 0 in kg"):
        Mellinger(mass=mass)


@pytest.mark.parametrize("law", [Mellinger, Lee])
def test_a_controller_that_is_told_too_little_mass_sinks(short, law):
    plan, team = short
    right, light = (flight.fly(plan, team, controller=law(mass=mass)) for mass in (0.033, 0.028))
    assert light.position[-1, 0, 2] < right.position[-1, 0, 2] - 0.01


def test_the_filter_sees_what_is_there_and_latency_costs_way(short):
    plan, team = short
    quiet = MotionCapture(noise=0.0, attitude_noise=0.0, rate_noise=0.0, dropout=0.0, delay=0.0)
    late = MotionCapture(noise=0.0, attitude_noise=0.0, rate_noise=0.0, dropout=0.0, delay=0.03)
    now, then = (flight.fly(plan, team, controller="mellinger", noise=sensor) for sensor in (quiet, late))
    assert now.estimate_rms < 0.001
    assert now.estimate_rms < 0.3 * then.estimate_rms


def test_set_points_are_the_plan_between_its_samples():
    plan_yaw = np.array([0.3, 0.2, 0.0, 0.0, 0.0])
    t = 0.01
    powers = np.array([[1.0, -0.4, 0.5, 2.0, 3.0], [0.5, 0.3, -0.6, 1.0, 0.0], [0.2, 0.1, 0.3, -2.0, 1.0], plan_yaw])
    found = setpoint_of(powers.T[:, :, None].copy(), t)[:, 0]
    series = np.array([1.0, t, t**2 / 2, t**3 / 6, t**4 / 24])
    assert found[0:3] == pytest.approx(powers[:3] @ series)
    assert found[3:6] == pytest.approx(powers[:3, 1:] @ series[:4])
    assert found[15:18] == pytest.approx([np.cos(0.302), np.sin(0.302), 0.302])


def test_body_rates_of_a_set_point_turn_its_attitude():
    rng = np.random.default_rng(1)
    flat = 0.5 * rng.standard_normal((5, 4, 20))
    flat[1:, 3] = 0.0
    h = 1e-5
    before, after = setpoint_of(flat, 0.0), setpoint_of(flat, h)

    def axes(setpoint):
        force = setpoint[6:9] + np.array([0.0, 0.0, 9.80665])[:, None]
        return axes_towards(force, setpoint[15], setpoint[16])[0]

    turned = axes(after)
    still = axes(before)
    assert np.einsum("in,in->n", turned[2] - still[2], still[1]) / h == pytest.approx(-before[12], abs=1e-3)
    assert np.einsum("in,in->n", turned[2] - still[2], still[0]) / h == pytest.approx(before[13], abs=1e-3)


def test_the_attitudes_error_is_twice_the_sine_of_the_angle_between():
    angles = np.array([[0.2], [0.0], [0.0]])
    wanted = body_axes(from_euler(np.zeros((3, 1))))
    actual = body_axes(from_euler(angles))
    assert attitude_error(wanted, actual)[:, 0] == pytest.approx([2 * np.sin(0.2), 0.0, 0.0])
    assert from_matrix(actual.transpose(1, 0, 2))[:, 0] == pytest.approx(from_euler(angles)[:, 0])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"controller": "mellinger", "model": "paper"}, "flies the airframe model `full` only"),
        ({"estimator": "ekf"}, "needs something to estimate from"),
        ({"estimator": "efk", "noise": 0.001}, "Did you mean 'ekf'"),
        ({"estimator": "kalman", "noise": 0.001, "controller": "lee"}, "'ekf', not 'kalman'"),
    ],
)
def test_conditions_that_cannot_be_flown_are_refused(given, said):
    with pytest.raises(BadInput, match=said):
        flight.Conditions(**given)


def test_autopilots_are_shipped_with_a_source_for_each_number():
    assert set(shipped_autopilots()) == {"crazyflie-2", "crazyflie-2-thrust-upgrade", "crazyflie-brushless", "px4-x500"}
    assert load_autopilot("crazyflie-2").gains(MellingerGains).mass == 0.029
    with pytest.raises(BadInput, match="Did you mean 'crazyflie-2'"):
        load_autopilot("crazyflie2")


def test_a_mission_is_flown_by_whom_its_vehicles_name():
    crazyflies = flight.conditions_of(mission())
    assert crazyflies.on_board
    assert crazyflies.estimator == "ekf"
    assert crazyflies.wind is not None
    own = mission().model_copy(update={"vehicle": mission().vehicle.changed(name="homemade", controller=None, autopilot=None)})
    assert not flight.conditions_of(own).on_board
    assert flight.conditions_of(own).estimator == "kalman"


def test_a_mission_that_states_disturbances_is_flown_within_them():
    told = Disturbance(
        airframe=load_airframe("crazyflie-2.1"), wind=0.05, position=0.0007, latency=(0.0, 0.01), gyroscope=0.004
    )
    on_board = flight.conditions_of(mission().changed(disturbance=told))
    assert on_board.wind is not None
    assert (on_board.wind.speed, on_board.wind.gust) == (0.05, 0.0)
    assert on_board.noise is not None
    assert on_board.noise.bound == pytest.approx(told.position)
    assert on_board.noise.delay == told.latency[1]
    ground = mission().vehicle.changed(controller="geometric")
    assert flight.conditions_of(mission().changed(disturbance=told, vehicle=ground)).noise is None


@pytest.mark.parametrize(
    ("controller", "said"),
    [
        ("melinger", "vehicle 'crazyflie-2.1': 'melinger' is not a controller. Did you mean 'mellinger'"),
        ("", "vehicle 'crazyflie-2.1': '' is not a controller"),
        ("profile", "its controller is 'profile', whom the vehicle's profile names. Name one: geometric, paper, mellinger"),
    ],
)
def test_a_profile_that_names_nobody_is_refused_before_anything_is_planned(controller, said):
    first, second = mission().agents
    wrong = mission().vehicle.changed(controller=controller)
    alone = mission().model_copy(update={"vehicle": wrong})
    agents = {first: mission().agents[first], second: mission().agents[second].model_copy(update={"vehicle": wrong})}
    one_of_two = mission().model_copy(update={"agents": agents})
    sentences = []
    for mistaken in (alone, one_of_two):
        with pytest.raises(BadInput, match=said):
            flight.conditions_of(mistaken)
        with pytest.raises(BadInput, match=said):
            ltlplan.run(mistaken, progress=lambda sentence, _: sentences.append(sentence))
    assert not sentences
    plan, team = hop()
    made = plan.model_copy(update={"mission": plan.mission.model_copy(update={"vehicle": wrong})})
    with pytest.raises(BadInput, match=said):
        flight.fly(made, team, controller="profile")


def test_the_profiles_controller_is_the_one_that_it_names(short):
    plan, team = short
    named, profile = (flight.fly(plan, team, controller=name, noise=0.001) for name in ("mellinger", "profile"))
    assert np.array_equal(named.position, profile.position)
    assert "flown by the controllers of the vehicles' profiles in still air, with motion capture" in profile.notes[0]


@pytest.mark.parametrize("name", shipped_vehicles())
def test_every_shipped_vehicle_names_a_controller_that_there_is(name):
    vehicle = load_vehicle(name)
    assert vehicle.controller is None or CONTROLLERS.knows(vehicle.controller)
    if vehicle.autopilot is not None and vehicle.autopilot.mellinger is not None and vehicle.autopilot.name != "crazyflie-2":
        full = vehicle.autopilot.mellinger.thrust_to_pwm * 4 * vehicle.rotor_thrust_max
        assert full == pytest.approx(65535, rel=1e-4)  # one newton asked for is one newton given


@few_of(1, "rate", [50, 250, 500])
def test_the_filter_on_board_takes_cameras_of_every_rate(short, rate):
    plan, team = short
    log = flight.fly(plan, team, controller="geometric", noise=MotionCapture(rate=rate), estimator="ekf")
    assert log.worst_error() < 0.02
    assert log.measured is not None
    assert np.isfinite(log.measured[-1]).all()
