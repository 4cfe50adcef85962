"""Laws of the models: hover, free fall, energy, momentum; flatness undoes the dynamics; rotorpy agrees."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from flight.control.flatness import feed_forward, lifted
from flight.model.airframe import airframe_of, shipped_airframes
from flight.model.attitude import (
    cross,
    dot,
    euler,
    euler_rate,
    euler_rate_inverse,
    from_euler,
    from_matrix,
    matrix,
    quaternion_rate,
    to_body,
    to_world,
    unit,
)
from flight.model.dynamics import (
    ATTITUDE,
    POSITION,
    RATES,
    ROTORS,
    VELOCITY,
    QuadcopterDynamics,
    hover_state,
    rotor_thrusts,
)
from flight.model.paper import PAPER_STATES, paper_derivative, paper_step
from tests.helpers.few import few_of
from tests.helpers.motion.stand_ins import hoop6
from verify.data import GRAVITY, load_vehicle

RNG = np.random.default_rng(8)


def airframe(name="crazyflie-2.1", **changes):
    return airframe_of(load_vehicle(name)).model_copy(update=changes)


def model(name="crazyflie-2.1", **changes):
    return QuadcopterDynamics(airframe(name, **changes))


def hovering(made, n=1):
    return hover_state(made.airframe, np.tile([[0.3], [-0.2], [1.0]], (1, n)), np.zeros(n))


@few_of(2, "name", shipped_airframes())
def test_a_vehicle_at_hover_speed_stays_where_it_is(name):
    made = model(name)
    state = begin = hovering(made)
    for _ in range(500):
        state = made.step(state, begin[ROTORS], 0.0, 0.002)
    assert np.allclose(state, begin, atol=1e-9)


def test_without_thrust_or_air_a_vehicle_falls_freely():
    made = model(rotor_drag=0.0, inflow_drag=0.0)
    state = hovering(made)
    state[ROTORS] = 0.0
    begin = state.copy()
    for _ in range(250):
        state = made.step(state, np.zeros((4, 1)), 0.0, 0.002)
    assert np.allclose(state[2], begin[2] - 0.5 * GRAVITY * 0.25, atol=1e-12)
    assert np.allclose(state[5], -GRAVITY * 0.5, atol=1e-12)


def energy_of(made, state):
    """Return kinetic (of the body) plus potential energy, J, above z = 0."""
    vehicle = made.airframe.vehicle
    spin = state[RATES] * np.array(made.airframe.vehicle.inertia)[:, None]
    moving = 0.5 * vehicle.mass * dot(state[VELOCITY], state[VELOCITY]) + 0.5 * dot(state[RATES], spin)
    return moving + vehicle.mass * GRAVITY * state[2]


def momentum_of(made, state):
    """Return the body's angular momentum in the world frame, kg m^2/s."""
    return to_world(matrix(state[ATTITUDE]), state[RATES] * np.array(made.airframe.vehicle.inertia)[:, None])


def test_without_thrust_or_air_energy_and_angular_momentum_are_kept():
    made = model(rotor_drag=0.0, inflow_drag=0.0)
    state = hovering(made, 20)
    state[ROTORS] = 0.0
    state[VELOCITY], state[RATES] = RNG.normal(size=(3, 20)), 5.0 * RNG.normal(size=(3, 20))
    state[ATTITUDE] = unit(RNG.normal(size=(4, 20)))
    energy, momentum = energy_of(made, state), momentum_of(made, state)
    for _ in range(500):
        state = made.step(state, np.zeros((4, 20)), 0.0, 0.002)
    assert np.allclose(energy_of(made, state), energy, rtol=0, atol=1e-9)
    assert np.allclose(momentum_of(made, state), momentum, rtol=0, atol=1e-11)


def test_still_air_only_takes_energy_away():
    made = model()
    state = hovering(made, 20)
    state[ROTORS] = made.airframe.hover_speed
    state[VELOCITY] = RNG.normal(size=(3, 20))
    state[ROTORS] = 1e-9  # rotors that turn without lifting would still drag; these do neither
    before = energy_of(made, state)
    for _ in range(100):
        state = made.step(state, state[ROTORS], 0.0, 0.002)
    assert np.all(energy_of(made, state) <= before + 1e-9)


def test_moving_with_the_wind_is_hovering_in_still_air():
    made = model()
    wind = np.array([[1.0], [-2.0], [0.3]])
    still = moving = hovering(made)
    moving = moving.copy()
    moving[VELOCITY] = wind
    command = 1.05 * still[ROTORS]
    for _ in range(200):
        still, moving = made.step(still, command, 0.0, 0.002), made.step(moving, command, wind, 0.002)
    assert np.allclose(moving[POSITION], still[POSITION] + 0.4 * wind, atol=1e-9)
    assert np.allclose(moving[ATTITUDE], still[ATTITUDE], atol=1e-12)


def test_rotors_follow_a_command_with_their_lag():
    made = model()
    state = hovering(made)
    begin, goal = made.airframe.hover_speed, 1.2 * made.airframe.hover_speed
    for _ in range(36):
        state = made.step(state, np.full((4, 1), goal), 0.0, 0.002)
    assert np.allclose(state[ROTORS], goal + (begin - goal) * np.exp(-1.0), rtol=1e-12)


def test_rotor_thrusts_give_the_thrust_and_torque_they_are_asked_for():
    made = model()
    vehicle = made.airframe.vehicle
    thrust = np.full(50, vehicle.weight)
    torque = RNG.uniform(-1, 1, (3, 50)) * np.array([[6e-4], [6e-4], [1e-4]])
    pulls = made.commands(thrust, torque)
    a, k = vehicle.arm / np.sqrt(2), vehicle.torque_to_thrust
    y, x, spin = np.array([1, -1, -1, 1]), np.array([1, 1, -1, -1]), np.array([1, -1, 1, -1])
    assert np.allclose(np.sum(pulls, axis=0), thrust)
    assert np.allclose([a * y @ pulls, -a * x @ pulls, k * spin @ pulls], torque, atol=1e-15)


def test_a_saturated_rotor_gives_up_yaw_first_and_never_leaves_its_limits():
    made = model()
    vehicle = made.airframe.vehicle
    pulls = made.commands(np.full(50, vehicle.weight), RNG.normal(size=(3, 50)) * 5e-3)
    assert np.all(pulls >= vehicle.rotor_thrust_min)
    assert np.all(pulls <= vehicle.rotor_thrust_max)
    torque = np.array([[1e-3], [0.0], [5e-2]])
    pulls = made.commands(np.array([vehicle.weight]), torque)
    assert np.allclose(vehicle.arm / np.sqrt(2) * np.array([1, -1, -1, 1]) @ pulls, 1e-3)


def test_flatness_undoes_the_papers_dynamics():
    """Inputs from flatness, integrated by eqs. (2) and (3), fly the polynomial that they came from."""
    path, dt, mass = hoop6(), 0.002, 0.033
    state = np.zeros((PAPER_STATES, 1))
    state[:3, 0] = path.evaluate(0.0)[:3]
    worst = 0.0
    for step in range(800):
        flats = [path.evaluate((step + 0.5) * dt, k)[:, None] for k in range(5)]
        wanted = feed_forward(lifted(flats[2][:3]), flats[3][:3], flats[4][:3], flats[0][3], flats[1][3], flats[2][3])
        state = paper_step(state, mass * wanted.thrust, wanted.rates, mass, dt)
        worst = max(worst, float(np.linalg.norm(state[:3, 0] - path.evaluate((step + 1) * dt)[:3])))
    assert worst < 2e-5


def test_flat_rates_and_their_changes_are_derivatives_of_the_attitude():
    """With random jets of force and heading, against central differences of the attitude itself."""
    n, h = 40, 1e-4
    force = RNG.normal(size=(3, n)) * 2 + np.array([[0], [0], [10]])
    jerk, snap = RNG.normal(size=(3, n)) * 10, RNG.normal(size=(3, n)) * 50
    yaw, yaw_rate, yaw_change = RNG.normal(size=(3, n))

    def at(t):
        f = force + t * jerk + 0.5 * t * t * snap
        y = yaw + t * yaw_rate + 0.5 * t * t * yaw_change
        return feed_forward(f, jerk + t * snap, snap, y, yaw_rate + t * yaw_change, yaw_change)

    now, before, after = at(0.0), at(-h), at(h)
    change = (after.turn - before.turn) / (2 * h)
    skew = np.einsum("jin,jkn->ikn", now.turn, change)
    assert np.allclose([skew[2, 1], skew[0, 2], skew[1, 0]], now.rates, atol=1e-5)
    assert np.allclose((after.rates - before.rates) / (2 * h), now.rates_change, atol=1e-4)
    assert np.allclose((after.thrust - before.thrust) / (2 * h), now.thrust_rate, atol=1e-5)
    assert np.allclose(np.linalg.det(np.moveaxis(now.turn, 2, 0)), 1.0)
    assert np.allclose(euler(from_matrix(now.turn))[2], (yaw + np.pi) % (2 * np.pi) - np.pi)


def test_rotations_in_all_their_forms_agree():
    angles = RNG.uniform(-1, 1, (3, 60)) * np.array([[3.1], [1.5], [3.1]])
    q = from_euler(angles)
    turn = matrix(q)
    assert np.allclose(euler(q), angles)
    assert np.allclose(np.abs(np.sum(from_matrix(turn) * q, axis=0)), 1.0)
    vector = RNG.normal(size=(3, 60))
    assert np.allclose(to_body(turn, np.einsum("ijn,jn->in", turn, vector)), vector)
    rates = RNG.normal(size=(3, 60))
    assert np.allclose(euler_rate_inverse(angles, euler_rate(angles, rates)), rates)
    h = 1e-6
    moved = euler(unit(q + h * quaternion_rate(q, rates)))
    assert np.allclose(((moved - angles + np.pi) % (2 * np.pi) - np.pi) / h, euler_rate(angles, rates), atol=2e-3)
    assert np.allclose(cross(vector, rates), np.cross(vector.T, rates.T).T)


def test_the_papers_equations_are_those_of_the_rotation_matrix():
    state = RNG.uniform(-1, 1, (PAPER_STATES, 30))
    thrust, rates = RNG.uniform(0, 1, 30), RNG.normal(size=(3, 30))
    change = paper_derivative(state, thrust, rates, 0.5)
    turn = matrix(from_euler(state[6:9]))
    assert np.allclose(change[3:6], turn[:, 2] * thrust / 0.5 - np.array([[0], [0], [GRAVITY]]))
    assert np.allclose(change[6:9], euler_rate(state[6:9], rates))


def test_rotorpy_gives_the_same_flight_for_the_same_rotor_commands():
    """Against another project's model with our numbers in it: positions agree to 50 um after a second of tumbling."""
    rotorpy = pytest.importorskip("rotorpy.vehicles.multirotor", reason="rotorpy is not installed")
    ours = airframe(rotor_inertia=0.0)
    vehicle, made = ours.vehicle, QuadcopterDynamics(ours)
    a = vehicle.arm / np.sqrt(2)
    places = {"r1": (a, a, 0), "r2": (a, -a, 0), "r3": (-a, -a, 0), "r4": (-a, a, 0)}
    params = {
        "mass": vehicle.mass, "Ixx": vehicle.inertia[0], "Iyy": vehicle.inertia[1], "Izz": vehicle.inertia[2],
        "Ixy": 0.0, "Ixz": 0.0, "Iyz": 0.0, "num_rotors": 4, "rotor_pos": {k: np.array(v) for k, v in places.items()},
        "rotor_directions": np.array([1, -1, 1, -1]), "rotor_speed_min": 0.0, "rotor_speed_max": 1e4,
        "k_eta": ours.thrust_coefficient, "k_m": ours.thrust_coefficient * vehicle.torque_to_thrust,
        "k_d": ours.rotor_drag, "k_z": ours.inflow_drag, "tau_m": ours.rotor_lag, "rI": np.zeros(3),
    }  # fmt: skip
    state = hover_state(ours, np.array([[0.0], [0.0], [1.0]]), np.zeros(1))
    theirs = {
        "x": state[:3, 0].copy(), "v": np.zeros(3), "q": np.array([0.0, 0, 0, 1]), "w": np.zeros(3), "wind": np.array([0.5, -0.3, 0.1]),
        "rotor_speeds": state[ROTORS, 0].copy(),
    }  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        peer = rotorpy.Multirotor(params, dict(theirs), integrator_kwargs={"method": "DOP853", "rtol": 1e-10, "atol": 1e-12})
    peer.g = GRAVITY
    peer.weight = np.array([0, 0, -vehicle.weight])
    rng = np.random.default_rng(0)
    for _ in range(50):
        command = ours.hover_speed * (1 + 0.02 * rng.normal(size=4))
        theirs = peer.step(theirs, {"cmd_motor_speeds": command}, 0.02)
        for _ in range(10):
            state = made.step(state, command[:, None], theirs["wind"][:, None], 0.002)
    q = state[ATTITUDE, 0]
    assert np.linalg.norm(theirs["x"] - state[POSITION, 0]) < 5e-5
    assert np.linalg.norm(theirs["v"] - state[VELOCITY, 0]) < 3e-4
    assert abs(theirs["q"] @ np.array([q[1], q[2], q[3], q[0]])) > 1 - 1e-8
    assert np.allclose(rotor_thrusts(ours, state)[:, 0], ours.thrust_coefficient * theirs["rotor_speeds"] ** 2)


def test_a_vehicle_that_cannot_hover_is_refused():
    vehicle = load_vehicle("crazyflie-2.1")
    with pytest.raises(ValueError, match="cannot hover"):
        type(vehicle)(**{**vehicle.model_dump(), "mass": 0.06})


def test_every_shipped_airframe_is_known_and_an_inline_vehicle_gets_an_estimate():
    for name in shipped_airframes():
        assert airframe(name).known
    inline = airframe_of(load_vehicle("crazyflie-2.1").model_copy(update={"name": "mine"}))
    assert not inline.known
    assert inline.rotor_drag > 0
    assert inline.battery.hover_current > 0


@pytest.mark.parametrize(
    ("change", "said"), [({"empty": 5.0}, "is not below full"), ({"resistance": 1e6}, "nothing is left to fly with")]
)
def test_batteries_that_lift_nothing_are_refused(change, said):
    battery = airframe_of(load_vehicle("crazyflie-2.1")).battery
    with pytest.raises(ValueError, match=said):
        type(battery).model_validate({**battery.model_dump(), **change})
