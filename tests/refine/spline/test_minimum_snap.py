"""Minimum snap with fixed times: against a closed form, against the other solvers, and the laws that it obeys."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refine import Limits, Spline, minimum_snap
from refine.obstacles.keep_out_bodies import Ball
from refine.solvers.nlp import Timing, optimise
from refine.solvers.qp import Programme, Row, residual, rest_to_rest, solve
from refine.spline.basis import bernstein_matrix
from tests.helpers.missions.refinement_courses import HOOP6, HOOP6_SNAP
from verify.data import BadInput, Infeasible

LENGTHS = np.linalg.norm(np.diff(HOOP6, axis=0), axis=1)
TIMES = np.concatenate([[0.0], np.cumsum(LENGTHS)])


@st.composite
def courses(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray]:
    count = draw(st.integers(2, 9))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return rng.normal(size=(count, 3)), np.concatenate([[0.0], np.cumsum(rng.uniform(0.3, 3.0, size=count - 1))])


def test_one_leg_is_the_known_step() -> None:
    """From rest to rest over one leg the least-snap path is 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7; its cost is 100800 L^2 / T^7."""
    path = minimum_snap([[0.0], [2.0]], [0.0, 1.5])
    unit = path.coefficients[0, 0] * 1.5 ** np.arange(8)
    np.testing.assert_allclose(unit, 2.0 * np.array([0, 0, 0, 0, 35, -84, 70, -20]), atol=1e-12)
    assert path.snap_cost() == pytest.approx(100800 * 4 / 1.5**7, rel=1e-12)


def test_hoop6_costs_what_five_solvers_say() -> None:
    assert minimum_snap(HOOP6, TIMES).snap_cost() == pytest.approx(HOOP6_SNAP, rel=1e-9)


def test_three_solvers_agree() -> None:
    banded = minimum_snap(HOOP6, TIMES)
    loose = Row(2, bernstein_matrix()[3], np.array([0.0, 0.0, 1.0]), -100.0)
    programme = solve(Programme(LENGTHS, rest_to_rest(HOOP6), (loose,)))
    np.testing.assert_allclose(programme.states, banded.states, atol=1e-9)
    guess = minimum_snap(HOOP6, np.linspace(0.0, TIMES[-1], len(TIMES)))
    free = optimise(Timing(guess, rest_to_rest(HOOP6), Limits(speed=50.0), "snap"))
    assert free.duration == pytest.approx(TIMES[-1], abs=1e-4)
    assert free.snap_cost() <= banded.snap_cost() * (1 + 1e-6)
    again = minimum_snap(HOOP6, free.knots)
    np.testing.assert_allclose(again.states, free.states, atol=2e-3)
    assert again.snap_cost() == pytest.approx(free.snap_cost(), rel=1e-5)


def test_states_in_motion_may_be_given() -> None:
    """The least snap through points costs as much where the optimum's own velocities are given: there they are kept, to the bit."""
    guess = minimum_snap(HOOP6, np.linspace(0.0, TIMES[-1], len(TIMES)))
    fixed = rest_to_rest(HOOP6)
    free = optimise(Timing(guess, fixed, Limits(speed=50.0), "snap"))
    given = fixed.copy()
    given[2:4, 1] = free.states[2:4, 1]
    kept = optimise(Timing(guess, given, Limits(speed=50.0), "snap"))
    np.testing.assert_array_equal(kept.states[2:4, 1], given[2:4, 1])
    assert kept.snap_cost() == pytest.approx(free.snap_cost(), rel=1e-6)


def test_a_lap_closes_wherever_its_repeated_point_is_given() -> None:
    """A rule of the lap's last point is one of the point that it repeats: a room, a fixed point and velocity alike."""
    guess = minimum_snap(HOOP6, TIMES)
    fixed = rest_to_rest(HOOP6, 1)
    fixed[[1, -1], 0] = np.nan
    guess.states[-1] = guess.states[1]
    room = Ball("room", HOOP6[1], np.eye(3) / 0.2)

    def lap(fixed: np.ndarray, *nodes: int) -> Spline:
        within = [(node, room) for node in nodes]
        path = optimise(Timing(guess, fixed, Limits(speed=2.0), "blend", 300.0, within, cycle=1))
        np.testing.assert_array_equal(path.states[-1], path.states[1])
        return path

    first, last, both = lap(fixed, 1), lap(fixed, 5), lap(fixed, 1, 5)
    assert np.linalg.norm(first.states[1, 0] - HOOP6[1]) == pytest.approx(0.2, abs=1e-4)
    for other in (last, both):
        np.testing.assert_allclose(other.states[:, :2], first.states[:, :2], atol=1e-4)
        np.testing.assert_allclose(other.durations, first.durations, atol=1e-5)
    given = fixed.copy()
    given[-1, :2] = first.states[1, :2]
    np.testing.assert_array_equal(lap(given).states[1, :2], given[-1, :2])
    assert lap(given).duration == pytest.approx(first.duration, rel=1e-3)


@given(courses())
@settings(max_examples=25, deadline=None)
def test_joins_up_to_the_sixth_derivative(course: tuple[np.ndarray, np.ndarray]) -> None:
    """Where all is free between the ends, the optimum of degree 7 is as smooth as a spline can be."""
    points, times = course
    path = minimum_snap(points, times)
    np.testing.assert_allclose(path.sample(np.array([0.0]))[:, 0], points[:-1], atol=1e-12)
    scale = np.abs(path.sample(np.linspace(0, 1, 9), 6)).max() + 1.0
    for derivative in range(7):
        ends = path.sample(np.array([0.0, 1.0]), derivative)
        size = scale if derivative > 3 else 1 + np.abs(ends).max()
        np.testing.assert_allclose(ends[1:, 0], ends[:-1, 1], atol=1e-7 * size)


@given(courses(), st.floats(0.2, 5.0), st.integers(0, 1000))
@settings(max_examples=25, deadline=None)
def test_turning_and_slowing_commute_with_smoothing(course: tuple[np.ndarray, np.ndarray], factor: float, seed: int) -> None:
    points, times = course
    rotation, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    path = minimum_snap(points, times)
    turned = minimum_snap(points @ rotation.T + 3.0, times * factor)
    expected = path.stretched(factor)
    scale = factor ** -np.arange(4.0)
    np.testing.assert_allclose(
        turned.states[:, 1:], (expected.states @ rotation.T)[:, 1:], atol=1e-7 * scale[3] + 1e-7 * np.abs(expected.states).max()
    )
    assert turned.snap_cost() == pytest.approx(path.snap_cost() / factor**7, rel=1e-6)


def test_given_derivatives_are_met_and_free_ones_do_no_better() -> None:
    velocity = np.full(HOOP6.shape, np.nan)
    velocity[[0, -1]] = 0.0
    free = minimum_snap(HOOP6, TIMES, velocity=velocity)
    np.testing.assert_allclose(free.states, minimum_snap(HOOP6, TIMES).states, atol=1e-10)
    velocity[2] = [0.5, -0.25, 0.0]
    bound = minimum_snap(HOOP6, TIMES, velocity=velocity)
    np.testing.assert_allclose(bound.states[2, 1], velocity[2])
    assert bound.snap_cost() > free.snap_cost()
    start = np.full(HOOP6.shape, np.nan)
    easier = minimum_snap(HOOP6, TIMES, velocity=start, acceleration=start, jerk=start)
    assert easier.snap_cost() < free.snap_cost()


def test_nothing_nearby_is_smoother() -> None:
    path = minimum_snap(HOOP6, TIMES)
    rng = np.random.default_rng(0)
    for _ in range(20):
        states = path.states.copy()
        states[1:-1, 1:] += 1e-3 * rng.normal(size=states[1:-1, 1:].shape)
        assert Spline(path.durations, states).snap_cost() > path.snap_cost()


def test_a_wall_is_kept_for_all_times() -> None:
    rows = tuple(Row(k, b, np.array([0.0, 1.0, 0.0]), -np.inf, 2.005) for k in range(5) for b in bernstein_matrix())
    problem = Programme(LENGTHS, rest_to_rest(HOOP6), rows)
    path = solve(problem)
    assert minimum_snap(HOOP6, TIMES).sample(np.linspace(0, 1, 99))[..., 1].max() > 2.05
    assert path.sample(np.linspace(0, 1, 999))[..., 1].max() <= 2.005 + 1e-6
    assert residual(problem, path).max() <= 1e-6
    assert path.snap_cost() >= HOOP6_SNAP


def test_walls_that_contradict_each_other_are_refused() -> None:
    up = tuple(Row(1, b, np.array([0.0, 0.0, 1.0]), 1.2) for b in bernstein_matrix())
    with pytest.raises(Infeasible, match="corridor"):
        solve(Programme(LENGTHS, rest_to_rest(HOOP6), up))  # the leg's own ends lie below


@pytest.mark.parametrize(
    ("points", "times", "words"),
    [
        ([[0, 0, 0]], [0.0], "points >= 2"),
        ([[0, 0, 0], [1, 0, 0]], [0.0, 0.0], "lasts 0 s"),
        ([[0, 0, 0], [1, 0, 0]], [0.0, -1.0], "lasts -1 s"),
        ([[0, 0, 0], [1, 0, 0]], [0.0, 1e9], "ratio"),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [0.0, 1e-3, 100.0], "ratio"),
        ([[0, 0, 0], [1, np.nan, 0]], [0.0, 1.0], r"waypoints\[1, 1\] is nan"),
        ([[0, 0, 0], [1, np.inf, 0]], [0.0, 1.0], r"waypoints\[1, 1\] is inf"),
        ([[0, 0, 0], [1, 0, 0]], [0.0, np.nan], "finite"),
        ([[0, 0, 0], [1, 0, 0]], [0.0, 1.0, 2.0], "shapes"),
    ],
)
def test_bad_input_is_named(points: list, times: list, words: str) -> None:
    with pytest.raises(BadInput, match=words):
        minimum_snap(points, times)


def test_bad_derivatives_are_named() -> None:
    with pytest.raises(BadInput, match="velocity has shape"):
        minimum_snap(HOOP6, TIMES, velocity=np.zeros((2, 3)))
    with pytest.raises(BadInput, match="jerk must be finite"):
        minimum_snap(HOOP6, TIMES, jerk=np.full(HOOP6.shape, np.inf))
