"""Intervals, sines and the rotors' thrusts against high precision and finite differences; limits just within and just beyond."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import partial
from random import Random
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from verify.kernel.flights import GRAVITY, Path, Segment
from verify.kernel.limits import PI, Interval, Turning, kept, rates_and_thrusts
from verify.kernel.statement import Refused
from verify.kernel.timelines import Course
from verify.kernel.trees import Evidence, Polynomial

ONE = 1 << 64
PI_60 = Fraction(314159265358979323846264338327950288419716939937510582097494, 10**59)
ROBOT: Any = SimpleNamespace(
    mass=Fraction(0.03), arm=Fraction(0.05), torque_to_thrust=Fraction(0.006), inertia=tuple(map(Fraction, (2e-5, 1.7e-5, 3e-5)))
)  # fmt: skip


def cosine_and_sine(angle: Fraction) -> tuple[Fraction, Fraction]:
    """Return both to 50 digits."""
    x = angle - round(angle / (2 * PI_60)) * 2 * PI_60
    sums, term = [Fraction(0), Fraction(0)], Fraction(1)
    for k in range(80):
        sums[k % 2] += term if k % 4 < 2 else -term
        term = Fraction(int(term * x / (k + 1) * 10**60), 10**60)
    return sums[0], sums[1]


def holds(interval: Interval, value: Fraction) -> bool:
    return interval.low <= value * ONE <= interval.high


def test_pi_is_below_pi_by_less_than_it_says() -> None:
    assert 0 < PI_60 - PI < Fraction(1, 10**39)


@pytest.mark.parametrize("number", [60, pytest.param(200, marks=pytest.mark.slow)])
def test_intervals_hold_cosines_and_sines_and_are_narrow(number: int) -> None:
    rng = Random(1)
    for _ in range(number):
        angle = Fraction(rng.uniform(-1, 1) * 10 ** rng.randrange(0, 6))
        width = Fraction(rng.choice([0, 0, 1, 1 << 20, 1 << 40]), 1 << 44)
        angles = Interval.of(angle)
        found = (angles + Interval(0, int(width * ONE))).cosine_and_sine()
        for place in (angle, angle + width / 3, angle + width):
            for one, value in zip(found, cosine_and_sine(place), strict=True):
                assert holds(one, value)
                assert one.high - one.low <= 2 * (width + Fraction(1, 1 << 15)) * ONE


def test_cosines_on_the_grid_are_good_to_nineteen_digits() -> None:
    for middle in (0, 1, 65536, 205887, -205887, 10**9):
        found = Interval.of(Fraction(middle, 1 << 16)).cosine_and_sine()
        for one, value in zip(found, cosine_and_sine(Fraction(middle, 1 << 16)), strict=True):
            assert holds(one, value)
            assert one.high - one.low < 400


def test_results_hold_what_comes_of_the_operands_and_no_more() -> None:
    rng = Random(2)
    for _ in range(300):
        (a, b), (c, d) = (sorted(rng.randrange(-8, 9) for _ in range(2)) for _ in range(2))
        one, other = (Interval(low * ONE, high * ONE) for low, high in ((a, b), (c, d)))
        products = [a * c, a * d, b * c, b * d]
        assert one + other == Interval((a + c) * ONE, (b + d) * ONE)
        assert one - other == Interval((a - d) * ONE, (b - c) * ONE)
        assert one * other == Interval(min(products) * ONE, max(products) * ONE)
        assert one.within(Fraction(a), Fraction(b))
        assert not one.within(a + Fraction(1, 10**9), Fraction(b))
        assert not one.within(Fraction(a), b - Fraction(1, 10**9))
        if c > 0 or d < 0:
            found, quotients = one / other, [Fraction(x, y) for x in (a, b) for y in (c, d)]
            assert found.low <= min(quotients) * ONE < found.low + 20
            assert found.high - 20 < max(quotients) * ONE <= found.high
        else:
            with pytest.raises(Refused):
                one / other
        if a >= 0:
            roots = one.root()
            assert roots.low <= math.isqrt(a * ONE * ONE) < roots.low + 2
            assert roots.high - 2 <= math.isqrt(b * ONE * ONE) <= roots.high


def test_products_of_what_is_no_whole_number_are_rounded_outwards() -> None:
    small = Interval(1, 1)
    assert small * small == Interval(0, 1)
    assert small * Interval(-1, -1) == Interval(-1, 0)
    assert Interval.of(Fraction(1, 3)).high - Interval.of(Fraction(1, 3)).low == 1


# The rate about z and the rotors' thrusts of a motion, by finite differences of the body's axes


def attitude(t: float, force: Any, yaw: Any) -> tuple[np.ndarray, float]:
    f = np.array([np.polynomial.polynomial.polyval(t, row) for row in force])
    psi = np.polynomial.polynomial.polyval(t, yaw)
    z = f / np.linalg.norm(f)
    x = np.cross([-math.sin(psi), math.cos(psi), 0.0], z)  # in the plane of the heading and the vertical
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1), float(np.linalg.norm(f))


def rates(t: float, force: Any, yaw: Any, step: float = 1e-4) -> np.ndarray:
    """Return the body's rates, in its own axes."""
    after, before = attitude(t + step, force, yaw)[0], attitude(t - step, force, yaw)[0]
    turn = attitude(t, force, yaw)[0].T @ (after - before) / (2 * step)
    return np.array([turn[2, 1], turn[0, 2], turn[1, 0]])


def rotors(force: Any, yaw: Any) -> list[float]:
    step, inertia = 1e-3, np.diag([float(x) for x in ROBOT.inertia])
    omega, change = rates(0.0, force, yaw), (rates(step, force, yaw) - rates(-step, force, yaw)) / (2 * step)
    x, y, z = inertia @ change + np.cross(omega, inertia @ omega)
    d, kappa = float(ROBOT.arm) / math.sqrt(2), float(ROBOT.torque_to_thrust)
    share = float(ROBOT.mass) * attitude(0.0, force, yaw)[1] / 4
    places = ((1, 1), (1, -1), (-1, 1), (-1, -1))
    return [omega[2], *(share + sy * x / (4 * d) - sx * y / (4 * d) + sx * sy * z / (4 * kappa) for sx, sy in places)]


def test_rates_and_thrusts_are_those_of_the_body() -> None:
    rng = np.random.default_rng(3)
    for _ in range(40):
        force = np.column_stack([rng.normal([0, 0, 9.8], 2), rng.normal(0, 3, (3, 2))])
        yaw = rng.normal(0, 2, 3)
        f, j, s = force[:, 0], force[:, 1], 2 * force[:, 2]
        given = [*f, *j, *s, yaw[0], yaw[1], 2 * yaw[2], f @ f, f @ j]
        found = rates_and_thrusts(ROBOT, [Interval.of(Fraction(float(value))) for value in given])
        wanted = rotors(force, yaw)
        sure = [float(Fraction(one.low + one.high, 2 * ONE)) for one in found]
        assert sure[0] == pytest.approx(wanted[0], abs=2e-4), "to the grid of angles"
        assert sorted(sure[1:]) == pytest.approx(sorted(wanted[1:]), rel=1e-4, abs=1e-4)


@pytest.mark.parametrize(("least", "most", "accepted"), [(0.07, 0.077, True), (0.07, 0.074, False), (0.072, 0.077, False)])
def test_each_rotor_keeps_its_limits(least: float, most: float, accepted: bool) -> None:
    """While a heading turns faster, two rotors push more than their share of the weight, 0.0735 N, and two less, by 0.0025 N."""
    limits = {"rotor_thrust_min": Fraction(least), "rotor_thrust_max": Fraction(most), "yaw_rate": Fraction(3)}
    axes = [Polynomial.of(list(map(Fraction, row))) for row in (*[[0] * 5] * 3, [0, 0, 1, 0, 0])]
    piece = Segment(Fraction(0), Fraction(1), axes)
    assert Turning(SimpleNamespace(**vars(ROBOT), limits=limits), piece).holds("m") == accepted  # type: ignore[arg-type]


# Limits of a constant motion, held just within and just beyond


def flown(x: list[float], **limits: float) -> Path:
    axes = [Polynomial.of([Fraction(c) for c in row]) for row in (x, [0.0], [0.0], [0.0])]
    segment = Segment(Fraction(0), Fraction(1), axes)
    own: Any = SimpleNamespace(mass=Fraction(1, 32), limits={"thrust_min": Fraction(limits.get("thrust_min", 0.01))})
    return Path("r", own, [segment], [segment], None)


def is_kept(path: Path, name: str, limit: Fraction) -> bool:
    try:
        Evidence({"limits": "m"}).prove("limits", kept(path, (name, limit)))
    except Refused:
        return False
    return True


WEIGHT = GRAVITY / 32


@pytest.mark.parametrize(
    ("name", "path", "exact"),
    [
        ("speed", flown([0.0, 0.75]), Fraction(3, 4)),
        ("acceleration", flown([0.0, 0.0, 0.25]), Fraction(1, 2)),
        ("thrust_max", flown([0.0]), WEIGHT),
        ("body_rate", flown([0.0, 0.0, 0.0, 1 / 6], thrust_min=0.01), None),
    ],
)
def test_upper_limits_are_kept_to_the_last_bit(name: str, path: Path, exact: Fraction | None) -> None:
    if exact is None:  # at the start jerk 1 across gravity, and slower later on
        exact = Fraction(Fraction(1 / 6) * 6) / GRAVITY
        assert not is_kept(path, name, Fraction(int(exact * 2**50), 2**50))
        assert is_kept(path, name, Fraction(int(exact * 2**50) + 1, 2**50) + Fraction(1, 64))
        return
    assert is_kept(path, name, exact)
    assert not is_kept(path, name, exact - Fraction(1, 1 << 60))


def test_the_least_thrust_is_kept_to_the_last_bit() -> None:
    still = flown([0.0])
    still.robot.limits["thrust_min"] = WEIGHT
    assert is_kept(still, "thrust_min", WEIGHT)
    still.robot.limits["thrust_min"] = WEIGHT + Fraction(1, 1 << 60)
    assert not is_kept(still, "thrust_min", WEIGHT)
    assert not is_kept(still, "tilt", Fraction(1))
    assert not is_kept(still, "body_rate", Fraction(1))


@pytest.mark.parametrize("slope", [0.25, 1.0, 3.0])
def test_tilt_is_the_angle_from_the_vertical(slope: float) -> None:
    """A constant acceleration across gravity."""
    path = flown([0.0, 0.0, slope * float(GRAVITY) / 2])
    assert is_kept(path, "tilt", Fraction(math.atan(slope) + 1e-4))
    assert not is_kept(path, "tilt", Fraction(math.atan(slope) - 1e-4))


def test_limits_of_a_way_may_be_left_open_only_beside_it() -> None:
    fast = flown([0.0, 0.0, 0.5])  # at speed t
    for low, high, limit, marks, accepted in (
        (0, 0.5, 0.5, "m?", True),
        (0, 0.5, 0.4375, "m?", False),
        (0, 0.75, 0.5, "m?", False),
        (0.5, 1, 1, "?m", True),
        (0.5, 2, 0.9375, "?m", False),
        (0.25, 0.75, 1, "?m", False),
        (1, 2, 0.1, "??", True),
    ):
        course: Any = SimpleNamespace(name="r", path=fast, evidence=Evidence({"legs/speed/r/0": f"s{marks}"}))
        course._along, course.windows = partial(Course._along, course), lambda _, times=(Fraction(low), Fraction(high)): [times]
        course.robot = SimpleNamespace(visits=[SimpleNamespace(region="a")])
        if accepted:
            assert "speed limit" in Course.leg(course, 0, ("speed", Fraction(limit)))
        else:
            with pytest.raises(Refused):
                Course.leg(course, 0, ("speed", Fraction(limit)))


def test_limits_of_random_motions_are_kept_where_they_are() -> None:
    """Pieces so short that speed, acceleration, thrust, tilt and body rate are what they are at the beginning."""
    rng = np.random.default_rng(6)
    for _ in range(40):
        rows = np.round(rng.normal(0, 2, (3, 4)) * 2**20) / 2**20
        axes = [Polynomial.of([Fraction(c) for c in row]) for row in [*rows, [0.0]]]
        segment = Segment(Fraction(0), Fraction(1, 1 << 14), axes)
        own: Any = SimpleNamespace(mass=Fraction(1, 32), limits={"thrust_min": Fraction(1, 1000)})
        path = Path("r", own, [segment], [segment], None)
        speed, acceleration, jerk = rows[:, 1], 2 * rows[:, 2], 6 * rows[:, 3]
        force = np.add(acceleration, [0, 0, float(GRAVITY)])
        size = np.linalg.norm(force)
        wanted = {
            "speed": np.linalg.norm(speed), "acceleration": np.linalg.norm(acceleration), "thrust_max": size / 32,
            "body_rate": np.linalg.norm(np.cross(jerk, force)) / size**2, "tilt": math.acos(force[2] / size),
        }  # fmt: skip
        for name, value in wanted.items():
            if name != "tilt" or value < 1.4:
                assert is_kept(path, name, Fraction(float(value) * 1.01)), name
            assert not is_kept(path, name, Fraction(float(value) * 0.99)), name
        for share, accepted in ((0.99, True), (1.01, False)):
            own.limits["thrust_min"] = Fraction(float(size) / 32 * share)
            assert is_kept(path, "thrust_min", own.limits["thrust_min"]) == accepted
