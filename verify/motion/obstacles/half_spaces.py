"""Proved distances of paths to convex parts: one plane separates the path between two places from a part.

Whatever weights w >= 0 are given to a part's half-spaces l.x <= b, all of its points have (sum w l).x <= sum w b. So a point's distance
from the part is at least (sum w l).x - sum w b over |sum w l|, and with the weights of the nearest point it is exactly that, at
faces, edges and corners alike. A quadric has half-spaces of its own, its tangents: by Cauchy and Schwarz u'Q(x - c) <= sqrt(B u'Qu) for
every u. Weights and tangents are found in floats for one place of a path; what they prove holds for all of it, since a polynomial
lies in the hull of its Bernstein coefficients and what a plane parts from them it parts from the path. Every bound is rounded to
the strict side (`verify.arithmetic.balls` says how radii are counted).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Floats, gamma
from verify.arithmetic.bounds import Indices

NONE = 1e300
"""The bound of a half-space that is none."""
GROW = 1.0 + 2.0**-40
TINY = 1e-290
_KEPT = 12
"""Of a part with many faces the farthest so many are weighed against each other."""
_SWEEPS, _TURNS = 3, 200
"""Weights that are not settled after so many sweeps, nor where the planes of the greatest meet, are swept by themselves, so many times."""
_SETTLED = 1e-8
"""m; what weights that are off by so much lose is of second order."""


@dataclass(frozen=True, eq=False, slots=True)
class Hulls:
    """Points, or the corners of what holds a path's part: each corner anywhere within a box.

    Attributes:
        mid: m, world frame. Shape (n, 3, corners).
        rad: Half the edges of the largest of its boxes, m. Shape (n, 3).
    """

    mid: Floats
    rad: Floats

    @classmethod
    def points(cls, places: Floats) -> Hulls:
        """Return points. Shape (n, 3)."""
        return cls(places[..., None], np.zeros(places.shape))

    def beside(self, centres: Floats) -> Hulls:
        """Return them in other frames. Shape (n, 3)."""
        mid = self.mid - centres[..., None]
        return Hulls(mid, (self.rad + gamma(2) * np.abs(mid).max(axis=-1)) * GROW + TINY)

    @property
    def size(self) -> Floats:
        """Bound on coordinates, m. Shape (n, 3)."""
        return (np.abs(self.mid).max(axis=-1) + self.rad) * GROW

    def __getitem__(self, index: Indices) -> Hulls:
        return Hulls(self.mid[index], self.rad[index])

    def __len__(self) -> int:
        return len(self.mid)


@dataclass(frozen=True, eq=False, slots=True)
class HalfSpaces:
    """Half-spaces normal . x <= bound in a part's frame: exact up to the errors. Shapes (n, rows, 3) and (n, rows)."""

    normals: Floats
    bounds: Floats
    normal_errors: Floats
    bound_errors: Floats

    def joined(self, other: HalfSpaces) -> HalfSpaces:
        """Return these and others of the same parts."""
        return HalfSpaces(
            np.concatenate([self.normals, other.normals], axis=1),
            np.concatenate([self.bounds, other.bounds], axis=1),
            np.concatenate([self.normal_errors, other.normal_errors], axis=1),
            np.concatenate([self.bound_errors, other.bound_errors], axis=1),
        )

    def of(self, parts: Indices) -> HalfSpaces:
        """Return those of some parts."""
        return HalfSpaces(self.normals[parts], self.bounds[parts], self.normal_errors[parts], self.bound_errors[parts])

    def kept(self, rows: Indices) -> HalfSpaces:
        """Return some rows of each. Shape (n, kept)."""
        deep = rows[..., None]
        return HalfSpaces(
            np.take_along_axis(self.normals, deep, 1),
            np.take_along_axis(self.bounds, rows, 1),
            np.take_along_axis(self.normal_errors, deep, 1),
            np.take_along_axis(self.bound_errors, rows, 1),
        )


def apart_by_one(rows: HalfSpaces, hulls: Hulls, places: Floats) -> tuple[Floats, Floats]:
    """Return what single half-spaces prove, and how far places are from the farthest one, in floats.

    Args:
        rows: Of n parts.
        hulls: n of them, in the parts' frames.
        places: One place of each, m. Shape (n, 3).

    Returns:
        m. Shape (n,) each.
    """
    size, rad = hulls.size, hulls.rad
    least = np.min(np.matmul(rows.normals, hulls.mid), axis=-1) - rows.bounds
    loose = np.abs(rows.normals)
    off = np.einsum("nri,ni->nr", loose * gamma(6) + rows.normal_errors, size) + np.einsum("nri,ni->nr", loose, rad)
    off += rows.bound_errors + gamma(3) * np.abs(rows.bounds)
    least -= off * GROW + TINY
    lengths = np.linalg.norm(rows.normals, axis=-1)
    doubt = rows.normal_errors.sum(axis=-1)
    most, fewest = lengths * (1 + 2.0**-49) + doubt, np.maximum(lengths * (1 - 2.0**-49) - doubt, TINY)
    apart = np.where(least > 0, least / most * (1 - 2.0**-51), least / fewest * (1 + 2.0**-51))
    at = np.einsum("nri,ni->nr", rows.normals, places) - rows.bounds
    return np.max(apart, axis=1), np.max(at / np.maximum(lengths, 1e-150), axis=1)


def farthest_of(rows: HalfSpaces, places: Floats, count: int = _KEPT) -> HalfSpaces:
    """Return of each part the half-spaces that are farthest from places, where there are many.

    Args:
        rows: Of n parts.
        places: m. Shape (n, 3).
        count: How many.
    """
    if rows.bounds.shape[1] <= count:
        return rows
    lengths = np.maximum(np.linalg.norm(rows.normals, axis=-1), 1e-150)
    at = (np.einsum("nri,ni->nr", rows.normals, places) - rows.bounds) / lengths
    return rows.kept(np.argpartition(-at, count - 1, axis=1)[:, :count])


def weights_of(rows: HalfSpaces, places: Floats) -> tuple[Floats, Floats]:
    """Return the half-spaces' weights at the point of their intersection that is nearest to places, in floats.

    Hildreth's method: each weight in turn becomes what brings the place onto its own plane, or zero. At sharp edges that settles slowly,
    but says soon which planes meet in the nearest point.

    Args:
        rows: Of n parts.
        places: m. Shape (n, 3).

    Returns:
        Weights of the rows, shape (n, rows), and the way back from the places to the nearest points, shape (n, 3).
    """
    lengths = np.maximum(np.linalg.norm(rows.normals, axis=-1), 1e-150)
    units = rows.normals / lengths[..., None]
    over = (np.einsum("nri,ni->nr", rows.normals, places) - rows.bounds) / lengths
    weights, back = np.zeros_like(over), np.zeros_like(places)
    settled = _SETTLED + 2.0**-40 * np.abs(places).max(axis=1)
    open_ = np.arange(len(places))
    for _ in range(_TURNS):
        weights[open_], back[open_], moved = _swept(units[open_], over[open_], weights[open_], back[open_])
        open_ = open_[moved > settled[open_]]
        if not len(open_):
            break
        for count in (3, 2):
            met, way = _at_meeting(units[open_], over[open_], weights[open_], count)
            left = over[open_] - np.einsum("nri,ni->nr", units[open_], way)
            on = np.where(met > 0, np.abs(left), left).max(axis=1) <= settled[open_]  # on its planes, and beyond no other
            found = on & (met >= 0).all(axis=1)
            weights[open_[found]], back[open_[found]] = met[found], way[found]
            open_ = open_[~found]
        if not len(open_):
            break
    several = np.flatnonzero(np.count_nonzero(weights > 0, axis=1) > 1)
    met, way = _at_meeting(units[several], over[several], weights[several], 3)
    better = (met >= 0).all(axis=1) & (np.einsum("ni,ni->n", way, way) > np.einsum("ni,ni->n", back[several], back[several]))
    weights[several[better]], back[several[better]] = met[better], way[better]
    return weights / lengths, back


def _at_meeting(units: Floats, over: Floats, weights: Floats, count: int) -> tuple[Floats, Floats]:
    """Return weights at the point in which the planes of the greatest so many weights meet, below zero too, and the way back to it."""
    rows = np.argsort(-weights, axis=1)[:, :count]
    most = np.take_along_axis(weights, rows, 1)
    chosen = np.take_along_axis(units, rows[..., None], 1) * (most > 0)[..., None]
    gram = np.einsum("nri,nsi->nrs", chosen, chosen) + (1e-14 + (most <= 0))[..., None] * np.eye(rows.shape[1])
    found = np.linalg.solve(gram, (np.take_along_axis(over, rows, 1) * (most > 0))[..., None])[..., 0]
    way = np.einsum("nr,nri->ni", found, chosen)
    kept = np.zeros_like(weights)
    np.put_along_axis(kept, rows, found, 1)
    return kept, way


def _swept(units: Floats, over: Floats, weights: Floats, back: Floats) -> tuple[Floats, Floats, Floats]:
    """Give each weight its turn a few times, and say how much the last time moved any of each place's."""
    order = np.argsort(-over.max(axis=0))
    moved = np.zeros(len(over))
    for _ in range(_SWEEPS):
        moved[:] = 0.0
        for k in order.tolist():
            unit = units[:, k]
            wanted = np.maximum(weights[:, k] + over[:, k] - np.einsum("ni,ni->n", unit, back), 0.0)
            step = wanted - weights[:, k]
            if step.any():
                weights[:, k] = wanted
                back += step[:, None] * unit
                moved = np.maximum(moved, np.abs(step))
        if not np.any(moved > _SETTLED):
            break
    return weights, back, moved


def weighed(rows: HalfSpaces, weights: Floats) -> HalfSpaces:
    """Return the one half-space of each part that its own with these weights come to.

    Args:
        rows: Of n parts.
        weights: Not negative. Shape (n, rows).
    """
    normal = np.einsum("nr,nri->ni", weights, rows.normals)
    chain = gamma(weights.shape[1] + 3)
    error = np.einsum("nr,nri->ni", weights, chain * np.abs(rows.normals) + rows.normal_errors) * GROW + TINY
    bound = np.einsum("nr,nr->n", weights, rows.bounds)
    off = np.einsum("nr,nr->n", weights, chain * np.abs(rows.bounds) + rows.bound_errors) * GROW + TINY
    return HalfSpaces(normal[:, None], bound[:, None], error[:, None], off[:, None])


def apart_by(plane: HalfSpaces, hulls: Hulls, places: Floats) -> tuple[Floats, Floats]:
    """Return what one half-space of each part proves of a hull, below zero nothing, and how far places are from it, in floats.

    Args:
        plane: Of n parts.
        hulls: n of them, in the parts' frames.
        places: One place of each, m. Shape (n, 3).

    Returns:
        m. Shape (n,) each.
    """
    normal, bound, error, off = (part[:, 0] for part in (plane.normals, plane.bounds, plane.normal_errors, plane.bound_errors))
    size, rad = hulls.size, hulls.rad
    least = np.min(np.einsum("ni,nik->nk", normal, hulls.mid), axis=1) - bound
    loose = np.einsum("ni,ni->n", error + gamma(6) * np.abs(normal), size) + np.einsum("ni,ni->n", np.abs(normal), rad)
    least -= (loose + off + gamma(3) * np.abs(bound)) * GROW
    size = np.linalg.norm(normal, axis=1)
    length = size * (1 + 2.0**-49) + error.sum(axis=1)
    at = (np.einsum("ni,ni->n", normal, places) - bound) / np.maximum(size, 1e-150)
    return np.where(least > 0, least / length * (1 - 2.0**-51), -np.inf), at
