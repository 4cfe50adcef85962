"""Control points of a hoop, and the four primitives between them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ltlplan.paths.hoops import choose, control_points
from ltlplan.paths.hoops.primitives import DELTA, s_curve, straight, turn, u_turn
from verify.data.shapes.region import Hoop

# Control points


@given(st.floats(-180, 180), st.floats(-80, 80), st.floats(0.3, 1.0), st.floats(0.3, 1.0))
@settings(max_examples=25, deadline=None)
def test_control_points_lie_on_the_hoops_own_axes(yaw, pitch, reach, clearance):
    hoop = Hoop(
        center=(1.0, -2.0, 1.5), radii=(0.2, 0.2, 0.2), opening=0.3, rim=0.02,
        yaw_deg=yaw, pitch_deg=pitch, reach=reach, clearance=clearance,
    )  # fmt: skip
    points = control_points(hoop)
    assert np.allclose(points.frame.T @ points.frame, np.eye(3), atol=1e-12)
    assert np.isclose(np.linalg.det(points.frame), 1.0)
    own = [points.frame.T @ (p - points.centre) for p in (points.front, points.rear, *points.avoid)]
    assert np.allclose(own, [[reach, 0, 0], [-reach, 0, 0], [0, clearance, 0], [0, -clearance, 0]], atol=1e-12)
    assert np.allclose(points.avoid[:, 2], points.centre[2])  # both sides at the hoop's own height


# The four primitives


@pytest.mark.parametrize(
    ("offset", "past", "kind", "length"),
    [
        ((2.0, 0.0, 0.0), 1.0, "STRAIGHT", 2.0),
        ((2.0, 0.0, 0.0), -1.0, "STRAIGHT", 2.0),  # dist_yz = 0 ends the choice, whatever the direction was
        ((1.0, 2.0, 0.0), 1.0, "U_TURN", 1.0 + math.pi / 2),
        ((1.0, 0.0, 1.0), 1.0, "U_TURN", math.pi / 2),
        ((-1.0, 2.0, 0.0), 1.0, "TURN", 1.0 + math.pi),
        ((1.0, 0.6, 0.8), -1.0, "TURN", 1.0 + math.pi / 2),
    ],
)
def test_each_primitive_has_its_formulas_length(offset, past, kind, length):
    primitive = choose(np.array([-past, 0.0, 0.0]), np.zeros(3), np.array(offset), np.eye(3))
    assert (primitive.kind, primitive.length) == (kind, pytest.approx(length))
    assert primitive.time(0.45) == pytest.approx(length / 0.45)


def test_an_s_curve_is_two_tangent_arcs_that_join_the_two_points():
    for dist_x, dist_yz in ((2.0, 0.5), (1.0, 0.99), (3.0, 1.0)):
        theta = math.atan2(dist_yz, dist_x)
        radius = math.hypot(dist_x, dist_yz) / 4 / math.sin(theta)
        # each arc turns by 2 theta: along the axis it covers r sin(2 theta), across it r (1 - cos(2 theta))
        assert 2 * radius * math.sin(2 * theta) == pytest.approx(dist_x)
        assert 2 * radius * (1 - math.cos(2 * theta)) == pytest.approx(dist_yz)
        assert s_curve(dist_x, dist_yz) == pytest.approx(2 * radius * 2 * theta)
    primitive = choose(np.array([-1.0, 0.0, 0.0]), np.zeros(3), np.array([2.0, 0.3, 0.4]), np.eye(3))
    assert (primitive.kind, primitive.length) == ("S_CURVE", pytest.approx(s_curve(2.0, 0.5)))


def s_curve_as_printed(dist_x: float, dist_yz: float) -> float:
    """Return S_CURVE's length with the paper's minus under the root; defined for dist_x >= dist_yz."""
    theta = math.atan2(dist_yz, dist_x)
    return 4 * DELTA * math.sqrt(dist_x * dist_x - dist_yz * dist_yz) / math.sin(theta) * theta


@given(st.floats(0.1, 5.0))
def test_lengths_are_continuous_between_primitives(dist):
    assert s_curve(dist, 1e-7 * dist) == pytest.approx(straight(dist), rel=1e-9)
    assert s_curve_as_printed(dist, 1e-7 * dist) == pytest.approx(straight(dist), rel=1e-9)
    assert s_curve(dist, dist * (1 - 1e-9)) == pytest.approx(u_turn(dist, dist), rel=1e-6)
    assert turn(dist, 1e-9) == pytest.approx(straight(dist), rel=1e-6)


@given(st.floats(0.05, 3.0), st.floats(0.05, 3.0))
def test_no_primitive_is_shorter_than_the_distance(dist_x, dist_yz):
    distance = math.hypot(dist_x, dist_yz)
    length = u_turn(dist_x, dist_yz) if dist_x <= dist_yz else s_curve(dist_x, dist_yz)
    assert length >= distance * (1 - 1e-12)
    assert turn(dist_x, dist_yz) >= distance


def test_the_printed_s_curve_falls_below_the_distance_which_is_why_we_do_not_fly_it():
    assert s_curve_as_printed(1.0, 0.99) < 0.2 * math.hypot(1.0, 0.99)


@given(st.integers(0, 10**6))
@settings(max_examples=25, deadline=None)
def test_primitives_do_not_change_when_the_world_is_moved_and_turned(seed):
    rng = np.random.default_rng(seed)
    previous, current, following = rng.uniform(-2, 2, (3, 3))
    axes, turned = np.linalg.qr(rng.normal(size=(3, 3)))[0], np.linalg.qr(rng.normal(size=(3, 3)))[0]
    shift = rng.uniform(-5, 5, 3)
    first = choose(previous, current, following, axes)
    second = choose(turned @ previous + shift, turned @ current + shift, turned @ following + shift, turned @ axes)
    assert first.kind == second.kind
    assert first.length == pytest.approx(second.length)
