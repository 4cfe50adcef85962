"""Samples of many paths near regions, and runs of a table over their codes, as arrays: for the search, never a claim.

Samples are sifted first: one matrix product gives all squared distances to the regions' centres, and only the few samples
within a region's bounding sphere are looked at closely.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_CHUNK = 32768  # samples labelled at a time, so that the arrays stay in the cache


def final_states(table: Integers, codes: NDArray[np.integer]) -> Integers:
    """Run a table over codes from state 0; the state after the last is len(table) where a run died. Shape (paths,)."""
    dead = len(table)
    full = np.concatenate([np.where(table < 0, dead, table), np.full((1, table.shape[1]), dead)])
    width = full.shape[1]
    flat = (full * width).ravel()  # offsets of rows, so that one step is one addition and one look-up
    state = np.zeros(codes.shape[1], dtype=np.int64)
    for row in codes:
        state = flat.take(state + row)
    return state // width


def scaled_level(inner_radius: float, by: float) -> float:
    """Return the level of an ellipsoid scaled so that its shortest radius changes by `by` m, never below a twentieth of it.

    Args:
        inner_radius: The shortest radius, m.
        by: m; below 0 it shrinks.
    """
    return max(1.0 + by / inner_radius, 0.05) ** 2


def samples_near(positions: Floats, centres: Floats, reach: Floats) -> Iterator[tuple[int, int, Integers, Floats]]:
    """Yield (first sample of a block, region, samples of the block near it, their offsets from its centre (3, near)).

    Args:
        positions: m. Shape (instants, 3, paths).
        centres: The regions', m. Shape (regions, 3).
        reach: How far from its centre a sample may still have to do with a region, m. Shape (regions,).
    """
    count = positions.shape[2]
    step = max(1, _CHUNK // max(1, count))
    bound = (reach**2 - np.einsum("ra,ra->r", centres, centres))[:, None]
    for first in range(0, len(positions), step):
        flat = positions[first : first + step].transpose(1, 0, 2).reshape(3, -1)
        close = (-2.0 * centres) @ flat + np.einsum("an,an->n", flat, flat) <= bound
        for i in np.flatnonzero(close.any(axis=1)):
            index = np.flatnonzero(close[i])
            yield first * count, int(i), index, flat[:, index] - centres[i][:, None]


def ellipsoid_level(matrix: Floats, offset: Floats) -> Floats:
    """Return the level of an ellipsoid at offsets from its centre. Shape (3, n) to (n,)."""
    return np.einsum("an,an->n", matrix @ offset, offset)
