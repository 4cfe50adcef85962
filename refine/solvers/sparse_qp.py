"""Sparse quadratic programmes with many rows, by an interior-point method (Clarabel's only importer)."""

from __future__ import annotations

from typing import Any

import clarabel as _clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from refine.solvers.timeout import SolverTimeout

engine: Any = _clarabel  # of any type: it has none
Floats = NDArray[np.float64]

ITERATIONS = 100
SECONDS = 120.0
"""The clock only ends a solve with an error."""


def least(squares: sparse.csc_matrix, linear: Floats, rows: sparse.csc_matrix, low: Floats, high: Floats) -> Floats | None:
    """Return where 1/2 x'Px + q'x is least with low <= A x <= high; None where there is no such point, or none was found.

    Args:
        squares: P, positive semidefinite. Shape (unknowns, unknowns).
        linear: q. Shape (unknowns,).
        rows: A. Shape (rows, unknowns).
        low: Shape (rows,).
        high: Infinite where a row has no upper bound. Shape (rows,).

    Raises:
        SolverTimeout: The engine's seconds ran out before its iterations.
    """
    bounded = np.isfinite(high)
    matrix = sparse.vstack([-rows, rows[bounded]]).tocsc()
    bounds = np.concatenate([-low, high[bounded]])
    settings = engine.DefaultSettings()
    settings.verbose, settings.max_iter, settings.time_limit, settings.max_threads = False, ITERATIONS, SECONDS, 1
    cones = [engine.NonnegativeConeT(len(bounds))]
    answer = engine.DefaultSolver(sparse.triu(squares).tocsc(), linear, matrix, bounds, cones, settings).solve()
    if answer.status == engine.SolverStatus.MaxTime:
        raise SolverTimeout("Clarabel", SECONDS)
    return np.array(answer.x) if answer.status in (engine.SolverStatus.Solved, engine.SolverStatus.AlmostSolved) else None
