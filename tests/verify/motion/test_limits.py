import math
from fractions import Fraction

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.motion.flights import legs, quantised, small_mission
from tests.helpers.motion.limited_quantities import sampled
from verify.data.sections import LegLimits
from verify.data.trajectory import Trajectory
from verify.data.vehicle import GRAVITY, load_vehicle
from verify.motion.limits import UNITS, extremes, leg_extremes
from verify.motion.paths import read_team

MISSION = small_mission(regions="")


def extremes_of(trajectory, mission=MISSION):
    return {e.name: e for e in extremes(read_team(mission, {"r0": trajectory}))}


def smooth(rng, pieces=2, yaw=True, size=1.0) -> Trajectory:
    """Random pieces with moderate derivatives up to snap, each by itself (limits do not mind the joints)."""
    durations = rng.uniform(0.5, 2.0, pieces).astype(np.float32).astype(float)
    coefficients = rng.normal(size=(pieces, 4, 8)) * size
    coefficients /= np.cumprod(np.arange(1, 9))[None, None] * durations[:, None, None] ** np.arange(8)
    if not yaw:
        coefficients[:, 3, 1:] = 0
    return quantised(Trajectory(durations, coefficients))


@pytest.mark.parametrize("yaw", [False, True])
def test_bounds_hold_and_are_tight_against_samples(yaw):
    rng = np.random.default_rng(7 + yaw)
    vehicle = load_vehicle("crazyflie-2.1")
    for _ in range(6):
        trajectory = smooth(rng, yaw=yaw)
        found = extremes_of(trajectory)
        for name, values in sampled(trajectory, vehicle).items():
            extreme = found[name]
            tolerance = 2e-5 * max(1.0, float(np.abs(values).max()))
            if name.endswith("_min"):
                assert extreme.bound <= values.min() + tolerance
                assert extreme.reached >= extreme.bound
                assert extreme.reached <= values.min() + 0.02 * abs(extreme.limit) + tolerance
            else:
                assert extreme.bound >= values.max() - tolerance
                assert extreme.reached <= extreme.bound
                assert extreme.bound <= values.max() + 0.02 * extreme.limit + tolerance


def constant(acceleration, jerk=(0, 0, 0), velocity=(0, 0, 0), yaw=(0.0,), duration=1e-3):
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, :3, 0] = [0, 0, 1]
    coefficients[0, :3, 1] = velocity
    coefficients[0, :3, 2] = np.array(acceleration) / 2
    coefficients[0, :3, 3] = np.array(jerk) / 6
    coefficients[0, 3, : len(yaw)] = yaw
    return Trajectory([duration], coefficients)


def test_the_body_rates_of_a_worked_example():
    # f = (8, 8, 10), j = (60, -40, 0) at constant yaw: omega = (3.56, 3.10, 1.94), of which x and y have norm 4.72
    trajectory = constant((8, 8, 10 - GRAVITY), (60, -40, 0), duration=1e-6)
    found = extremes_of(trajectory)
    assert found["body_rate"].bound == pytest.approx(math.hypot(3.56, 3.10), abs=0.01)
    assert found["yaw_rate"].bound == pytest.approx(1.94, abs=0.01)


def test_hover():
    found = extremes_of(constant((0, 0, 0), duration=3.0))
    weight = load_vehicle("crazyflie-2.1").weight
    assert all(e.holds for e in found.values())
    assert found["thrust_max"].bound == pytest.approx(weight, rel=1e-9)
    assert found["thrust_min"].bound == pytest.approx(weight, rel=1e-9)
    assert found["rotor_thrust_max"].bound == pytest.approx(weight / 4, rel=1e-9)
    for name in ("speed", "acceleration", "tilt", "body_rate", "yaw_rate"):
        assert found[name].bound < 1e-12
    assert set(found) == set(UNITS)


def test_turning_on_the_spot_at_a_constant_rate():
    found = extremes_of(constant((0, 0, 0), yaw=(0.3, 2.0), duration=4.0))
    assert found["yaw_rate"].bound == pytest.approx(2.0, abs=1e-3)
    assert found["yaw_rate"].holds
    assert extremes_of(constant((0, 0, 0), yaw=(0.3, 4.0), duration=4.0))["yaw_rate"].fails
    for room in (1e-4, 1e-9, -1e-9, -1e-4):
        limit = float(np.degrees(2.0 * (1 + room)))
        mission = small_mission(regions="", extra=f"limits: {{yaw_rate_deg: {limit!r}}}")
        told = extremes_of(constant((0, 0, 0), yaw=(0.3, 2.0), duration=4.0), mission)["yaw_rate"]
        assert (told.holds, told.fails) == (room > 0, room < 0)


@pytest.mark.parametrize(
    ("name", "trajectory", "value"),
    [
        ("speed", constant((0, 0, 0), velocity=(0.75, 0.0, 1.0)), 1.25),
        ("acceleration", constant((0, 3, 4)), 5.0),
    ],
)
def test_ties_are_kept_and_the_next_float_is_not(name, trajectory, value):
    for limit, kept in ((value, True), (math.nextafter(value, 0), False), (math.nextafter(value, 9), True)):
        mission = small_mission(regions="", extra=f"limits: {{{name}: {limit!r}}}")
        extreme = extremes_of(trajectory, mission)[name]
        assert (extreme.holds, extreme.fails) == (kept, not kept)
        assert not kept or extreme.bound <= limit


HALF_KILO = {"mass": 0.5, "thrust_min": 1.0, "thrust_max": 9.0, "rotor_thrust_max": 3.0, "body_rate_deg": 1000.0}
TWO_KILO = {"mass": 2.0, "thrust_min": 1.0, "thrust_max": 99.0, "rotor_thrust_max": 25.0, "body_rate_deg": 1000.0}


@pytest.mark.parametrize("own", [HALF_KILO, TWO_KILO])
@pytest.mark.parametrize(("name", "side"), [("thrust_max", 1), ("thrust_min", -1)])
def test_ties_of_thrust_are_kept_and_the_next_float_is_not(own, name, side):
    # f = (3, 0, 4) m/s^2 exactly, so m |f| is five times the mass, without any rounding
    steady, thrust = constant((3, 0, 4 - GRAVITY)), 5.0 * own["mass"]
    for limit, kept in ((thrust, True), (math.nextafter(thrust, -side * math.inf), False), (thrust + side * 1e-9, True)):
        vehicle = MISSION.vehicle.model_copy(update={**own, name: limit})
        extreme = extremes_of(steady, MISSION.model_copy(update={"vehicle": vehicle}))[name]
        assert (extreme.holds, extreme.fails) == (kept, not kept)


@pytest.mark.parametrize(("own", "least"), [(HALF_KILO, 0.75), (TWO_KILO, 0.75), (TWO_KILO, 2.5)])
def test_a_tie_of_the_body_rate_is_kept_where_thrust_keeps_the_attitude_defined(own, least):
    # f = (t, 0, 1) turns at 1 / (1 + t^2): at 1 rad/s where it begins, and m |f| never falls below the mass
    degrees = next(d for d in (180 / math.pi, math.nextafter(180 / math.pi, 99)) if math.radians(d) == 1.0)
    vehicle = MISSION.vehicle.model_copy(update={**own, "body_rate_deg": degrees, "thrust_min": least})
    turning = constant((0, 0, 1 - GRAVITY), (1, 0, 0), duration=1.0)
    extreme = extremes_of(turning, MISSION.model_copy(update={"vehicle": vehicle}))["body_rate"]
    kept = least <= own["mass"]
    assert extreme.holds == kept
    assert not kept or extreme.bound == 1.0


def test_a_limit_passed_by_a_millionth_for_a_millisecond():
    # the speed is 1 but for a bump of 1e-6 over about 1 ms in the middle of a second
    coefficients = np.zeros((3, 4, 8))
    coefficients[:, 0, 1] = 1.0
    coefficients[1, 0, 2:4] = [0.5 * 4e-6 / 1e-3, -(1 / 3) * 4e-6 / 1e-6]  # v = 1 + 4e-6 s (1 - s), s = t / 1 ms
    trajectory = Trajectory([0.5, 1e-3, 0.5], coefficients)
    mission = small_mission(regions="", extra="limits: {speed: 1.0}")
    extreme = extremes_of(trajectory, mission)["speed"]
    assert extreme.fails
    assert 0.5 < extreme.time < Fraction(501, 1000)
    assert extreme.bound == pytest.approx(1 + 1e-6, abs=1e-9)
    assert np.linalg.norm(trajectory.evaluate(np.linspace(0, 1, 101), 1)[:, :3], axis=1).max() <= 1.0


def test_thrust_through_zero_proves_nothing_about_attitude():
    # free fall for an instant: f_z = g - 20 t passes zero
    trajectory = constant((0.5, 0, 0), (0, 0, -20), duration=1.0)
    found = extremes_of(trajectory)
    assert found["thrust_min"].fails
    for name in ("tilt", "rotor_thrust_max", "rotor_thrust_min"):
        assert not found[name].holds
    exactly = constant((0, 0, 0), (0, 0, -20), duration=1.0)
    found = extremes_of(exactly)
    for name in ("tilt", "body_rate", "yaw_rate", "thrust_min", "rotor_thrust_min"):
        assert not found[name].holds


def test_upside_down_is_refused():
    found = extremes_of(constant((0, 0, -30), duration=1.0))
    assert found["tilt"].fails
    assert found["tilt"].reached == pytest.approx(math.pi, abs=1e-6)
    assert found["thrust_max"].fails


@pytest.mark.parametrize("tilt", [89.0, 90.0, 91.0, 120.0, 175.0, 179.9])
def test_tilts_beyond_a_quarter_turn(tilt):
    angle = math.radians(tilt)
    steady = constant((12 * math.sin(angle), 0, 12 * math.cos(angle) - GRAVITY), duration=1.0)
    found = extremes_of(steady)["tilt"]
    assert found.fails
    assert math.degrees(found.reached) == pytest.approx(tilt, abs=1e-3)
    assert found.reached <= found.bound <= found.reached + 1e-4


def test_a_flip_fails_where_it_is_steepest():
    # fz = g - 15 t + 3 t^2 falls below zero while fx stays 1: beyond 90 degrees, up to atan2(1, fz) where fz is least
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, 0, 2] = 0.5
    coefficients[0, 2, 3:5] = -15 / 6, 3 / 12
    flight = Trajectory([4.0], coefficients)
    found = extremes_of(flight)["tilt"]
    times = np.linspace(0, 4, 40001)
    force = flight.evaluate(times, 2)[:, :3] + np.array([0, 0, GRAVITY])
    angles = np.arctan2(np.hypot(force[:, 0], force[:, 1]), force[:, 2])
    assert found.fails
    assert math.pi / 2 < angles.max()
    assert angles.max() - 1e-4 <= found.reached <= found.bound + 1e-12
    assert angles.max() <= found.bound <= angles.max() + 1e-3
    assert float(found.time) == pytest.approx(times[np.argmax(angles)], abs=0.1)


def test_tilt_at_its_limit():
    # f = (tan 35 deg g, 0, g): the limit itself is irrational, so the tie is refused or kept, but next to it is clear
    for factor, kept in ((1 - 1e-9, True), (1 + 1e-9, False)):
        side = math.tan(math.radians(35.0)) * GRAVITY * factor
        extreme = extremes_of(constant((side, 0, 0)))["tilt"]
        assert extreme.holds == kept
        assert extreme.fails != kept


@few_of(1, "size", [1e300, 1e150, 1e30])
def test_absurd_numbers_prove_nothing_and_raise_nothing(size):
    trajectory = constant((size, size, size), (size, 0, -size), (size, size, 0), (0.0, size))
    found = extremes_of(trajectory)
    assert not any(found[name].holds for name in ("speed", "acceleration", "thrust_max", "rotor_thrust_max", "yaw_rate"))


def test_a_leg_is_limited_in_its_own_time_only():
    trajectory = legs([[0, 0, 1], [1, 0, 1], [1, 2, 1]], speed=0.5)  # peaks of 2.1875 * 0.5 m/s at 1 s and at 4 s
    paths = read_team(MISSION, {"r0": trajectory})
    (slow,) = leg_extremes(paths, 0, [(Fraction(0), Fraction(1, 2))], LegLimits(speed=1.0))
    assert slow.holds
    (fast,) = leg_extremes(paths, 0, [(Fraction(1, 2), Fraction(3, 2))], LegLimits(speed=1.0))
    assert fast.fails
    assert float(fast.time) == pytest.approx(1.0, abs=1e-3)
    assert fast.bound == pytest.approx(2.1875 * 0.5, rel=1e-6)
    both = leg_extremes(paths, 0, [(Fraction(7, 2), Fraction(9, 2))], LegLimits(speed=2.0, acceleration=3.0))
    assert [e.name for e in both] == ["speed", "acceleration"]
    assert all(e.holds for e in both)
    (none,) = leg_extremes(paths, 0, [], LegLimits(speed=1.0))  # of no time at all nothing is proved
    assert not none.holds
    assert not none.fails
