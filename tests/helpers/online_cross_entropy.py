"""Online cross-entropy by the printed algorithm: one path a step, many rows at once; `tell_all` of the project is checked against it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ltlplan.online_mtac.cross_entropy import Flags, Floats, OnlineSettings, OnlineState, fitted


def beta(steps: NDArray[np.int64] | int, weight: float = 0.01, decay: float = 0.001) -> Floats:
    """Return a exp(-b t), the share of news in Delta at step t (Section 6.4).

    Args:
        steps: t.
        weight: a.
        decay: b.
    """
    return weight * np.exp(-decay * np.asarray(steps, dtype=np.float64))


def ask(state: OnlineState, rng: Generator) -> Floats:
    """Sample one path a row from its normal distribution (line 13). Shape (rows, points, dimension)."""
    normal = rng.standard_normal(state.mean.shape)
    return state.mean + np.matmul(state.root, normal[..., None])[..., 0]


def tell(state: OnlineState, samples: Floats, costs: Floats, valid: Flags, *, settings: OnlineSettings) -> OnlineState:
    """Learn from the costs of the sampled paths (lines 14 to 21, mirrored for minimisation).

    Args:
        state: The rows as they were when `samples` were asked for.
        samples: Shape (rows, points, dimension).
        costs: Shape (rows,); ignored where not valid.
        valid: Whether the row's path goes through its hoop (and keeps all else that it must). Shape (rows,).
        settings: The method's numbers.
    """
    good = valid & np.isfinite(costs)
    first = good & np.isnan(state.threshold)
    threshold = np.where(first, costs, state.threshold)
    elite = good & (costs <= threshold)
    rho = settings.elite
    # a first path has only set the threshold; it is not judged by it
    threshold = np.where(elite & ~first, threshold - (1 - rho) * state.step, threshold)
    threshold = np.where(good & ~elite, threshold + rho * state.step, threshold)
    share = beta(state.count, settings.weight, settings.decay)
    news = good & np.isfinite(state.cost)
    change = np.abs(np.where(news, costs - state.cost, 0.0))
    moved = replace(
        state,
        threshold=threshold,
        step=np.where(news, (1 - share) * state.step + share * change, state.step),
        cost=np.where(good, costs, state.cost),
        count=state.count + 1,
    )
    return _learn(moved, samples, elite, settings) if elite.any() else moved


def _learn(state: OnlineState, samples: Floats, elite: Flags, settings: OnlineSettings) -> OnlineState:
    """Put elites into the windows and take the maximum-likelihood mean and covariance of those that are full."""
    rows = np.flatnonzero(elite)
    elites, found = state.elites.copy(), state.found.copy()
    elites[rows, found[rows] % settings.window] = samples[rows]
    found[rows] += 1
    full = rows[found[rows] >= settings.window]
    learned = replace(state, elites=elites, found=found)
    return fitted(learned, full, settings) if len(full) else learned
