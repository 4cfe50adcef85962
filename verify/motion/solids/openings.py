"""Openings that lead through parts of obstacles: how far a path stays from their edges.

A point p m off the hoop's axis and d m before or behind all of the part is at least sqrt(d^2 + (opening - p)^2) from what is solid of
it; the greatest p of a hull is at one of its corners.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from verify.arithmetic.balls import Floats, gamma
from verify.data.shapes.region import Hoop
from verify.data.shapes.solid_parts import SolidPart
from verify.motion.convex_bodies import ConvexPart, farthest
from verify.motion.passages import unit_normal
from verify.motion.solids.half_spaces import GROW, TINY, Hulls


@dataclass(frozen=True, eq=False, slots=True)
class Found:
    """What is known of some hulls, each beside one part.

    Attributes:
        low: Proved: no point of the hull is nearer to what is solid, m; below zero nothing is. Shape (n,).
        near: About how near the hull's chosen place is, m; below zero how deep it lies inside. Shape (n,).
    """

    low: Floats
    near: Floats


@dataclass(frozen=True, eq=False, slots=True)
class Opening:
    """An opening that leads through a part.

    Attributes:
        hoop: Whose.
        normal: Of the hoop, as stored. Shape (3,).
        error: How far each part of it is off the unit vector's. Shape (3,).
        ahead: How far the part reaches along the normal from the hoop's centre, at most, m.
        behind: Against it.
    """

    hoop: Hoop
    normal: Floats
    error: Floats
    ahead: float
    behind: float

    @classmethod
    def of(cls, part: SolidPart, hoop: Hoop) -> Opening:
        """Look how far the part reaches before and behind the hoop."""
        normal, error = unit_normal(hoop)
        whole = ConvexPart(part.center, part.inequalities)
        reaches: list[float] = []
        for sign in (1, -1):
            x, y, z = (sign * Fraction(n) for n in normal.tolist())
            reach = farthest(whole, (x, y, z))
            at = sum((n * Fraction(c) for n, c in zip((x, y, z), hoop.center, strict=True)), Fraction(0))
            reaches.append(np.inf if reach is None else _above(reach - at))
        return cls(hoop, normal, error, *reaches)

    def distances(self, hulls: Hulls, places: Floats) -> Found:
        """Return how far hulls stay from what is solid of the part, before, behind and within the opening.

        Args:
            hulls: n of them.
            places: One place of each, m. Shape (n, 3).
        """
        offset = hulls.mid - np.array(self.hoop.center)[:, None]
        rad = (hulls.rad[..., None] + gamma(2) * np.abs(offset)) * GROW + TINY
        size = np.abs(offset) + rad
        along = np.einsum("i,nik->nk", self.normal, offset)
        known = np.abs(self.normal) * gamma(6) + self.error
        off = (np.einsum("i,nik->nk", known, size) + np.einsum("i,nik->nk", np.abs(self.normal), rad)) * GROW + TINY
        beyond = np.maximum(np.min(along - off, axis=1) - self.ahead, -np.max(along + off, axis=1) - self.behind)
        beside = np.maximum(beyond * (1 - 2.0**-50), 0.0)
        across = offset - self.normal[:, None] * along[:, None]
        loose = rad + (np.abs(self.normal) + self.error)[:, None] * off[:, None] + self.error[:, None] * np.abs(along)[:, None]
        loose += gamma(4) * (size + np.abs(along)[:, None])
        widest = np.max(np.linalg.norm(across, axis=1) * (1 + 2.0**-48) + loose.sum(axis=1) * GROW, axis=1)
        inside = np.nextafter(self.hoop.opening - widest, -np.inf)
        low = np.where(inside > 0, np.hypot(beside, np.maximum(inside, 0.0)) * (1 - 2.0**-50), inside)
        return Found(low, self._near(places))

    def _near(self, places: Floats) -> Floats:
        offset = places - np.array(self.hoop.center)
        along = offset @ self.normal
        inside = self.hoop.opening - np.linalg.norm(offset - along[:, None] * self.normal, axis=1)
        beside = np.maximum(np.maximum(along - self.ahead, -along - self.behind), 0.0)
        return np.where(inside > 0, np.hypot(beside, inside), inside)


def _above(value: Fraction) -> float:
    """Return a float that is surely above a rational, by a share that also covers a normal that is not quite a unit vector."""
    return float(np.nextafter(float(value) + abs(float(value)) * 2.0**-44, np.inf))
