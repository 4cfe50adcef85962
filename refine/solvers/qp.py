"""Minimum snap with inequalities: a quadratic programme over node states (OSQP's only importer).

The unknowns are the states at the nodes, less what is fixed or shared. The snap form is factorised once per axis and
the unknowns are taken in its own metric (z = L'(x - x0)), in which the objective is |z|^2 / 2: what is left is to
project the unconstrained optimum onto the rows that bind, whatever the durations' sizes.

Such a least-distance programme is the dual of non-negative least squares (Lawson and Hanson, Solving Least Squares Problems,
chapter 23). That active-set method ends after finitely many steps, with the answer or with the knowledge that there is none;
OSQP, which only approaches either, takes over where it runs out of steps.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import osqp
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls

from refine.solvers.timeout import SolverTimeout
from refine.spline.basis import HERMITE, ORDER, SNAP
from refine.spline.spline import Spline
from verify.data import Infeasible, InternalError

Floats = NDArray[np.float64]

Engine = Literal["nnls", "osqp"]

ITERATIONS = 20_000
SECONDS = 120.0
"""The clock only ends a solve with an error."""
TOLERANCE = 1e-4
"""m by which a recomputed row may be off; far below the clearance that rows are given on top of the margin."""
_NO_POINT = 1e-9
"""Residual of the dual below which there is no point that keeps all rows: its inverse would be the point's distance, in units of
the distance to the row that is broken most."""
_KEPT = 1e-9
"""m by which rows may be off without a further projection."""
_PROJECTIONS = 4
"""The first finds the answer; where legs last very different times it leaves rounding errors, which others take back."""
_ROUNDING = 1e-12
"""Parts of a row below this, in unit time and of the order of one, are rounding errors: such a row moves with nothing."""


@dataclass(frozen=True, eq=False)
class Row:
    """A linear inequality on one piece: sum over axes of normal . (weights @ unit coefficients) within [low, high].

    Attributes:
        piece: Index of the piece.
        weights: Combination of the piece's ascending unit-time coefficients. Shape (8,).
        normal: Shape (axes,).
        low: In the units of the product; -inf for none.
        high: inf for none.
    """

    piece: int
    weights: Floats
    normal: Floats
    low: float
    high: float = np.inf


@dataclass(frozen=True, eq=False)
class Programme:
    """A minimum-snap problem with inequalities; printable and checkable without an engine.

    Attributes:
        durations: In s. Shape (pieces,).
        fixed: States that are given, NaN where free. Shape (pieces + 1, 4, axes); an entry is free on all axes or on none.
        rows: The inequalities.
        cycle: Node whose state the last node repeats, or None.
    """

    durations: Floats
    fixed: Floats
    rows: tuple[Row, ...] = field(default=())
    cycle: int | None = None


def rest_to_rest(points: Floats, cycle: int | None = None) -> Floats:
    """Return fixed states for a flight through points that starts at rest and ends at rest (or joins its cycle)."""
    fixed = np.full((len(points), ORDER, points.shape[1]), np.nan)
    fixed[:, 0] = points
    fixed[0, 1:] = 0.0
    if cycle is None:
        fixed[-1, 1:] = 0.0
    return fixed


def solve(programme: Programme, engine: Engine = "nnls") -> Spline:
    """Return the spline of least snap that keeps every row.

    Args:
        programme: The problem.
        engine: "nnls": exact but for rounding, with OSQP behind it; "osqp": only that.

    Raises:
        Infeasible: The rows contradict each other or the engine's budget of iterations ran out; says by how much the
            worst row is off.
        SolverTimeout: The engine's seconds ran out before its iterations.
        InternalError: The snap form is not positive definite.
    """
    form, basis, offset = _reduced(programme)
    axes = programme.fixed.shape[2]
    try:
        factor = cholesky(form, lower=True) if len(form) else form
    except np.linalg.LinAlgError as error:
        raise InternalError(f"The snap form is not positive definite: {error}.") from None
    full = _snap_form(programme.durations)
    pull = -basis.T @ (full @ offset)
    free = solve_triangular(factor.T, solve_triangular(factor, pull, lower=True)) if len(form) else pull
    if programme.rows and len(form):
        white = solve_triangular(factor, basis.T, lower=True)  # rows act on states; white maps them to z
        on_states = _on_states(programme)
        matrix = _whitened(programme, on_states, white)
        for _ in range(_PROJECTIONS):
            reached = _values(programme, on_states, basis @ free + offset)
            low = np.array([row.low for row in programme.rows]) - reached
            high = np.array([row.high for row in programme.rows]) - reached
            if not (np.any(low > _KEPT) or np.any(high < -_KEPT)):
                break
            z = _project(matrix, low, high, engine).reshape(axes, -1).T
            free = free + solve_triangular(factor.T, z)
    states = (basis @ free + offset).reshape(programme.fixed.shape)
    answer = Spline(programme.durations, states)
    _check(programme, answer)
    return answer


def residual(programme: Programme, answer: Spline) -> Floats:
    """Return by how much each row is broken, recomputed from problem and answer; 0 where it holds. Shape (rows,)."""
    if not programme.rows:
        return np.zeros(0)
    unit = answer.coefficients * (answer.durations[:, None, None] ** np.arange(8))
    values = np.array([row.normal @ (unit[row.piece] @ row.weights) for row in programme.rows])
    low = np.array([row.low for row in programme.rows])
    high = np.array([row.high for row in programme.rows])
    return np.maximum(0.0, np.maximum(low - values, values - high))


def _check(programme: Programme, answer: Spline) -> None:
    broken = residual(programme, answer)
    if len(broken) and not broken.max() <= TOLERANCE:
        worst = int(np.argmax(broken))
        raise Infeasible(
            f"The corridor of piece {programme.rows[worst].piece} cannot be kept: off by {broken[worst]:.2g} m "
            f"with {len(broken)} rows after at most {ITERATIONS} iterations."
        )


def _snap_form(durations: Floats) -> Floats:
    """Return the snap form of one axis over all nodes' states. Shape (4 nodes, 4 nodes)."""
    size = ORDER * (len(durations) + 1)
    form = np.zeros((size, size))
    for piece, duration in enumerate(durations):
        scale = np.tile(duration ** np.arange(ORDER), 2)
        at = slice(ORDER * piece, ORDER * (piece + 2))
        form[at, at] += SNAP * np.outer(scale, scale) / duration**7
    return form


def _reduced(programme: Programme) -> tuple[Floats, Floats, Floats]:
    """Return the form in the free unknowns, and states = basis @ unknowns + offset (per axis)."""
    nodes, order, axes = programme.fixed.shape
    known = ~np.isnan(programme.fixed[:, :, 0].ravel())
    offset = np.where(np.isnan(programme.fixed), 0.0, programme.fixed).reshape(nodes * order, axes)
    column = np.full(nodes * order, -1)
    unknowns = 0
    for index in range(nodes * order):
        shared = programme.cycle is not None and index >= (nodes - 1) * order
        if shared:
            source = programme.cycle * order + index - (nodes - 1) * order
            column[index] = column[source]
            offset[index] = offset[source]
        elif not known[index]:
            column[index] = unknowns
            unknowns += 1
    basis = np.zeros((nodes * order, unknowns))
    free = column >= 0
    basis[np.flatnonzero(free), column[free]] = 1.0
    form = basis.T @ _snap_form(programme.durations) @ basis
    return form, basis, offset


def _on_states(programme: Programme) -> list[Floats]:
    """Return each row's weights of the states at its piece's ends. Shapes (8,)."""
    found = []
    for row in programme.rows:
        unit = row.weights @ HERMITE
        scale = np.tile(programme.durations[row.piece] ** np.arange(ORDER), 2)
        found.append(np.where(np.abs(unit) > _ROUNDING, unit, 0.0) * scale)
    return found


def _whitened(programme: Programme, on_states: list[Floats], white: Floats) -> Floats:
    """Return rows in the metric of the snap form. Shape (rows, unknowns)."""
    found = []
    for row, weights in zip(programme.rows, on_states, strict=True):
        at = slice(ORDER * row.piece, ORDER * (row.piece + 2))
        found.append(np.outer(row.normal, white[:, at] @ weights).ravel())
    return np.array(found)


def _values(programme: Programme, on_states: list[Floats], states: Floats) -> Floats:
    """Return what rows come to at these states of all nodes. Shape (rows,)."""
    return np.array(
        [
            row.normal @ (weights @ states[ORDER * row.piece : ORDER * (row.piece + 2)])
            for row, weights in zip(programme.rows, on_states, strict=True)
        ]
    )


def _project(matrix: Floats, low: Floats, high: Floats, engine: Engine) -> Floats:
    """Return the point nearest to the origin with low <= matrix @ z <= high."""
    size = np.linalg.norm(matrix, axis=1)
    moving = size > 0.0
    matrix, low, high = matrix[moving] / size[moving, None], low[moving] / size[moving], high[moving] / size[moving]
    if not len(matrix):
        return np.zeros(matrix.shape[1])  # nothing can move: the recomputed rows tell whether they hold
    if engine == "osqp":
        return _by_osqp(matrix, low, high)
    below, above = np.isfinite(low), np.isfinite(high)
    try:
        return _by_nnls(np.concatenate([matrix[below], -matrix[above]]), np.concatenate([low[below], -high[above]]))
    except RuntimeError:  # out of steps
        return _by_osqp(matrix, low, high)


def _by_nnls(matrix: Floats, low: Floats) -> Floats:
    """Return the point nearest to the origin with matrix @ z >= low (Lawson and Hanson, 23.27)."""
    scale = float(low.max())
    if scale <= 0.0:
        return np.zeros(matrix.shape[1])
    system = np.concatenate([matrix.T, low[None] / scale])
    system /= np.linalg.norm(system, axis=0)
    target = np.zeros(len(system))
    target[-1] = 1.0
    weights, distance = nnls(system, target)
    left = system @ weights - target
    if distance < _NO_POINT or left[-1] >= 0.0:
        raise Infeasible(f"The corridors contradict each other ({len(low)} rows).")
    return -scale * left[:-1] / left[-1]


def _by_osqp(matrix: Floats, low: Floats, high: Floats) -> Floats:
    solver = osqp.OSQP()
    unknowns = matrix.shape[1]
    solver.setup(
        sparse.identity(unknowns, format="csc"),
        np.zeros(unknowns),
        sparse.csc_matrix(matrix),
        low,
        high,
        verbose=False,
        eps_abs=1e-7,
        eps_rel=1e-7,
        max_iter=ITERATIONS,
        polishing=True,
        adaptive_rho_interval=50,  # fixed, so that the clock does not shape the answer
        check_termination=25,
        time_limit=SECONDS,
    )
    answer = solver.solve(raise_error=False)
    if answer.info.status == "run time limit reached":
        raise SolverTimeout("OSQP", SECONDS)
    if answer.x is None or not np.all(np.isfinite(answer.x)):
        raise Infeasible(f"The corridors contradict each other ({len(low)} rows).")
    return answer.x
