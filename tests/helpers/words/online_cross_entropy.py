"""Online cross-entropy by the printed algorithm: one path a step; `tell_all` of the project is checked against it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ltlplan.online_mtac.cross_entropy import Floats, OnlineSettings, OnlineState
from ltlplan.paths.cross_entropy.quantile import square_root


def beta(steps: int, weight: float = 0.01, decay: float = 0.001) -> float:
    """Return a exp(-b t), the share of news in Delta at step t (Section 6.4).

    Args:
        steps: t.
        weight: a.
        decay: b.
    """
    return weight * math.exp(-decay * steps)


def tell(state: OnlineState, sample: Floats, cost: float, *, settings: OnlineSettings, valid: bool = True) -> OnlineState:
    """Learn from the cost of the sampled path (lines 14 to 21, mirrored for minimisation).

    Args:
        state: The row as it was when the sample was asked for.
        sample: Shape (points, dimension).
        cost: Ignored where not valid.
        settings: The method's numbers.
        valid: Whether the path goes through its hoop (and keeps all else that it must).
    """
    moved = replace(state, count=state.count + 1)
    if not valid:
        return moved
    first, rho = math.isnan(state.threshold), settings.elite
    elite = first or cost <= state.threshold
    if first:
        moved = replace(moved, threshold=cost)  # a first path has only set the threshold; it is not judged by it
    else:
        moved = replace(moved, threshold=state.threshold + (rho - 1 if elite else rho) * state.step)
    if not math.isnan(state.cost):
        share = beta(state.count, settings.weight, settings.decay)
        moved = replace(moved, step=(1 - share) * state.step + share * abs(cost - state.cost))
    moved = replace(moved, cost=cost)
    if not elite:
        return moved
    elites = state.elites.copy()
    elites[state.found % settings.window] = sample
    moved = replace(moved, elites=elites, found=state.found + 1)
    if moved.found < settings.window:
        return moved
    mean = elites.mean(axis=0)
    covariance = np.einsum("wpi,wpj->pij", elites - mean, elites - mean) / settings.window
    return replace(moved, mean=mean, root=square_root(covariance + settings.floor**2 * np.eye(mean.shape[-1])))
