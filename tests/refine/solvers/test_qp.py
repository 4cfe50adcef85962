"""Minimum snap with inequalities: the two engines agree, and a linear programme says whether there is an answer."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from refine.solvers.qp import Programme, Row, residual, rest_to_rest, solve
from refine.spline.basis import bernstein_matrix
from verify.data import Infeasible

PIECES = 3


def random_programme(seed: int, tight: float) -> Programme:
    """A flight through four points with half-spaces on its Bernstein points; the smaller `tight`, the rarer an answer."""
    rng = np.random.default_rng(seed)
    fixed = rest_to_rest(rng.uniform(-1.0, 1.0, size=(PIECES + 1, 3)))
    fixed[1:-1, 0] = np.where(rng.random() < 0.5, np.nan, fixed[1:-1, 0])
    rows = []
    for _ in range(int(rng.integers(1, 5))):
        piece, normal = int(rng.integers(PIECES)), rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        low = float(rng.uniform(-1.5, -1.0) + tight)
        high = low + float(rng.uniform(0.3, 2.0)) if rng.random() < 0.5 else np.inf
        rows += [Row(piece, weights, normal, low, high) for weights in bernstein_matrix()]
    return Programme(rng.uniform(0.5, 2.0, size=PIECES), fixed, tuple(rows))


def has_answer(programme: Programme, slack: float) -> bool:
    """Ask HiGHS whether states within the rows, widened by `slack`, exist."""
    free = np.isnan(programme.fixed[:, :, 0]).ravel()
    nodes, order, axes = programme.fixed.shape
    base = np.nan_to_num(programme.fixed)

    def values(states: np.ndarray) -> np.ndarray:
        from refine.spline.spline import Spline

        unit = Spline(programme.durations, states).coefficients * programme.durations[:, None, None] ** np.arange(8)
        return np.array([row.normal @ (unit[row.piece] @ row.weights) for row in programme.rows])

    at_zero, columns = values(base), []
    for index in np.flatnonzero(free):
        for axis in range(axes):
            states = base.copy()
            states.reshape(nodes * order, axes)[index, axis] = 1.0
            columns.append(values(states) - at_zero)
    matrix = np.array(columns).T
    low = np.array([row.low for row in programme.rows]) - slack - at_zero
    high = np.array([row.high for row in programme.rows]) + slack - at_zero
    below, above = np.isfinite(low), np.isfinite(high)
    answer = linprog(
        np.zeros(matrix.shape[1]),
        A_ub=np.concatenate([-matrix[below], matrix[above]]),
        b_ub=np.concatenate([-low[below], high[above]]),
        bounds=(None, None),
    )
    return answer.status == 0


@given(st.integers(0, 10**6), st.sampled_from([0.0, 0.5, 1.0, 1.5]))
@settings(max_examples=60, deadline=None)
def test_an_answer_is_found_exactly_where_there_is_one(seed: int, tight: float) -> None:
    programme = random_programme(seed, tight)
    try:
        path = solve(programme)
    except Infeasible:
        assert not has_answer(programme, -1e-6)
        return
    assert residual(programme, path).max() <= 1e-6
    assert has_answer(programme, 1e-5)


@given(st.integers(0, 10**6), st.sampled_from([0.0, 0.5]))
@settings(max_examples=25, deadline=None)
def test_both_engines_find_the_same_path(seed: int, tight: float) -> None:
    programme = random_programme(seed, tight)
    try:
        approached = solve(programme, engine="osqp")
    except Infeasible:
        return  # or out of iterations: whether there is an answer, the test above asks
    exact = solve(programme)
    assert exact.snap_cost() == pytest.approx(approached.snap_cost(), rel=1e-3)
    np.testing.assert_allclose(exact.nodes, approached.nodes, atol=1e-3)


@pytest.mark.parametrize("slow", [30.0, 1500.0])
def test_slow_flights_keep_the_same_walls_as_fast_ones(slow: float) -> None:
    """Stretching time scales the cost by its seventh power and leaves the path as it is, however large the numbers become."""
    fixed = rest_to_rest(np.array([[-1.5, 0.3, 1.0], [0.0, 0.6, 1.0], [1.5, 0.3, 1.0]]))
    wall = tuple(Row(1, weights, np.array([0.0, -1.0, 0.0]), -0.61) for weights in bernstein_matrix())
    fast = Programme(np.array([1.0, 1.2]), fixed, wall)
    late = Programme(slow * fast.durations, fixed, wall)
    quick, calm = solve(fast), solve(late)
    assert residual(late, calm).max() <= 1e-9
    np.testing.assert_allclose(calm.sample(np.linspace(0, 1, 9)), quick.sample(np.linspace(0, 1, 9)), atol=1e-7)
    assert calm.snap_cost() * slow**7 == pytest.approx(quick.snap_cost(), rel=1e-7)
    assert quick.snap_cost() > 1.001 * solve(Programme(fast.durations, fixed)).snap_cost()


def uneven_programme(seed: int, spread: float) -> Programme:
    """A flight in boxes around straight legs, which resting at every point keeps; the longest leg lasts `spread` times the shortest."""
    rng = np.random.default_rng(seed)
    pieces = int(rng.integers(3, 9))
    points = np.cumsum(rng.normal(scale=0.3, size=(pieces + 1, 3)), axis=0)
    durations = 0.3 * spread ** rng.uniform(size=pieces)
    durations[rng.permutation(pieces)[:2]] = 0.3, 0.3 * spread
    rows = [
        Row(piece, weights, axis, float(min(axis @ points[piece], axis @ points[piece + 1]) - 0.05))
        for piece in range(pieces)
        for axis in (*np.eye(3), *-np.eye(3))
        for weights in bernstein_matrix()
    ]
    return Programme(durations, rest_to_rest(points), tuple(rows))


@given(st.integers(0, 10**6), st.sampled_from([1.0, 30.0, 1000.0]), st.sampled_from([1e-2, 1.0, 1e2]))
@settings(max_examples=10, deadline=None)
def test_boxes_are_kept_however_uneven_durations_are(seed: int, spread: float, slow: float) -> None:
    """What a straight flight keeps can be kept, in any unit of time, by one path."""
    programme = uneven_programme(seed, spread)
    path = solve(programme)
    assert residual(programme, path).max() <= 1e-8
    other = Programme(slow * programme.durations, programme.fixed, programme.rows)
    late = solve(other)
    assert residual(other, late).max() <= 1e-8
    assert late.snap_cost() * slow**7 == pytest.approx(path.snap_cost(), rel=1e-3)


def test_rows_on_fixed_states_alone_are_kept_or_refused() -> None:
    fixed = rest_to_rest(np.array([[0.0, 0, 1], [1.0, 0, 1], [2.0, 0, 1], [3.0, 0.5, 1]]))
    fixed[1, 1:] = 0.0
    across = np.array([0.0, 1.0, 0.0])
    kept = Programme(np.ones(3), fixed, tuple(Row(0, weights, across, -0.1) for weights in bernstein_matrix()))
    assert residual(kept, solve(kept)).max() == 0.0
    broken = Programme(np.ones(3), fixed, tuple(Row(0, weights, across, 0.1) for weights in bernstein_matrix()))
    for engine in ("nnls", "osqp"):
        with pytest.raises(Infeasible, match="piece 0"):
            solve(broken, engine=engine)
