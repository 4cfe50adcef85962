"""Points of a quantile surface, to look at what the threshold's step is made of."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ltlplan.paths.cross_entropy.quantile import directions, quantile_radius, square_root

Floats = NDArray[np.float64]


def quantile_samples(mean: Floats, covariance: Floats, probability: float, count: int, rng: Generator) -> Floats:
    """Draw points uniformly by direction from a quantile surface (Algorithm 3).

    Args:
        mean: Centre. Shape (dimension,).
        covariance: Symmetric, no negative eigenvalue. Shape (dimension, dimension).
        probability: Share of the distribution inside the surface, between 0 and 1.
        count: How many points.
        rng: Source of the directions.

    Returns:
        Shape (count, dimension).
    """
    centre = np.asarray(mean, dtype=np.float64)
    stretched = quantile_radius(probability, len(centre)) * square_root(covariance)
    return directions(rng, (count, len(centre))) @ stretched + centre
