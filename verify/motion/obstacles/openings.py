"""Openings that lead through parts of obstacles: how far a path stays from their edges.

A point p m off the hoop's axis and d m before or behind all of the part is at least sqrt(d^2 + (opening - p)^2) from what is solid of
it; the greatest p of a hull is at one of its corners.

An opening may be oblique: then its near edge is closer than all of the part is along the axis, and faces tell more. What is solid has v.x <= b for
the part's half-spaces and every sum of them, and is R or more off the axis. So for any 0 <= l < 1 a point q is at least D from it,

    D^2 = 2 (v.q - b) - |v|^2 + l R^2 - l / (1 - l) |(q - v) across the axis|^2,

the least value of |x - q|^2 - l (|x across|^2 - R^2) + 2 (v.x - b) over all x. D^2 is concave in q, so that of a hull its corners tell the least.
For one half-space the best v and l give the distance exactly: the best l is 1 - s / R, s the distance of q - v from the axis, and
then D^2 = 2 (v.q - b) - |v|^2 + (R - s)^2 is concave in the weights of half-spaces, which are found by ascent.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from verify.arithmetic.balls import Floats, gamma
from verify.data.shapes.region import Hoop
from verify.data.shapes.solid_parts import SolidPart
from verify.motion.convex_bodies import ConvexPart, farthest
from verify.motion.obstacles.half_spaces import GROW, TINY, HalfSpaces, Hulls
from verify.motion.passages import unit_normal

BESIDE = 3
"""Half-spaces of a part that are weighed beside an opening."""
_SWEEPS = 3
"""Times that each half-space's weight has its turn."""
_SETTLED = 1e-9
"""m; weights that move by less are left."""
_NEWTON = 10
_ACROSS = 1e-15
"""Square of the sine of an angle that is none."""
_LEAST_SHARE = 2.0**-20
"""Of the opening: nearer to the axis no q - v is taken to be."""


@dataclass(frozen=True, eq=False, slots=True)
class Found:
    """Results for some hulls, each beside one part.

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
        least, most, widest = self._seen(offset, rad)
        beyond = np.maximum(np.min(least, axis=1) - self.ahead, -np.max(most, axis=1) - self.behind)
        beside = np.maximum(beyond * (1 - 2.0**-50), 0.0)
        inside = np.nextafter(self.hoop.opening - np.max(widest, axis=1), -np.inf)
        low = np.where(inside > 0, np.hypot(beside, np.maximum(inside, 0.0)) * (1 - 2.0**-50), inside)
        return Found(low, self._near(places))

    def is_slanted(self, rows: HalfSpaces, middle: Floats) -> NDArray[np.bool_]:
        """Tell beside which places half-spaces that are not across the axis may tell more than the part as a whole. Shape (n,).

        Args:
            rows: Of the part, n times, in its frame.
            middle: Places in the part's frame, m. Shape (n, 3).
        """
        over = np.einsum("nri,ni->nr", rows.normals, middle) - rows.bounds
        along = np.einsum("nri,i->nr", rows.normals, self.normal)
        squares = np.einsum("nri,nri->nr", rows.normals, rows.normals)
        near = over > -self.hoop.opening * np.sqrt(squares)
        return (near & (squares - along * along > _ACROSS * squares)).any(axis=1)

    def weights(self, rows: HalfSpaces, places: Floats, middle: Floats) -> tuple[Floats, Floats, Floats]:
        """Return weights of half-spaces that prove most of places near the opening, in floats.

        Args:
            rows: Of the part, n times, in its frame.
            places: m, world frame. Shape (n, 3).
            middle: The same places in the part's frame, m. Shape (n, 3).

        Returns:
            Weights, shape (n, rows); how far the places are so, m, shape (n,), below zero unknown; the points to which they are
            nearest, m, in the part's frame, shape (n, 3).
        """
        lengths = np.maximum(np.linalg.norm(rows.normals, axis=-1), 1e-150)
        units = rows.normals / lengths[..., None]
        over = (np.einsum("nri,ni->nr", rows.normals, middle) - rows.bounds) / lengths
        flat = units - np.einsum("nri,i->nr", units, self.normal)[..., None] * self.normal
        left = self._across(places - np.array(self.hoop.center))
        radius, weights, way = self.hoop.opening, np.zeros_like(over), np.zeros_like(places)
        for _ in range(_SWEEPS):
            moved = 0.0
            for k in range(over.shape[1]):
                way -= weights[:, k, None] * units[:, k]
                left += weights[:, k, None] * flat[:, k]
                room = over[:, k] - np.einsum("ni,ni->n", way, units[:, k])
                weight = _best_weight(room, left, flat[:, k], radius)
                moved = max(moved, float(np.abs(weight - weights[:, k]).max(initial=0.0)))
                weights[:, k] = weight
                way += weight[:, None] * units[:, k]
                left -= weight[:, None] * flat[:, k]
            if moved <= _SETTLED or np.count_nonzero(weights, axis=1).max(initial=0) < 2:
                break
        off = np.linalg.norm(left, axis=1)
        square = 2 * np.einsum("nr,nr->n", weights, over) - np.einsum("ni,ni->n", way, way) + np.maximum(radius - off, 0.0) ** 2
        nearest = middle - way + np.maximum(radius / np.maximum(off, 1e-12) - 1.0, 0.0)[:, None] * left
        return weights / lengths, np.where(square > 0, np.sqrt(np.maximum(square, 0.0)), -np.inf), nearest

    def apart_by(self, plane: HalfSpaces, hulls: Hulls, own: Hulls) -> Floats:
        """Return what one half-space of the part and the opening prove together of hulls, m; below zero nothing. Shape (n,).

        Args:
            plane: Of the part, n times, weighed, in its frame.
            hulls: n of them.
            own: The same in the part's frame.
        """
        normal, bound, error, loose = (
            part[:, 0] for part in (plane.normals, plane.bounds, plane.normal_errors, plane.bound_errors)
        )
        off = np.einsum("ni,ni->n", error + gamma(6) * np.abs(normal), own.size) + np.einsum(
            "ni,ni->n", np.abs(normal), own.rad
        )
        off = (off + loose + gamma(3) * np.abs(bound)) * GROW + TINY
        ahead = 2 * (np.einsum("ni,nik->nk", normal, own.mid) - bound[:, None] - off[:, None])
        square = (np.linalg.norm(normal, axis=1) * (1 + 2.0**-48) + error.sum(axis=1)) ** 2 * GROW
        offset = hulls.mid - np.array(self.hoop.center)[:, None]
        rad = (hulls.rad + error)[..., None] + gamma(3) * (np.abs(offset) + np.abs(normal)[..., None])
        widest = self._seen(offset - normal[..., None], rad * GROW + TINY)[2]
        radius = self.hoop.opening
        best = np.full(len(hulls), -np.inf)
        for reach in (np.max(widest, axis=1), np.mean(widest, axis=1)):
            share = 1.0 - np.clip(reach / radius, _LEAST_SHARE, 1.0)
            steep = share / (1.0 - share) * GROW
            inner, outer = share * radius * radius, steep[:, None] * widest * widest
            found = ahead - square[:, None] + inner[:, None] - outer
            found -= gamma(16) * (np.abs(ahead) + square[:, None] + inner[:, None] + outer) + TINY
            best = np.fmax(best, np.min(found, axis=1))
        return np.where(best > 0, np.sqrt(np.maximum(best, 0.0)) * (1 - 2.0**-50), -np.inf)

    def _seen(self, offset: Floats, rad: Floats) -> tuple[Floats, Floats, Floats]:
        """Bound where points beside the hoop's centre are along its axis, from below and above, and how far they are off it at the most.

        Args:
            offset: m. Shape (n, 3, corners).
            rad: Half the edges of the boxes in which they are, m. Same shape.

        Returns:
            m. Shape (n, corners) each.
        """
        size = np.abs(offset) + rad
        along = np.einsum("i,nik->nk", self.normal, offset)
        known = np.abs(self.normal) * gamma(6) + self.error
        off = (np.einsum("i,nik->nk", known, size) + np.einsum("i,nik->nk", np.abs(self.normal), rad)) * GROW + TINY
        across = offset - self.normal[:, None] * along[:, None]
        loose = rad + (np.abs(self.normal) + self.error)[:, None] * off[:, None] + self.error[:, None] * np.abs(along)[:, None]
        loose += gamma(4) * (size + np.abs(along)[:, None])
        widest = np.linalg.norm(across, axis=1) * (1 + 2.0**-48) + loose.sum(axis=1) * GROW
        return along - off, along + off, widest

    def _across(self, offset: Floats) -> Floats:
        return offset - (offset @ self.normal)[:, None] * self.normal

    def _near(self, places: Floats) -> Floats:
        offset = places - np.array(self.hoop.center)
        along = offset @ self.normal
        inside = self.hoop.opening - np.linalg.norm(self._across(offset), axis=1)
        beside = np.maximum(np.maximum(along - self.ahead, -along - self.behind), 0.0)
        return np.where(inside > 0, np.hypot(beside, inside), inside)


def _best_weight(room: Floats, left: Floats, flat: Floats, radius: float) -> Floats:
    """Return the w >= 0 with the greatest 2 room w - w^2 + (radius - |left - w flat|)^2, about, by Newton's method between bounds."""
    weights = np.zeros(len(room))
    index = np.flatnonzero(_slope(weights, room, left, flat, radius)[0] > 0)
    room, left, flat = room[index], left[index], flat[index]
    low, high = np.zeros(len(index)), np.maximum(room, 0.0) + radius
    at = np.minimum(np.maximum(room, 0.0), high)
    for _ in range(_NEWTON if len(index) else 0):
        slope, bend = _slope(at, room, left, flat, radius)
        low, high = np.where(slope > 0, at, low), np.where(slope > 0, high, at)
        following = at - slope / bend
        at = np.where((following >= low) & (following <= high), following, (low + high) / 2)
    weights[index] = at
    return weights


# five parameters: those of the quadratic
def _slope(weights: Floats, room: Floats, left: Floats, flat: Floats, radius: float) -> tuple[Floats, Floats]:
    """Return half of the slope of what is best weighed, and half of how that changes. Shape (n,) each."""
    beyond = left - weights[:, None] * flat
    off = np.maximum(np.sqrt(np.einsum("ni,ni->n", beyond, beyond)), 1e-12)
    along, size = np.einsum("ni,ni->n", beyond, flat), np.einsum("ni,ni->n", flat, flat)
    inside = off < radius
    pull = np.where(inside, (radius / off - 1.0) * along, 0.0)
    bend = np.where(inside, radius * along * along / off**3 - (radius / off - 1.0) * size, 0.0)
    return room - weights + pull, np.minimum(bend - 1.0, -1e-9)


def _above(value: Fraction) -> float:
    """Return a float that is surely above a rational, by a share that also covers a normal that is not quite a unit vector."""
    return float(np.nextafter(float(value) + abs(float(value)) * 2.0**-44, np.inf))
