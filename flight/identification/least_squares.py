"""Least squares on weighted integrals of a flight, with intervals that hold where what is left over hangs together.

Newton's law is not differentiated from noisy places but tested: multiplied by a smooth bump and integrated, by parts where it has derivatives. So the
acceleration of a place becomes the place times the bump's second derivative. Bumps follow one another through the flight. What is left over is gusts,
which last for seconds, so that neighbouring residuals count together (Newey and West 1987).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from flight.identification.recorded import RATE
from flight.model.attitude import Floats

LONG = 0.8
"""s, length of a bump."""
STEP = 0.2
"""s from one bump to the next."""
TOGETHER = 8.0
"""s over which residuals count together."""
LEVEL = 0.95
"""Rate at which intervals hold what is true."""


@dataclass(frozen=True, eq=False, slots=True)
class Bumps:
    """Bumps along a flight, as matrices from samples to integrals.

    Attributes:
        plain: Of the bump, with integral 1. Shape (bumps, n).
        slope: Of its derivative, 1/s. Shape (bumps, n).
        curve: Of its second derivative, 1/s^2. Shape (bumps, n).
    """

    plain: Floats
    slope: Floats
    curve: Floats


def bumps_over(samples: int) -> Bumps:
    """Return the bumps of a flight.

    Args:
        samples: Of the flight, at `RATE`.
    """
    half = 0.5 * LONG
    reach = round(half * RATE)
    u = np.arange(-reach, reach + 1) / RATE / half
    inside = 1.0 - u * u
    plain = inside**4
    slope = -8.0 * u * inside**3 / half
    curve = (-8.0 * inside**3 + 48.0 * u * u * inside**2) / half**2
    whole = plain.sum()
    middles = np.arange(reach, samples - reach, round(STEP * RATE))
    matrices = np.zeros((3, len(middles), samples))
    for row, middle in enumerate(middles):
        matrices[:, row, middle - reach : middle + reach + 1] = np.stack([plain, slope, curve]) / whole
    return Bumps(*matrices)


@dataclass(frozen=True, eq=False, slots=True)
class Fit:
    """A fit by least squares.

    Attributes:
        values: Of the parameters. Shape (p,).
        half: Half the width of each one's interval at `LEVEL`. Shape (p,).
        residual: What is left over. Shape (bumps, axes).
    """

    values: Floats
    half: Floats
    residual: Floats


def fitted(columns: Floats, wanted: Floats) -> Fit:
    """Fit parameters, each axis weighted by what is left over on it.

    Args:
        columns: Shape (bumps, axes, p).
        wanted: Shape (bumps, axes).
    """
    weight = np.ones(wanted.shape[1])
    values: Floats = np.zeros(columns.shape[2])
    left = wanted
    for _ in range(3):
        x = (columns * weight[None, :, None]).reshape(-1, columns.shape[2])
        values = np.asarray(np.linalg.lstsq(x, (wanted * weight).reshape(-1), rcond=None)[0], dtype=np.float64)
        left = wanted - columns @ values
        weight = 1.0 / np.maximum(np.sqrt(np.mean(left * left, axis=0)), 1e-9)
    scaled = columns * weight[None, :, None]
    inner = np.linalg.pinv(np.einsum("kap,kaq->pq", scaled, scaled))
    scores = np.einsum("kap,ka->kp", scaled, left * weight)
    lags = round(TOGETHER / STEP)
    spread = scores.T @ scores
    for lag in range(1, min(lags, len(scores))):
        together = scores[lag:].T @ scores[:-lag]
        spread += (1.0 - lag / lags) * (together + together.T)
    free = max(len(scores) * STEP / TOGETHER - 1.0, 1.0)  # stretches that are apart
    covariance = inner @ spread @ inner * ((free + 1.0) / free)
    error = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return Fit(values, float(student.ppf(0.5 * (1.0 + LEVEL), free)) * error, left)
