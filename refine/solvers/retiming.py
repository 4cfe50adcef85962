"""Fastest pace along a given path: a convex programme in the squared pace along it (cvxpy's only importer).

With the path r as a function of its own time u and b = (du/dt)^2, speed squared is |r'|^2 b and acceleration is
r'' b + r' b' / 2: linear in b and its slope. Speed, acceleration, greatest thrust and tilt are then second-order cones and
the duration, the integral of b^(-1/2), is convex, so the optimum on the grid is global. Rates of the body depend on b'' and
are not convex; they are seen to afterwards, by stretching. A path that starts at rest in its own time stays at rest there
whatever its pace, so b needs no zero.
"""

from __future__ import annotations

import warnings
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refine.limits.limits import Limits
from refine.limits.stretching import stretch_to_limits
from refine.solvers.timeout import SolverTimeout
from refine.spline.least_snap import minimum_snap
from refine.spline.spline import Spline
from verify.data import GRAVITY, BadInput, Infeasible, MissingEngine

Floats = NDArray[np.float64]

GRID = 120
"""Intervals of the path in the programme."""
ITERATIONS = 200
SECONDS = 120.0
"""The clock only ends a solve with an error."""
_PIECES = (1, 2, 4, 8)
_SMOOTH = 2e-3
_SAFETY = 1e-3


def retime(path: Spline, limits: Limits, *, within: float = 0.02) -> Spline:
    """Return a path flown in a shorter time, as pieces again and never slower than by uniform stretching.

    Args:
        path: Three axes, at rest at its ends.
        limits: Rotor and yaw limits are left to the caller, as yaw is.
        within: Greatest distance of the answer from the path, m.

    Raises:
        BadInput: `within` is no length.
        Infeasible: The limits cannot be kept at any speed, or the engine did not solve the programme.
        SolverTimeout: The engine's seconds ran out before its iterations.
        MissingEngine: cvxpy is not installed.
    """
    if not 0.0 < within < np.inf:
        raise BadInput(f"within must be a length in m above 0, not {within}.")
    uniform = path.stretched(stretch_to_limits(path, None, limits, safety=_SAFETY, faster=True))
    times = pace(uniform, limits)
    for pieces in _PIECES:
        fitted = _refitted(uniform, times, pieces)
        if _apart(fitted, uniform) > within:
            continue
        fitted = fitted.stretched(stretch_to_limits(fitted, None, limits, safety=_SAFETY, faster=True))
        if fitted.duration < uniform.duration:
            return fitted
    return uniform


def pace(path: Spline, limits: Limits) -> Floats:
    """Return the time at which each of GRID + 1 even instants of a path's own time is passed, s. Shape (GRID + 1,).

    Raises:
        Infeasible: The engine did not solve the programme; "almost solved" is not solved.
        SolverTimeout: Its seconds ran out before its iterations.
        MissingEngine: cvxpy is not installed.
    """
    at = np.linspace(0.0, path.duration, GRID + 1)
    first, _ = _derivatives(path, at)
    programme, squared, parameters = _programme(
        np.isfinite(limits.acceleration), np.isfinite(limits.thrust_max), np.isfinite(limits.tilt)
    )
    step = path.duration / GRID
    middle = 0.5 * (at[1:] + at[:-1])
    first_mid, second_mid = _derivatives(path, middle)
    cap = np.minimum(limits.speed**2 / np.maximum(np.sum(first**2, axis=1), 1e-12), 1e4)
    values = {
        "cap": cap,
        "first": first_mid / step,
        "second": second_mid,
        "acceleration": limits.acceleration,
        "thrust": limits.thrust_max,
        "upright": np.cos(limits.tilt) if np.isfinite(limits.tilt) else 0.0,
    }
    for name, parameter in parameters.items():
        parameter.value = values[name]
    _solve(programme)
    if squared.value is None or not np.all(np.isfinite(squared.value)):
        raise Infeasible("The pace along the path was not found: the answer is not finite.")
    root = np.sqrt(np.clip(squared.value, 1e-9, cap))
    return np.concatenate([[0.0], np.cumsum(2.0 * step / (root[1:] + root[:-1]))])


def _solve(programme: Any) -> None:
    """Solve, by the same steps on every machine."""
    import cvxpy as cp

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # "may be inaccurate": refused below
            programme.solve(solver=cp.CLARABEL, max_iter=ITERATIONS, time_limit=SECONDS, max_threads=1)
    except cp.SolverError as error:
        raise Infeasible(f"The pace along the path was not found: {error}") from None
    if programme.status == cp.USER_LIMIT and (programme.solver_stats.num_iters or 0) < ITERATIONS:
        raise SolverTimeout("Clarabel", SECONDS)
    if programme.status != cp.OPTIMAL:
        raise Infeasible(f"The pace along the path was not found: {programme.status} after at most {ITERATIONS} iterations.")


@lru_cache(maxsize=8)
def _programme(accelerating: bool, thrusting: bool, tilting: bool) -> tuple[Any, Any, dict[str, Any]]:
    """Return the programme with its limits and path as parameters, compiled once."""
    try:
        import cvxpy as cp
    except ImportError:
        raise MissingEngine("Retiming a path needs cvxpy: pip install 'cvxpy>=1.5'.") from None
    squared = cp.Variable(GRID + 1, nonneg=True)
    parameters: dict[str, Any] = {"cap": cp.Parameter(GRID + 1, nonneg=True)}
    rules = [squared <= parameters["cap"]]
    if accelerating or thrusting or tilting:
        parameters["first"], parameters["second"] = cp.Parameter((GRID, 3)), cp.Parameter((GRID, 3))
        mean = 0.5 * (squared[1:] + squared[:-1])
        slope = 0.5 * (squared[1:] - squared[:-1])
        acceleration = cp.multiply(parameters["second"], cp.reshape(mean, (GRID, 1), order="C")) + cp.multiply(
            parameters["first"], cp.reshape(slope, (GRID, 1), order="C")
        )
        force = acceleration + np.array([[0.0, 0.0, GRAVITY]])
        if accelerating:
            parameters["acceleration"] = cp.Parameter(nonneg=True)
            rules.append(cp.norm(acceleration, axis=1) <= parameters["acceleration"])
        if thrusting:
            parameters["thrust"] = cp.Parameter(nonneg=True)
            rules.append(cp.norm(force, axis=1) <= parameters["thrust"])
        if tilting:
            parameters["upright"] = cp.Parameter(nonneg=True)
            size = cp.Variable(GRID)  # so that parameters do not multiply each other
            rules += [cp.norm(force, axis=1) <= size, parameters["upright"] * size <= force[:, 2]]
    duration = cp.sum(cp.inv_pos(cp.sqrt(squared[1:]) + cp.sqrt(squared[:-1]))) / GRID
    smooth = _SMOOTH * cp.sum_squares(cp.diff(squared, 2))  # rates of the body follow the second slope
    return cp.Problem(cp.Minimize(duration + smooth), rules), squared, parameters


def _derivatives(path: Spline, at: Floats) -> tuple[Floats, Floats]:
    piece = np.clip(np.searchsorted(path.knots, at, side="right") - 1, 0, len(path) - 1)
    local = at - path.knots[piece]
    shares = local / path.durations[piece]
    first, second = np.empty((len(at), 3)), np.empty((len(at), 3))
    for index in range(len(path)):
        mine = piece == index
        one = Spline(path.durations[index : index + 1], path.states[index : index + 2])
        first[mine], second[mine] = one.sample(shares[mine], 1)[0], one.sample(shares[mine], 2)[0]
    return first, second


def _refitted(path: Spline, times: Floats, pieces: int) -> Spline:
    """Return minimum snap through points of the path at the times of a pace."""
    split = path.split(pieces)
    at = np.interp(split.knots, np.linspace(0.0, path.duration, len(times)), times)
    return minimum_snap(split.nodes, at)


def _apart(one: Spline, other: Spline) -> float:
    """Return the greatest distance of samples of one path from the other path."""
    shares = np.linspace(0.0, 1.0, 24)
    a, b = one.sample(shares).reshape(-1, 3), other.sample(np.linspace(0.0, 1.0, 200)).reshape(-1, 3)
    return float(np.sqrt(((a[:, None] - b[None]) ** 2).sum(axis=2).min(axis=1).max()))
