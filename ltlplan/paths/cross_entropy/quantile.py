"""Points at a quantile of a multivariate normal distribution, and the threshold step made from them.

Sections 6.1 and 6.2 of the 2022 paper (eq. 9 to 13, Algorithm 3). A normal distribution in several dimensions has
no quantile point but a quantile surface: the ellipsoid around the mean that holds a given share of the
probability. Algorithm 3 draws a point of it: a direction, uniform on the unit sphere, stretched by the square
root of the covariance and by the radius c, where c^2 is the chi-squared quantile.

Where this differs from the printed text:

* Eq. (9) takes the infimum over Phi(x) <= p; the quantile is the infimum over Phi(x) >= p.
* Eq. (10) and (12) multiply by the covariance where its square root is meant, as lines 3 and 4 of Algorithm 3
  and the text's own "2 sigma / sqrt(pi)" say. The half in eq. (11) belongs to both terms, as eq. (12) has it.
* Both quantile samples of eq. (12) use the same direction; with two directions their difference would be noise.
* 1 - rho + 1/N must be below 1, so N > 1/rho is required.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.random import Generator
from scipy.special import gammaincinv

from verify.data.arrays import Floats
from verify.data.errors import BadInput


def directions(rng: Generator, shape: tuple[int, ...]) -> Floats:
    """Draw unit vectors, uniform on the sphere (Algorithm 3, lines 5 to 8). The last axis holds a vector."""
    normal = rng.standard_normal(shape)
    return normal / np.sqrt(np.sum(normal * normal, axis=-1, keepdims=True))


@lru_cache(maxsize=256)
def quantile_radius(probability: float, dimension: int) -> float:
    """Return c: the ellipsoid of radius c, in standard deviations, holds this share (Algorithm 3, lines 1 and 2)."""
    return math.sqrt(2.0 * float(gammaincinv(dimension / 2.0, probability)))


def square_root(covariance: Floats) -> Floats:
    """Return the symmetric square root V D^(1/2) V' of covariances (Algorithm 3, line 3).

    Args:
        covariance: Shape (..., dimension, dimension).
    """
    values, vectors = np.linalg.eigh(covariance)
    # rounding of a singular covariance leaves eigenvalues such as -1e-20, which are zeros
    return np.einsum("...ij,...j,...kj->...ik", vectors, np.sqrt(np.maximum(values, 0.0)), vectors)


def check_quantile(elite: float, trajectories: int) -> None:
    """Refuse an elite share, above 0, and a number of trajectories between which eq. (11) has no quantile.

    Raises:
        BadInput: N <= 1 / rho.
    """
    # 1 - rho + 1/N < 1, with a grain of tolerance in the strict direction
    if not trajectories * elite > 1 + 1e-12:
        raise BadInput(
            f"{trajectories} trajectories are too few for rho = {elite:g}: more than 1 / rho = {1 / elite:g} are needed, "
            "so that the quantile 1 - rho + 1/N is below 1."
        )


def quantile_step(root: Floats, direction: Floats, elite: float, trajectories: int) -> Floats:
    """Return the matrix step of eq. (12): the spread of two samples times the gap between two quantile points.

    Args:
        root: Square roots of the covariances of the path's points. Shape (..., points, dimension, dimension).
        direction: The points of the unit sphere that both quantile samples use. Shape (..., points, dimension).
        elite: Share rho of the elite set.
        trajectories: N, how many trajectories the elite set is thought to be a share of; more than 1 / rho.

    Returns:
        Shape (..., points, dimension). Its numbers serve as a step of the threshold, which is a cost.
    """
    dimension = root.shape[-1]
    gap = quantile_radius(1 - elite + 1 / trajectories, dimension) - quantile_radius(1 - elite, dimension)
    # F^-1(1 - rho + 1/N) - F^-1(1 - rho): the means cancel, both use `direction`
    difference = np.einsum("...ij,...j->...i", root, gap * direction)
    return np.einsum("...ij,...j->...i", root, difference) / math.sqrt(math.pi)


def scalar_step(step: Floats) -> Floats:
    """Return eq. (13): the least sum of absolute entries over the path's points. Shape (..., points, dimension) to (...)."""
    return np.min(np.sum(np.abs(step), axis=-1), axis=-1)
