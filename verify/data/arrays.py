"""Types of arrays in signatures, whose shapes stand in the docstrings, and points out of arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]


def point_of(values: Sequence[float] | Floats) -> tuple[float, float, float]:
    """Return three numbers as a point, m."""
    x, y, z = (float(value) for value in values)
    return x, y, z
