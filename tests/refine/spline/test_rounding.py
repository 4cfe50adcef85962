"""float32: joints stay closed to half an ulp, derivatives nearly so, laps close."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from refine import Spline, jumps, minimum_snap, on_grid, quantise
from refine.solvers.qp import Programme, rest_to_rest, solve
from refine.spline.basis import derivative_weights
from refine.spline.rounding import exact_end
from tests.helpers.few import few_of
from tests.helpers.missions.refinement_courses import HOOP6
from verify.data import BadInput, DoesNotFit, Trajectory


def rounding(flight: Trajectory, derivative: int) -> float:
    """Return what a derivative may jump by at a joint, if each coefficient is off by half an ulp and nothing else is.

    That is 2^-24 of the sum of all terms' sizes at the piece's end, and of the next piece's first one, for every joint, a lap's
    own one included; a hundredth more is for the sums themselves.
    """
    weights, powers = derivative_weights(derivative)[derivative:], np.arange(8 - derivative)
    sizes = weights * np.abs(flight.coefficients[:, :, derivative:])
    ends = (sizes * flight.durations[:, None, None] ** powers).sum(axis=2)
    after = np.arange(1, len(flight)) if flight.cycle is None else np.append(np.arange(1, len(flight)), flight.cycle)
    return 1.01 * 2.0**-24 * float((ends[: len(after)] + sizes[after, :, 0]).max(initial=0.0))


def lap_end(flight: Trajectory, axis: int) -> tuple[float, Fraction]:
    """Return where a lap from the second piece on begins, and how far from there it ends, exactly."""
    begin = float(flight.coefficients[1, axis, 0])
    return begin, abs(exact_end(flight.coefficients[-1, axis], float(flight.durations[-1])) - Fraction(begin))


@given(st.integers(2, 12), st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
@example(5, 24661)
def test_position_jumps_by_half_an_ulp_at_most(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.5, 2.5, size=count - 1))])
    path = minimum_snap(rng.normal(size=(count, 4)) * 3, times)
    flight = quantise(path)
    found = jumps(flight)
    assert flight.is_float32
    assert found.ulps <= 0.5
    for derivative, jump in ((1, found.velocity), (2, found.acceleration), (3, found.jerk)):
        assert jump <= rounding(flight, derivative)
    swing = np.abs(path.coefficients * path.durations[:, None, None] ** np.arange(8)).max()
    np.testing.assert_allclose(flight.evaluate(flight.knots[1:]), path.nodes[1:], atol=1e-6 * swing)


def test_a_lap_closes() -> None:
    durations = np.linalg.norm(np.diff(HOOP6, axis=0), axis=1)
    path = solve(Programme(durations, rest_to_rest(HOOP6, cycle=0), (), 0))
    points = np.concatenate([[[0.0, 0.0, 1.5]], HOOP6])
    durations = np.concatenate([[1.2], durations])
    path = solve(Programme(durations, rest_to_rest(points, cycle=1), (), 1))
    np.testing.assert_array_equal(path.states[-1], path.states[1])
    assert np.linalg.norm(path.states[1, 1]) > 0.1  # it flies through, it does not stop
    turning = np.zeros((len(points), 4, 1))
    turning[:, 0, 0] = 0.25
    turning[-1, 0, 0] = 0.25 + 2 * np.pi  # once around in a lap
    flight = quantise(Spline(durations, np.concatenate([path.states, turning], axis=2)), cycle=1)
    end = flight.evaluate(flight.duration - 1e-12)
    np.testing.assert_allclose(end[:3], points[1], atol=1e-6)
    gap = end[3] - flight.coefficients[1, 3, 0]
    assert abs(gap - 2 * np.pi) < 1e-6


def test_a_spline_without_a_heading_is_no_flight() -> None:
    path = minimum_snap(np.array([[0.0, 0, 1], [1, 0, 1], [1, 1, 1]]), np.array([0.0, 1.0, 2.0]))
    message = r"four axes: x, y, z and yaw; the spline's states have shape \(3, 4, 3\), wanted is \(3, 4, 4\)"
    with pytest.raises(BadInput, match=message):
        quantise(path)


def test_hover_pieces_stay_exactly_put() -> None:
    states = np.zeros((2, 4, 4))
    states[:, 0] = [1.3, -0.2, 0.8, 0.7]
    flight = quantise(Spline(np.array([2.5]), states))
    assert not flight.coefficients[:, :, 1:].any()


def test_the_compressed_grid_moves_the_path_by_half_a_millimetre() -> None:
    times = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(HOOP6, axis=0), axis=1))])
    path = minimum_snap(np.column_stack([HOOP6, np.linspace(0, 1, len(HOOP6))]), times)
    flight = on_grid(path)
    np.testing.assert_array_equal(np.rint(flight.durations * 1e3) / 1e3, flight.durations)
    shares = np.linspace(0, 1, 40)
    there = np.stack([flight.evaluate(flight.knots[:-1] + 0.999999 * s * flight.durations) for s in shares], axis=1)
    assert np.abs(there[..., :3] - path.sample(0.999999 * shares)[..., :3]).max() <= 0.6e-3
    found = jumps(flight)
    assert found.position < 1e-9
    assert 1e-4 < found.velocity < 1e-2  # the reason why this very flight must be certified


def test_what_the_compressed_format_cannot_hold_is_refused() -> None:
    far = minimum_snap([[0.0, 0, 1, 0], [40.0, 0, 1, 0]], [0.0, 20.0])
    with pytest.raises(DoesNotFit, match="axis 0"):
        on_grid(far)
    with pytest.raises(DoesNotFit, match=r"65\.535"):
        on_grid(minimum_snap([[0.0, 0, 1, 0], [1.0, 0, 1, 0]], [0.0, 70.0]))


@few_of(2, "seed", range(6))
def test_laps_of_long_pieces_close_too(seed: int) -> None:
    """Ulps of the last coefficients count for micrometres at the end of a piece of 20 s, half an ulp of a small coordinate does not."""
    rng = np.random.default_rng(seed)
    points = np.concatenate([rng.normal(size=(4, 3)), np.zeros((1, 3))])
    points[1, 0] = 3e-3
    points[-1] = points[1]
    durations = rng.uniform(15.0, 30.0, size=4)
    path = solve(Programme(durations, rest_to_rest(points, cycle=1), (), 1))
    flight = quantise(Spline(durations, np.concatenate([path.states, np.zeros((5, 4, 1))], axis=2)), cycle=1)
    assert flight.is_float32
    for axis in range(4):
        begin, gap = lap_end(flight, axis)
        assert gap <= max(float(np.spacing(np.float32(abs(begin)))) / 2, 1e-9)
    np.testing.assert_allclose(flight.evaluate(flight.knots[:-1] + 5.0)[:, :3], _at(path, 5.0), atol=2e-4)


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.5, 1.0, 2.0, 4.0, 7.999109268188477, 8.0, 16.0]), st.booleans())
@settings(max_examples=12, deadline=None)
@example(32, 8.0, False)
def test_a_lap_whose_last_piece_lasts_a_power_of_two_closes_as_well_as_float32_can(seed: int, last: float, zero: bool) -> None:
    """The ends that float32 coefficients can reach then lie on a grid that may miss the joint by more than half an ulp of it."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.5, 1.5, size=(4, 3))
    points[1] *= not zero
    points[-1] = points[1]
    durations = np.array([*rng.uniform(0.7, 1.4, size=2), 1.0]) * last
    path = solve(Programme(durations, rest_to_rest(points, cycle=1), (), 1))
    flight = quantise(Spline(durations, np.concatenate([path.states, np.zeros((4, 4, 1))], axis=2)), cycle=1)
    assert flight.is_float32
    for axis in range(4):
        _, gap = lap_end(flight, axis)
        largest = np.abs(flight.coefficients[-1, axis] * last ** np.arange(8)).max()
        assert gap <= max(float(np.spacing(np.float32(largest))), 1e-9)
    for derivative, jump in enumerate(dataclasses.astuple(jumps(flight))[2:], 1):
        assert jump <= 32 * rounding(flight, derivative)  # a few ulps are what closing moves a coefficient by


def _at(path: Spline, local: float) -> np.ndarray:
    return np.array([path.sample(np.array([local / duration]))[piece, 0] for piece, duration in enumerate(path.durations)])
