"""Online cross-entropy: one sampled path a step, a threshold that follows the elite quantile (2022 paper, Algorithm 4).

The offline method draws many paths, sorts them and keeps the best share rho. The online one draws a single path a
step and compares its cost with a threshold lambda that is moved up and down so that in the long run the share
rho of all paths passes it. Many searches run side by side, one a row (a row is one robot on its way to one hoop).

Costs are minimised here, so the printed algorithm, a maximiser's (Szita and Lorincz accept f >= lambda), is
mirrored: a path is elite when f <= lambda; then lambda falls by (1 - rho) Delta, otherwise it rises by rho Delta. It
rests where P(f <= lambda) (1 - rho) = P(f > lambda) rho, which is the rho-quantile of the costs. Also:

* Delta is computed from the quantile samples once, when a row starts; after that only eq. 6.4 moves it:
  Delta <- (1 - beta) Delta + beta |f_t - f_{t-1}|, beta = a exp(-b t), t the row's number of steps. (Lines 5 and 10 would
  compute it anew each step, and so undo line 21, which carries an extra factor Delta against Section 6.4.)
* The maximum-likelihood update (line 16) reads a window of the last elites: one sample has no covariance.
* The first threshold, "random" in line 4, is the cost of the row's first valid path: random, in the cost's own unit.
* A path that misses its hoop leaves the row's lambda, Delta and window alone.
* The covariance has a floor, so that a row that has converged still follows a hoop that moves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ltlplan.paths.cross_entropy.quantile import check_quantile, directions, quantile_step, scalar_step, square_root
from verify.data.errors import BadInput

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class OnlineSettings:
    """Numbers of the online method.

    Attributes:
        elite: Share rho that the threshold is to pass, between 0 and 1.
        trajectories: N of eq. (11), more than 1 / elite.
        weight: a of beta = a exp(-b t).
        decay: b, per step.
        window: How many elites the maximum-likelihood update reads; at least two.
        floor: Least standard deviation of a sampled point along any axis, in the points' unit (m).
    """

    elite: float = 0.1
    trajectories: int = 50
    weight: float = 0.01
    decay: float = 0.001
    window: int = 25
    floor: float = 0.004

    def __post_init__(self) -> None:
        check_quantile(self.elite, self.trajectories)
        if not (0 <= self.weight <= 1 and self.decay >= 0):
            raise BadInput(f"beta = a exp(-b t) needs 0 <= a <= 1 and b >= 0, not a = {self.weight:g}, b = {self.decay:g}.")
        if self.window < 2:
            raise BadInput(f"a covariance needs a window of at least 2 elites, not {self.window}.")
        if not self.floor >= 0:
            raise BadInput(f"floor must not be negative, not {self.floor:g}.")


@dataclass(frozen=True, slots=True, eq=False)
class OnlineState:
    """All rows between two steps. Arrays are never written to after they were handed out.

    Attributes:
        mean: Means of the path's points. Shape (rows, points, dimension).
        root: Square roots of their covariances. Shape (rows, points, dimension, dimension).
        threshold: lambda; NaN until the row's first valid path. Shape (rows,).
        step: Delta, the scalar form of eq. (13). Shape (rows,).
        cost: Cost of the row's last valid path; NaN before. Shape (rows,).
        count: The row's number of steps, t of beta. Shape (rows,).
        elites: The last elites, a ring. Shape (rows, window, points, dimension).
        found: How many elites the row has had. Shape (rows,).
    """

    mean: Floats
    root: Floats
    threshold: Floats
    step: Floats
    cost: Floats
    count: NDArray[np.int64]
    elites: Floats
    found: NDArray[np.int64]


def start(
    mean: Floats,
    covariance: Floats | float,
    rng: Generator,
    *,
    settings: OnlineSettings,
    threshold: Floats | float | None = None,
) -> OnlineState:
    """Begin rows from given means (Algorithm 4, lines 1 to 6).

    Args:
        mean: Shape (rows, points, dimension).
        covariance: One number for that multiple of the identity, or shape (rows, points, dimension, dimension).
        rng: Source of the quantile samples' directions.
        settings: The method's numbers.
        threshold: First lambda, one or a number a row; None takes the first valid path's cost.

    Raises:
        BadInput: Shapes do not fit, a number is not finite, or a covariance is none.
    """
    centre = np.array(mean, dtype=np.float64)
    if centre.ndim != 3 or 0 in centre.shape[1:] or not np.all(np.isfinite(centre)):
        raise BadInput(f"means must be finite, of shape (rows, points, dimension), not of shape {centre.shape}.")
    rows, points, dimension = centre.shape
    if np.ndim(covariance) == 0:
        if not (math.isfinite(float(covariance)) and covariance >= 0):
            raise BadInput(f"a covariance must be finite and not negative, not {covariance}.")
        root = np.broadcast_to(math.sqrt(float(covariance)) * np.eye(dimension), (rows, points, dimension, dimension)).copy()
    else:
        if np.shape(covariance) != (rows, points, dimension, dimension):
            raise BadInput(f"covariances must have shape {(rows, points, dimension, dimension)}, not {np.shape(covariance)}.")
        root = square_root(np.asarray(covariance, dtype=np.float64))
    step = scalar_step(quantile_step(root, directions(rng, centre.shape), settings.elite, settings.trajectories))
    first = (
        np.full(rows, np.nan) if threshold is None else np.broadcast_to(np.asarray(threshold, dtype=np.float64), (rows,)).copy()
    )
    return OnlineState(
        mean=centre,
        root=root,
        threshold=first,
        step=step,
        cost=np.full(rows, np.nan),
        count=np.zeros(rows, dtype=np.int64),
        elites=np.zeros((rows, settings.window, points, dimension)),
        found=np.zeros(rows, dtype=np.int64),
    )


def ask_all(state: OnlineState, rng: Generator, count: int) -> Floats:
    """Sample several paths of one row from its normal distribution (line 13).

    Args:
        state: Whose first row is sampled.
        rng: Source of the samples.
        count: How many.

    Returns:
        Shape (count, points, dimension).
    """
    normal = rng.standard_normal((count, *state.mean.shape[1:]))
    return state.mean[0] + np.matmul(state.root[0], normal[..., None])[..., 0]


def tell_all(state: OnlineState, samples: Floats, costs: Floats, valid: Flags, *, settings: OnlineSettings) -> OnlineState:
    """Learn from several paths of one row as from one after another (lines 14 to 21, mirrored for minimisation); the Gaussian is fitted once.

    Args:
        state: One row.
        samples: Shape (paths, points, dimension).
        costs: Shape (paths,).
        valid: Shape (paths,).
        settings: The method's numbers.

    Raises:
        BadInput: The state has several rows.
    """
    if len(state.mean) != 1:
        raise BadInput(f"several paths are told to one row at a time, not to {len(state.mean)}.")
    rho = settings.elite
    threshold, step, last, count = float(state.threshold[0]), float(state.step[0]), float(state.cost[0]), int(state.count[0])
    elites: list[int] = []
    for index, (cost, good) in enumerate(zip(costs.tolist(), valid.tolist(), strict=True)):
        if good and math.isfinite(cost):
            if math.isnan(threshold):
                threshold = cost
                elites.append(index)
            elif cost <= threshold:
                threshold -= (1 - rho) * step
                elites.append(index)
            else:
                threshold += rho * step
            if math.isfinite(last):
                share = settings.weight * math.exp(-settings.decay * count)
                step = (1 - share) * step + share * abs(cost - last)
            last = cost
        count += 1
    moved = replace(
        state, threshold=np.array([threshold]), step=np.array([step]), cost=np.array([last]), count=np.array([count])
    )
    if not elites:
        return moved
    window, found = state.elites.copy(), int(state.found[0])
    for index in elites:
        window[0, found % settings.window] = samples[index]
        found += 1
    moved = replace(moved, elites=window, found=np.array([found]))
    return fitted(moved, np.array([0]), settings) if found >= settings.window else moved


def fitted(state: OnlineState, full: NDArray[np.int64], settings: OnlineSettings) -> OnlineState:
    """Take the maximum-likelihood mean and covariance of rows whose windows are full.

    Args:
        state: All rows.
        full: Those rows, by index.
        settings: The method's numbers.
    """
    mean, root = state.mean.copy(), state.root.copy()
    window = state.elites[full]
    mean[full] = window.mean(axis=1)
    offset = window - mean[full][:, None]
    covariance = np.einsum("rwpi,rwpj->rpij", offset, offset) / settings.window
    covariance += settings.floor**2 * np.eye(covariance.shape[-1])
    root[full] = square_root(covariance)
    return replace(state, mean=mean, root=root)
