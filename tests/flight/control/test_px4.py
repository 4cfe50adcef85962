"""PX4's cascade: the figures that its own unit tests publish, step and sine responses against closed forms, and whom it refuses to fly."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import flight
from flight.control.controller import CONTROLLERS
from flight.control.onboard_controller import setpoint_of
from flight.control.px4 import _AccelerationLoop, _AttitudeLoop, _VelocityLoop
from flight.exports.px4_parameters import TAKEN_FOR_GRANTED, px4_parameters
from flight.link.link import LinkLost
from flight.model.airframe import airframe_of
from flight.model.attitude import from_euler
from flight.model.timing import CONTROL_STEP, FRAME_STEPS, STEP, SUBSTEPS
from flight.onboard_simulation.commanded import laws_of
from flight.onboard_simulation.rotor_plant import RotorPlant
from tests.helpers.motion.flights import legs, plan_of, small_mission
from verify import certify
from verify.data import GRAVITY, BadInput, NotCertified, load_vehicle
from verify.data.autopilot import Px4Gains, load_autopilot
from verify.data.plan import Visit

X500 = load_vehicle("px4-x500")
GAINS = load_autopilot("px4-x500").gains(Px4Gains)
THEIRS = GAINS.changed(
    position=(1.0, 1.0, 1.0), velocity=(20.0, 20.0, 20.0), velocity_integral=(20.0, 20.0, 20.0), velocity_change=(20.0, 20.0, 20.0),
    speed_limit=1.0, climb_limit=1.0, descent_limit=1.0, thrust_least=0.1, thrust_most=0.9, thrust_sideways=0.3,
    tilt_limit=math.degrees(1.0),
)  # fmt: skip
"""Gains and limits of PX4's PositionControlTest.cpp."""


def thrust_towards(off: tuple[float, float, float]) -> np.ndarray:
    """Return the thrust vector of a vehicle at rest that is asked to be elsewhere, with the settings of PX4's test, whose hover thrust is 0.5."""
    away, zero = np.array(off)[:, None], np.zeros((3, 1))
    wanted = _VelocityLoop(THEIRS).asked(away, zero)
    assert np.hypot(*wanted[:2, 0]) <= 1.0 + 1e-12
    assert abs(wanted[2, 0]) <= 1.0
    return _AccelerationLoop(THEIRS, 0.5).asked(wanted, zero, zero, zero)[0][:, 0]


def test_thrust_ends_where_the_autopilots_own_tests_say():
    """PositionControlMaxThrustLimit, PositionControlMinThrustLimit and TiltLimit; z is up here."""
    high = thrust_towards((10.0, 10.0, 10.0))
    assert np.linalg.norm(high) == pytest.approx(0.9)
    assert high == pytest.approx([0.3 / math.sqrt(2.0), 0.3 / math.sqrt(2.0), math.sqrt(0.81 - 0.09)])
    low = thrust_towards((10.0, 0.0, -10.0))
    assert np.linalg.norm(low) == pytest.approx(0.1)
    assert math.atan2(low[0], low[2]) == pytest.approx(1.0)
    level = thrust_towards((10.0, 10.0, 0.0))
    assert 0.0 < math.acos(level[2] / np.linalg.norm(level)) <= 1.0 + 1e-9


def test_at_rest_the_thrust_is_that_of_hover_and_a_sink_rate_lowers_it():
    """UpdateHoverThrust and FailsafeInput."""
    zero = np.zeros((3, 1))
    assert _AccelerationLoop(THEIRS, 0.6).asked(zero, zero, zero, zero)[0][:, 0] == pytest.approx([0.0, 0.0, 0.6])
    down = np.array([[0.0], [0.0], [-0.1]])
    assert 0.1 < _AccelerationLoop(THEIRS, 0.5).asked(down, zero, zero, zero)[0][2, 0] < 0.5


def test_the_plans_velocity_gives_way_to_the_way_back():
    loop = _VelocityLoop(THEIRS)
    off, planned = np.array([[0.6], [0.0], [0.0]]), np.array([[0.0], [2.0], [0.0]])
    assert loop.asked(off, planned)[:, 0] == pytest.approx([0.6, 0.8, 0.0])
    assert loop.asked(5.0 * off, planned)[:, 0] == pytest.approx([1.0, 0.0, 0.0])


@pytest.mark.parametrize("angles", [(0.2, 0.0, 0.0), (0.0, -0.3, 0.0), (0.0, 0.0, 0.5), (0.1, 0.2, -0.3)])
def test_body_rates_are_gains_times_the_error_of_the_attitude(angles):
    """AttitudeControlTest: roll and pitch by their gains, the heading by its own, whatever its weight."""
    level = from_euler(np.zeros((3, 1)))
    rates = _AttitudeLoop(GAINS).asked(from_euler(np.array(angles)[:, None]), level, np.zeros(1))[:, 0]
    if sum(angle != 0.0 for angle in angles) == 1:
        expected = [2.0 * gain * math.sin(0.5 * angle) for gain, angle in zip(GAINS.angle, angles, strict=True)]
        expected[2] = 2.0 * GAINS.angle[2] / GAINS.yaw_weight * math.sin(0.5 * GAINS.yaw_weight * angles[2])
        assert rates == pytest.approx(expected, abs=1e-6)
    assert np.sign(rates) == pytest.approx(np.sign(angles))


def test_a_tilt_settles_as_a_first_order_loop_of_its_gain():
    """Asked to be 1 m aside, the vehicle turns to its tilt within the rise time of 1 / MC_ROLL_P behind that of its rates."""
    airframe = airframe_of(X500)
    flat = np.zeros((5, 4, 1))
    start = flat[0].copy()
    there = setpoint_of(flat, 0.0)
    plant = RotorPlant(airframe, laws_of(CONTROLLERS.find("px4"), airframe), start, there)
    flat[2, 0] = 0.5  # m/s^2: a step of the planned acceleration
    there = setpoint_of(flat, 0.0)
    tilts = []
    for frame in range(60):
        plant.aim(None if frame % 2 else flat, there, plant.truth())
        plant.fly(there, None, 0.0, 0.0, FRAME_STEPS)
        q = plant.state[6:10, 0]
        tilts.append(2.0 * (q[0] * q[2] + q[1] * q[3]))
    aim = 0.5 / GRAVITY
    reached = 0.01 * next(k for k, tilt in enumerate(tilts) if tilt > 0.632 * aim)
    assert reached == pytest.approx(1.0 / GAINS.angle[0] + 1.0 / 35.0 + 0.02, rel=0.25)  # angle, rate, motors
    assert max(tilts) < 1.15 * aim


def followed(path: Callable[[float, int], tuple[float, float, float]], seconds: float, orders: int = 5) -> np.ndarray:
    """Fly a path from its middle, and return the distance from it at the end of each 20 ms.

    Args:
        path: Place or a derivative of it, by time and order.
        seconds: How long.
        orders: Of them so many are sent, from the place on.
    """
    airframe = airframe_of(X500)
    times = CONTROL_STEP * np.arange(round(seconds / CONTROL_STEP))

    def flat(time: float) -> np.ndarray:
        rows = np.zeros((5, 4, 1))
        for order in range(orders):
            rows[order, :3, 0] = path(time, order)
        return rows

    first = flat(0.0)
    plant = RotorPlant(airframe, laws_of(CONTROLLERS.find("px4"), airframe), first[0], setpoint_of(first, 0.0))
    off = []
    for time in times.tolist():
        rows = flat(time)
        for half in range(SUBSTEPS // FRAME_STEPS):
            held = setpoint_of(rows, half * FRAME_STEPS * STEP)
            plant.aim(None if half else rows, held, plant.truth())
            plant.fly(held, None, 0.0, 0.0, FRAME_STEPS)
        off.append(plant.state[:3, 0] - path(time + CONTROL_STEP, 0))
    return np.linalg.norm(np.array(off), axis=1)


def turning(rate: float, time: float, order: int, phase: float = 0.0) -> float:
    """Return a derivative of the sine of a rate, rad/s, at a time, s."""
    return rate**order * math.sin(rate * time + phase + order * math.pi / 2)


def circle(radius: float, rate: float, seconds: float) -> np.ndarray:
    """Fly a level circle from the middle of its motion, and return the distance from it at the end of each 20 ms."""
    return followed(
        lambda time, order: (radius * turning(rate, time, order, math.pi / 2), radius * turning(rate, time, order), 0.0),
        seconds,
    )


def closed_form(radius: float, rate: float) -> float:
    """Return the steady error on a circle: the loop linear, its inner part a lag of the attitude loop, the hold and the frame."""
    airframe = airframe_of(X500)
    s = 1j * rate
    inner = np.exp(-0.005 * s) / (1.0 + s / GAINS.angle[0] + s * s / (GAINS.angle[0] * 30.0))  # frame; angle over rate
    place, speed, summed, damp = GAINS.position[0], GAINS.velocity[0], GAINS.velocity_integral[0], GAINS.velocity_change[0]
    back = speed * (place + s) + summed * (place + s) / s
    change = damp * s * s / (1.0 + s / (2.0 * math.pi * GAINS.velocity_change_cutoff))
    drag = 4.0 * airframe.hover_speed * airframe.rotor_drag / X500.mass
    flown = inner * np.exp(-0.01 * s) * (s * s + back) / (s * s + drag * s + inner * (back + change))
    return radius * abs(1.0 - flown)


@pytest.mark.parametrize(("radius", "rate", "seconds"), [(1.0, 1.0, 9.0), pytest.param(0.5, 1.5, 20.0, marks=pytest.mark.slow)])
def test_the_steady_error_on_a_circle_is_that_of_the_linear_loop(radius, rate, seconds):
    away = circle(radius, rate, seconds)
    assert np.mean(away[-300:]) == pytest.approx(closed_form(radius, rate), rel=0.1)


LOGGED = {
    "level circle": (lambda t, k: (turning(1.0, t, k, math.pi / 2), turning(1.0, t, k), 0.0), 1.316),
    "level eight": (lambda t, k: (turning(0.5, t, k), turning(1.0, t, k), 0.0), 1.575),
    "upright circle": (lambda t, k: (turning(1.0, t, k, math.pi / 2), 0.0, turning(1.0, t, k)), 1.352),
    "short eight": (lambda t, k: (turning(0.5, t, k), 0.0, turning(1.0, t, k)), 1.035),
    "tall eight": (lambda t, k: (turning(1.0, t, k), 0.0, turning(0.5, t, k)), 1.464),
}  # fmt: skip
"""Paths and worst errors, m, behind the first quarter of PX4's flights in Gazebo: evannsm/px4_data_analysis on GitHub, vanilla_logs (July 2023)."""


@pytest.mark.parametrize(
    "name", [name if name == "level circle" else pytest.param(name, marks=pytest.mark.slow) for name in LOGGED]
)
def test_logged_errors_behind_positions_alone_are_met(name):
    path, logged = LOGGED[name]
    worst = followed(path, 13.0 if name == "level circle" else 40.0, orders=1)[400:].max()
    assert worst == pytest.approx(logged, rel=0.2)


@pytest.mark.parametrize(("vehicle", "controller", "said"), [
    ("crazyflie-2.1", "px4", "'crazyflie-2' does not run 'px4'. Controllers that it runs: mellinger, lee, pid"),
    ("px4-x500", "mellinger", "'px4-x500' does not run 'mellinger'. Controllers that it runs: px4"),
])  # fmt: skip
def test_a_controller_that_the_autopilot_does_not_run_is_refused(vehicle, controller, said):
    airframe = airframe_of(load_vehicle(vehicle))
    with pytest.raises(BadInput, match=said):
        laws_of(CONTROLLERS.find(controller), airframe)


def test_the_mix_is_the_normalised_pseudo_inverse_of_the_rotors_places():
    """Rotors as the airframe's file has them; about x and y both rows are scaled by the larger one's length, about z the mean stands."""
    rotors = ((0.13, 0.22, 0.05), (-0.13, -0.20, 0.05), (0.13, -0.22, -0.05), (-0.13, 0.20, -0.05))
    effect = np.array([[-y, x, turns, 1.0] for x, y, turns in rotors]).T  # of a unit of thrust: three moments and the lift
    inverse = np.linalg.pinv(effect)
    roll, pitch = (math.sqrt((inverse[:, k] ** 2).sum() / 2.0) for k in (0, 1))
    mix = np.abs(inverse[:, :3] / [max(roll, pitch), max(roll, pitch), np.abs(inverse[:, 2]).max()])
    assert np.ptp(mix[:, :2], axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert pytest.approx(mix.mean(axis=0), abs=1e-4) == GAINS.mix


def test_rotors_that_lift_too_much_without_a_signal_are_refused():
    autopilot = load_autopilot("px4-x500").changed(px4=GAINS.changed(idle=0.9))
    with pytest.raises(BadInput, match="lift more than its weight at no signal"):
        laws_of(CONTROLLERS.find("px4"), airframe_of(X500.changed(autopilot=autopilot)))


def test_a_thrust_curve_on_board_takes_the_vertical_loop_to_its_gain():
    """With THR_MDL_FAC the signal is bent the other way, so that thrust is what is asked for; hover stays hover."""
    curved = X500.changed(autopilot=load_autopilot("px4-x500").changed(px4=GAINS.changed(idle=0.0, thrust_curve=1.0)))
    airframe = airframe_of(curved)
    flat = np.zeros((5, 4, 1))
    there = setpoint_of(flat, 0.0)
    plant = RotorPlant(airframe, laws_of(CONTROLLERS.find("px4"), airframe), flat[0], there)
    for frame in range(100):
        plant.aim(None if frame % 2 else flat, there, plant.truth())
        plant.fly(there, None, 0.0, 0.0, FRAME_STEPS)
    assert np.abs(plant.state[:3]).max() < 1e-6


@pytest.fixture(scope="module")
def hall():
    mission = small_mission("F G a", margin=0.1).changed(vehicle=X500)
    plan, team = plan_of(mission, {"r0": [Visit(region="a")]}), {"r0": legs([[0, 0, 1], [1, 0, 1]])}
    cert = certify(plan, team)
    return plan, team, cert, flight.fly(plan, team, cert, conditions=flight.conditions_of(mission))


def test_many_are_flown_to_the_last_bit_as_one_is():
    """One vehicle is stepped by compiled arithmetic, fifty as arrays."""
    flown = []
    for vehicles in (1, 50):
        airframe = airframe_of(X500)
        flat = np.zeros((5, 4, vehicles))
        start = flat[0].copy()
        flat[0, :2], flat[0, 3], flat[1, 3], flat[2, 0] = 0.3, 0.2, 0.1, -0.4
        there = setpoint_of(flat, 0.0)
        plant = RotorPlant(airframe, laws_of(CONTROLLERS.find("px4"), airframe), start, setpoint_of(np.zeros_like(flat), 0.0))
        for frame in range(40):
            plant.aim(None if frame % 2 else flat, there, plant.truth())
            plant.fly(there, None, 0.01, 0.3, FRAME_STEPS)
        flown.append(plant.state[:, -1])
    assert np.array_equal(*flown)


def test_its_own_flight_opens_the_export_at_the_rate_that_was_flown(hall, tmp_path):
    pytest.importorskip("pymavlink", reason="pymavlink is not installed")
    plan, team, cert, log = hall
    assert log.controllers == ("px4",)
    written = flight.export(team, cert, tmp_path / "px4", format="px4", flight=log)
    note = (tmp_path / "px4" / "README.txt").read_text()
    assert "controller px4" in note
    assert "parameters that were simulated" in note
    assert "not rehearsed" not in note
    assert written.digest == cert.digest()
    with pytest.raises(NotCertified, match=r"on 50 set-points a second, and the export has 25.*--rate 50"):
        flight.export(team, cert, tmp_path / "slow", format="px4", flight=log, rate=25.0)
    with pytest.raises(NotCertified, match="strayed"):
        flight.export(team, cert, tmp_path / "far", format="px4", flight=replace(log, peak=[0.11]))
    assert plan.mission.vehicle.controller == "px4"


def test_the_parameters_are_those_of_the_table_under_their_names():
    wanted = px4_parameters(X500)
    assert len(wanted) == 50
    assert all(len(name) <= 16 for name in wanted)
    text = (Path(__file__).parents[3] / "verify" / "data" / "autopilots" / "px4-x500.yaml").read_text(encoding="utf-8")
    assert [
        name
        for name in wanted
        if name.count("_") < 3 and name.startswith("MPC_") and name not in {*TAKEN_FOR_GRANTED} and name not in text
    ] == []
    assert {name: wanted[name] for name in TAKEN_FOR_GRANTED} == TAKEN_FOR_GRANTED
    assert (wanted["MPC_XY_P"], wanted["MPC_Z_VEL_P_ACC"], wanted["MC_YAWRATE_I"], wanted["MC_PR_INT_LIM"]) == (
        0.95,
        4.0,
        0.1,
        0.3,
    )
    assert px4_parameters(load_vehicle("crazyflie-2.1")) == {}


@pytest.mark.parametrize(("off", "said"), [
    ({}, None),
    ({"MPC_XY_P": 1.2}, r"MPC_XY_P is 1.2, not 0.95\. Put yours into its `autopilot`"),
    ({"MC_YAW_TQ_CUTOFF": None}, "MC_YAW_TQ_CUTOFF is not known, not 2"),
    ({"MC_ROLLRATE_K": 1.5}, r"MC_ROLLRATE_K is 1.5, not 1\. .* no key for has to stand on board"),
])  # fmt: skip
def test_a_link_refuses_gains_on_board_that_were_not_simulated(hall, monkeypatch, off, said):
    pytest.importorskip("pymavlink", reason="pymavlink is not installed")
    from flight.link import mavlink
    from tests.helpers.vehicles.px4_peer import Manner, Px4Peer, free_port

    monkeypatch.setattr(mavlink, "ANSWER", 0.3 if None in off.values() else 1.0)
    board = {name: value for name, value in {**px4_parameters(X500), **off}.items() if value is not None}
    port = free_port()
    peer = Px4Peer(1, port, (0.0, 0.0, 0.0), Manner(armed=False, gains=board))
    peer.start()
    try:
        if said is None:
            link = mavlink.MavlinkLink(hall[0].mission, {"r0": f"udpin:127.0.0.1:{port}"})
            assert link.parameters("r0")["MPC_XY_P"] == pytest.approx(0.95)
            link.close()
            return
        with pytest.raises(LinkLost, match=said):
            mavlink.MavlinkLink(hall[0].mission, {"r0": f"udpin:127.0.0.1:{port}"})
    finally:
        peer.ended.set()
        peer.join()


@pytest.mark.slow  # a link is held to the same
def test_an_exported_script_refuses_gains_on_board_that_were_not_simulated(hall, tmp_path):
    pytest.importorskip("pymavlink", reason="pymavlink is not installed")
    from tests.helpers.vehicles.px4_peer import Manner, Px4Peer, free_port

    _, team, cert, log = hall
    flight.export(team, cert, tmp_path, format="px4", flight=log)
    port = free_port()
    x, y, z = team["r0"].evaluate(0.0)[:3]
    peer = Px4Peer(1, port, (y, x, -z), Manner(gains={**px4_parameters(X500), "MPC_Z_P": 1.5}))
    peer.start()
    try:
        script = [sys.executable, str(tmp_path / "stream_setpoints.py"), f"r0=udpin:127.0.0.1:{port}", "--unchecked=battery"]
        done = subprocess.run(script, capture_output=True, text=True, check=False, timeout=60)
    finally:
        peer.ended.set()
        peer.join()
    assert done.returncode != 0
    assert "gains on board are not those that were simulated: r0: MPC_Z_P is 1.5, not 1" in done.stdout + done.stderr
    assert peer.before == 0


def test_a_rehearsal_flies_what_the_autopilots_run(hall):
    plan, team, cert, _ = hall
    few = flight.Combinations(masses=(1.0,), latencies=(0.015,), winds=("0",))
    assert flight.rehearse(plan, team, cert, combinations=few, runs=1).controllers == ("geometric", "px4")
