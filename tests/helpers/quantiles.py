"""Points of a quantile surface, to look at what the threshold's step is made of."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ltlplan.paths.cross_entropy.quantile import directions, quantile_radius, square_root
from verify.data import BadInput

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

    Raises:
        BadInput: The probability is not between 0 and 1, or the covariance is no covariance.
    """
    centre = np.asarray(mean, dtype=np.float64)
    if count < 1:
        raise BadInput(f"count must be at least 1, not {count}.")
    if centre.ndim != 1 or np.shape(covariance) != (len(centre), len(centre)):
        raise BadInput(
            f"a mean of shape {centre.shape} needs a covariance of shape {centre.shape * 2}, not {np.shape(covariance)}."
        )
    stretched = quantile_radius(probability, len(centre)) * square_root(covariance)
    return directions(rng, (count, len(centre))) @ stretched + centre
