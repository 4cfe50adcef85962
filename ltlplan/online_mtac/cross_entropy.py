"""Online cross-entropy: one sampled path a step, a threshold that follows the elite quantile (2022 paper, Algorithm 4).

The offline method draws many paths, sorts them and keeps the best share rho. The online one draws a single path a
step and compares its cost with a threshold lambda that is moved up and down so that in the long run the share
rho of all paths passes it. A row is one such search: one robot on its way.

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
from verify.data.arrays import Floats

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


@dataclass(frozen=True, slots=True, eq=False)
class OnlineState:
    """A row between two steps. Arrays are never written to after they were handed out.

    Attributes:
        mean: Means of the path's points. Shape (points, dimension).
        root: Square roots of their covariances. Shape (points, dimension, dimension).
        step: Delta, the scalar form of eq. (13).
        elites: The last elites, a ring. Shape (window, points, dimension).
        threshold: lambda; NaN until the first valid path.
        cost: Cost of the last valid path; NaN before.
        count: The number of steps, t of beta.
        found: How many elites there were.
    """

    mean: Floats
    root: Floats
    step: float
    elites: Floats
    threshold: float = math.nan
    cost: float = math.nan
    count: int = 0
    found: int = 0


def start(mean: Floats, variance: float, rng: Generator, *, settings: OnlineSettings) -> OnlineState:
    """Begin a row from given means (Algorithm 4, lines 1 to 6).

    Args:
        mean: Shape (points, dimension).
        variance: Of each coordinate.
        rng: Source of the quantile samples' directions.
        settings: The method's numbers.
    """
    points, dimension = mean.shape
    root = np.tile(math.sqrt(variance) * np.eye(dimension), (points, 1, 1))
    step = float(scalar_step(quantile_step(root, directions(rng, mean.shape), settings.elite, settings.trajectories)))
    return OnlineState(mean, root, step, np.zeros((settings.window, points, dimension)))


def ask_all(state: OnlineState, rng: Generator, count: int) -> Floats:
    """Sample several paths from a row's normal distribution (line 13).

    Args:
        state: The row.
        rng: Source of the samples.
        count: How many.

    Returns:
        Shape (count, points, dimension).
    """
    normal = rng.standard_normal((count, *state.mean.shape))
    return state.mean + np.matmul(state.root, normal[..., None])[..., 0]


def tell_all(state: OnlineState, samples: Floats, costs: Floats, valid: Flags, *, settings: OnlineSettings) -> OnlineState:
    """Learn from several paths as from one after another (lines 14 to 21, mirrored for minimisation); the Gaussian is fitted once.

    Args:
        state: The row.
        samples: Shape (paths, points, dimension).
        costs: Shape (paths,).
        valid: Shape (paths,).
        settings: The method's numbers.
    """
    rho = settings.elite
    threshold, step, last, count = state.threshold, state.step, state.cost, state.count
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
    moved = replace(state, threshold=threshold, step=step, cost=last, count=count)
    if not elites:
        return moved
    window = state.elites.copy()
    window[(state.found + np.arange(len(elites))) % settings.window] = samples[elites]
    moved = replace(moved, elites=window, found=state.found + len(elites))
    return _fitted(moved, settings) if moved.found >= settings.window else moved


def _fitted(state: OnlineState, settings: OnlineSettings) -> OnlineState:
    """Take the maximum-likelihood mean and covariance of a full window."""
    mean = state.elites.mean(axis=0)
    offset = state.elites - mean
    covariance = np.einsum("wpi,wpj->pij", offset, offset) / settings.window
    covariance += settings.floor**2 * np.eye(covariance.shape[-1])
    return replace(state, mean=mean, root=square_root(covariance))
