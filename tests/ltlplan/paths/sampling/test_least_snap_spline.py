import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from tests.helpers.motion.nominal_trajectories import nominal_trajectory
from verify.data import BadInput

FACTS_COURSE = np.array([(1, 0, 0.8), (2, 1, 1), (0.5, 2, 1.3), (-1, 1, 1.1), (-0.6, -0.8, 0.9), (1, 0, 0.8)], dtype=np.float64)


def random_spline(seed: int, points: int, cycle: int | None = None):
    rng = np.random.default_rng(seed)
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.3, 2.0, points - 1))])
    places = rng.uniform(-2, 2, (points, 3))
    if cycle is not None:
        places[-1] = places[cycle]
    return LeastSnapSpline(times, cycle), places


def ends(coefficients, durations):
    """State (position to sixth derivative) at both ends of every piece: (pieces, 2, 7, axes)."""
    result = np.zeros((len(durations), 2, 7, coefficients.shape[1]))
    for piece, (c, length) in enumerate(zip(coefficients, durations, strict=True)):
        for order in range(7):
            derived = np.array([np.polynomial.polynomial.polyder(axis, order) for axis in c])
            result[piece, 0, order] = derived[:, 0]
            result[piece, 1, order] = [np.polynomial.polynomial.polyval(length, axis) for axis in derived]
    return result


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 12))
def test_a_spline_meets_its_points_is_smooth_and_starts_and_ends_at_rest(seed, points):
    spline, places = random_spline(seed, points)
    states = ends(spline.through(places), spline.durations)
    assert np.allclose(states[:, 0, 0], places[:-1], atol=1e-9)
    assert np.allclose(states[:, 1, 0], places[1:], atol=1e-7)
    for order in range(1, 7):  # six times at inner points: the optimum is smoother than what is asked
        scale = 1 + np.abs(states[:, :, order]).max()
        assert np.allclose(states[:-1, 1, order], states[1:, 0, order], atol=1e-6 * scale)
    for order in (1, 2, 3):
        scale = 1 + np.abs(states[:, :, order]).max()
        assert np.allclose(states[0, 0, order], 0, atol=1e-7 * scale)
        assert np.allclose(states[-1, 1, order], 0, atol=1e-7 * scale)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.integers(3, 9), st.data())
def test_a_lasso_closes_up_to_the_third_derivative(seed, points, data):
    cycle = data.draw(st.integers(0, points - 2))
    spline, places = random_spline(seed, points, cycle)
    states = ends(spline.through(places), spline.durations)
    for order in range(4):
        scale = 1 + np.abs(states[:, :, order]).max()
        assert np.allclose(states[-1, 1, order], states[cycle, 0, order], atol=1e-6 * scale)


def test_the_snap_of_the_known_course_is_the_known_optimum():
    lengths = np.linalg.norm(np.diff(FACTS_COURSE, axis=0), axis=1)
    spline = LeastSnapSpline(np.concatenate([[0.0], np.cumsum(lengths)]))
    coefficients = spline.through(FACTS_COURSE)
    total = 0.0
    for c, length in zip(coefficients, spline.durations, strict=True):
        for axis in c:
            snap = np.polynomial.polynomial.polyder(axis, 4)
            square = np.polynomial.polynomial.polyint(np.polynomial.polynomial.polymul(snap, snap))
            total += np.polynomial.polynomial.polyval(length, square)
    assert total == pytest.approx(775.1615008, rel=1e-8)  # agreed on by five independent solvers


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 10), st.integers(0, 4))
def test_the_sampling_matrix_is_the_trajectory_evaluated(seed, points, derivative):
    spline, places = random_spline(seed, points)
    trajectory = nominal_trajectory(places, spline.times)
    at = np.linspace(0, spline.times[-1], 37)
    expected = trajectory.evaluate(at, derivative)[:, :3]
    assert np.allclose(spline.sampling(at, derivative) @ places, expected, atol=1e-6 * (1 + np.abs(expected).max()))


def test_more_points_of_a_spline_at_the_same_times_give_the_same_spline():
    spline, places = random_spline(3, 7)
    times = np.sort(np.concatenate([spline.times, [0.4, 1.1, 2.7]]))
    finer = LeastSnapSpline(times)
    at = np.linspace(0, spline.times[-1], 200)
    assert np.allclose(finer.sampling(at) @ (spline.sampling(times) @ places), spline.sampling(at) @ places, atol=1e-8)


@pytest.mark.parametrize("times", [[0.0], [0.0, 0.0], [0.0, 1.0, 0.5], [0.0, float("nan")], [[0.0, 1.0]]])
def test_times_that_do_not_increase_are_refused(times):
    with pytest.raises(BadInput, match="increase"):
        LeastSnapSpline(times)
