"""Half-spaces that touch quadrics: by Cauchy and Schwarz u'Q(x - c) <= sqrt(B u'Qu) for every u."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Floats, gamma, nearest
from verify.arithmetic.bounds import Indices
from verify.data.shapes.conditions import Quadric, root_bounds
from verify.motion.obstacles.half_spaces import GROW, NONE, TINY, HalfSpaces

_NEWTON = 12


@dataclass(frozen=True, eq=False, slots=True)
class Tangents:
    """The k-th quadric of each part of a table, in the part's frame.

    Attributes:
        matrices: m^-2, exact. Shape (parts, 3, 3).
        centres: m. Shape (parts, 3).
        centre_errors: How far off they may be, m. Shape (parts, 3).
        roots: Upper bounds of the right-hand sides' roots; infinite where a part has no such quadric. Shape (parts,).
        values: Eigenvalues, in floats, for proposals. Shape (parts, 3).
        ways: Eigenvectors. Shape (parts, 3, 3).
    """

    matrices: Floats
    centres: Floats
    centre_errors: Floats
    roots: Floats
    values: Floats
    ways: Floats

    @classmethod
    def of(cls, quadrics: Sequence[Quadric | None]) -> Tangents:
        """Write quadrics as arrays; None where a part has none."""
        matrices, centres = np.zeros((len(quadrics), 3, 3)), np.zeros((len(quadrics), 3))
        errors, roots = np.zeros((len(quadrics), 3)), np.full(len(quadrics), NONE)
        for k, one in enumerate(quadrics):
            if one is None:
                continue
            matrices[k] = [[float(x) for x in row] for row in one.matrix]  # they were floats
            pairs = [nearest(x) for x in one.centre]
            centres[k], errors[k] = [value for value, _ in pairs], [error for _, error in pairs]
            roots[k] = np.nextafter(float(root_bounds(one.square)[1]), np.inf)
        values, ways = np.linalg.eigh(matrices)
        return cls(matrices, centres, errors, roots, np.maximum(values, 0.0), ways)

    def tangents(self, parts: Indices, places: Floats) -> HalfSpaces:
        """Return half-spaces that touch the quadrics near where they are nearest to places, in the parts' frame. Shape (n, 3)."""
        matrix, centre, root = self.matrices[parts], self.centres[parts], self.roots[parts]
        toward = _nearest_way(self.values[parts], self.ways[parts], root, places - centre)
        normal = np.einsum("nij,nj->ni", matrix, toward)
        error = np.einsum("nij,nj->ni", np.abs(matrix), np.abs(toward)) * gamma(5) + TINY
        square = np.einsum("ni,ni->n", normal, toward)
        square += np.einsum("ni,ni->n", error + gamma(5) * np.abs(normal), np.abs(toward))
        reach = root * np.sqrt(np.maximum(square, 0.0) * GROW) * GROW + TINY
        shift = np.einsum("ni,ni->n", normal, centre)
        off = np.einsum("ni,ni->n", error + gamma(5) * np.abs(normal), np.abs(centre) + self.centre_errors[parts])
        off += np.einsum("ni,ni->n", np.abs(normal), self.centre_errors[parts])
        none = (root >= NONE) | ~(np.abs(normal).max(axis=1) > 1e-150)
        bound = np.where(none, NONE, reach + shift)
        off = np.where(none, 0.0, off * GROW + gamma(3) * np.abs(bound) + TINY)
        normal[none], error[none] = 0.0, 0.0
        return HalfSpaces(normal[:, None], bound[:, None], error[:, None], off[:, None])


def _nearest_way(values: Floats, ways: Floats, root: Floats, offset: Floats) -> Floats:
    """Return the way from a quadric's centre to its point nearest to places, in floats. Shape (n, 3)."""
    own = np.einsum("nij,ni->nj", ways, offset)
    factor = np.zeros(len(own))
    for _ in range(_NEWTON):
        shrunk = 1.0 / (1.0 + factor[:, None] * values)
        level = np.sqrt(np.sum(values * (own * shrunk) ** 2, axis=1))
        open_ = level > root * (1 + 1e-15)
        if not open_.any():
            break
        slope = np.sum(values**2 * own**2 * shrunk**3, axis=1)
        factor = np.where(open_, factor + (level / root - 1.0) * level * root / np.maximum(slope, 1e-300), factor)
    return np.einsum("nij,nj->ni", ways, own / (1.0 + factor[:, None] * values))
