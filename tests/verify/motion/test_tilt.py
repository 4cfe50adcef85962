"""Tilts of a right angle and more, where the angle is rounded outwards from numbers that no float is."""

import math

import numpy as np
import pytest
from flint import arb

from tests.helpers.motion.flights import legs, small_mission
from verify.arithmetic.balls import Balls, constants
from verify.motion.paths import read_team
from verify.motion.tilt import tilt_peaks

PATHS = read_team(small_mission(regions=""), {"r0": legs([[0, 0, 1]])})
LIMIT = math.radians(50.0)


def steady(x: float, y: float, z: float):
    """The tilt of a force that is the same all the time, in m/s^2."""
    force = constants(np.array([[x, y, z]]))
    return tilt_peaks(PATHS, force, [LIMIT])


def test_a_right_angle_lies_between_the_two_bounds():
    found = steady(3.0, -4.0, 0.0)
    assert arb(float(found.lower[0])) < arb.pi() / 2 < arb(float(found.upper[0]))
    assert found.upper[0] - found.lower[0] < 1e-9


def test_upside_down_lies_between_the_two_bounds():
    found = steady(0.0, 0.0, -9.0)
    assert found.lower[0] < arb.pi() < found.upper[0]
    assert found.upper[0] == math.nextafter(math.pi, math.inf)
    assert found.upper[0] - found.lower[0] < 1e-6


@pytest.mark.parametrize("degrees", [91.0, 120.0, 135.0, 179.0])
def test_obtuse_angles_lie_between_the_two_bounds(degrees):
    angle = math.radians(degrees)
    found = steady(math.sin(angle), 0.0, math.cos(angle))
    assert found.lower[0] - 1e-15 <= angle <= found.upper[0] + 1e-15
    assert found.upper[0] - found.lower[0] < 1e-9


@pytest.mark.parametrize("limit", [2.0, 5.0, 50.0])
def test_a_tilt_is_bounded_as_tightly_under_a_small_limit(limit: float) -> None:
    """A force that swings to one side and back, at most half the limit from the vertical."""
    side = 2 * math.tan(math.radians(limit / 2))  # a parabola reaches half its middle coefficient
    force = Balls(np.array([[[0.0, side, 0.0], [0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]]), np.zeros((1, 3, 3)))
    found = tilt_peaks(PATHS, force, [math.radians(limit)])
    assert found.lower[0] - 1e-15 <= math.radians(limit / 2) <= found.upper[0] + 1e-15
    assert found.upper[0] - found.lower[0] < 1e-4 * math.radians(limit)
