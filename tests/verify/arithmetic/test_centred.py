"""Quantities with their rates hold the polynomials that they were made of."""

from __future__ import annotations

import numpy as np

from verify.arithmetic.balls import Balls
from verify.arithmetic.centred import Centred


def test_vectors_are_enclosed_component_by_component() -> None:
    rng = np.random.default_rng(0)
    coefficients = rng.normal(size=(4, 3, 6))
    found = Centred.of(Balls(coefficients, np.zeros_like(coefficients)))
    u = np.linspace(0.0, 1.0, 101)
    basis = np.stack([_choose(5, i) * u**i * (1 - u) ** (5 - i) for i in range(6)])
    values = coefficients @ basis
    rates = np.gradient(values, u, axis=-1, edge_order=2)
    assert found.middle.low.shape == found.over.low.shape == found.rate.low.shape == (4, 3)
    assert np.all(found.middle.low <= values[..., 50] + 1e-12)
    assert np.all(found.middle.high >= values[..., 50] - 1e-12)
    assert np.all(found.over.low <= values.min(-1))
    assert np.all(found.over.high >= values.max(-1))
    assert np.all(found.rate.low <= rates.min(-1) + 1e-2)
    assert np.all(found.rate.high >= rates.max(-1) - 1e-2)
    steps = 5 * np.diff(coefficients, axis=-1)  # no wider than the control points of the derivative
    assert np.allclose(found.rate.low, steps.min(-1))
    assert np.allclose(found.rate.high, steps.max(-1))
    assert np.allclose(found.over.high, coefficients.max(-1))


def _choose(n: int, k: int) -> int:
    return int(np.prod(np.arange(n - k + 1, n + 1)) // max(1, np.prod(np.arange(1, k + 1))))
