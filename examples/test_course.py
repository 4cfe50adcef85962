"""Tests of a course of one's own, for all times and not at samples: `pytest -p verify.testing test_course.py`."""

import numpy as np
import pytest

import refine
from verify import Trajectory
from verify.testing import assert_satisfies, assert_within_limits

REGIONS = {"a": ((1.0, 0.0, 1.0), 0.3), "b": ((1.0, 1.0, 1.0), 0.3), "wall": ((0.4, 0.7, 1.0), 0.2)}


@pytest.fixture
def course() -> Trajectory:
    """Fly around a corner, at rest at both ends."""
    points = np.array([[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 1.0, 0.0], [1.0, 1.0, 1.0, 0.0]])  # x, y, z in m and yaw in rad
    path = refine.minimum_snap(points, np.array([0.0, 2.5, 5.0]))
    return refine.quantise(path)  # the numbers that a vehicle is sent


def test_the_course_does_what_it_is_for(course: Trajectory) -> None:
    assert_satisfies(course, "F(a & F b) & G !wall", REGIONS, margin=0.05)


def test_a_vehicle_can_fly_it(course: Trajectory) -> None:
    assert_within_limits(course, vehicle="crazyflie-2.1", speed=1.5)


def test_a_straight_line_would_hit_the_wall() -> None:
    times, line = [0.0, 2.0, 4.0], [[0.0, 0.4, 1.0], [0.4, 0.7, 1.0], [1.0, 1.0, 1.0]]
    with pytest.raises(AssertionError, match="Violated"):
        assert_satisfies((times, line), "G !wall", REGIONS, max_speed=1.0)
