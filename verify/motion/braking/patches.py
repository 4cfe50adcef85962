"""Bezier patches: where braking leads, over some instants at which it may begin and some shares of it.

On a piece the place is a polynomial of degree 7 in the instant and of degree 6 in the share of the braking (`courses`). In Bernstein
form in both it lies in the hull of its 8 x 7 coefficients, those at the corners are places that are reached, and either direction can be
halved. Coefficients are floats; one radius for each axis bounds how far they are off, every rounding counted
(`verify.arithmetic.balls` says how).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from verify.arithmetic.balls import Floats, gamma, halving
from verify.arithmetic.bounds import Indices
from verify.arithmetic.exact import fraction, rational
from verify.data.errors import BadInput
from verify.data.trajectory import DEGREE
from verify.motion.braking.braking_polynomials import weighted_sum, weights, weights_at
from verify.motion.paths import TeamPaths

SHARE_DEGREE = 6
"""Degree in the share of the braking."""

_GROW, _TINY = 1 + 2.0**-40, 1e-290
_FAR = 1e9
"""m; nobody brakes there."""

_POWERS = np.arange(DEGREE + 1)
_BINOMIALS = np.array([math.comb(DEGREE, k) for k in range(DEGREE + 1)], dtype=float)
_MIDDLE_SHARE = np.array([math.comb(SHARE_DEGREE, k) for k in range(SHARE_DEGREE + 1)]) / 2**SHARE_DEGREE

Flags = NDArray[np.bool_]
Point = tuple[Fraction, Fraction, Fraction]


@dataclass(frozen=True, eq=False, slots=True)
class Patches:
    """Parts of flights, and of the braking that begins there. n of them.

    Attributes:
        item: Index of what they are parts of: a segment, say. Shape (n,).
        place: Where in it the instants begin, from 0 to 1. Shape (n,).
        length: How much of it they are. Shape (n,).
        share: Where in the braking the shares begin, from 0 to 1. Shape (n,).
        width: How much of the braking they are. Shape (n,).
        mid: Coefficients of x, y and z, m. Shape (n, 3, 7, 8): by share, then by instant.
        rad: How far each of them may be off, m. Shape (n, 3).
    """

    item: Indices
    place: Floats
    length: Floats
    share: Floats
    width: Floats
    mid: Floats
    rad: Floats

    def __len__(self) -> int:
        return len(self.item)

    def __getitem__(self, index: Indices | Flags | slice) -> Patches:
        return Patches(
            self.item[index], self.place[index], self.length[index], self.share[index], self.width[index], self.mid[index], self.rad[index]
        )  # fmt: skip

    @property
    def low(self) -> Floats:
        """Least coordinates, m. Shape (n, 3)."""
        return np.nextafter(self.mid.min(axis=(2, 3)) - self.rad, -np.inf)

    @property
    def high(self) -> Floats:
        """Greatest coordinates, m. Shape (n, 3)."""
        return np.nextafter(self.mid.max(axis=(2, 3)) + self.rad, np.inf)

    @property
    def size(self) -> Floats:
        """Approximate size of coordinates, m. Shape (n, 3)."""
        return np.abs(self.mid).max(axis=(2, 3))

    @property
    def extents(self) -> tuple[Floats, Floats]:
        """Approximate extents of patches along instants, and along shares, m. Shape (n,) each."""
        return np.ptp(self.mid, axis=3).max(axis=(1, 2)), np.ptp(self.mid, axis=2).max(axis=(1, 2))

    def halved_in_time(self) -> Patches:
        """Return the earlier halves, then the later ones."""
        mid = np.moveaxis((self.mid @ halving(DEGREE)).reshape(len(self), 3, SHARE_DEGREE + 1, 2, DEGREE + 1), 3, 0)
        length, rad = self.length / 2, self._halves_rad(DEGREE)
        return Patches(
            np.tile(self.item, 2), np.concatenate([self.place, self.place + length]), np.tile(length, 2), np.tile(self.share, 2),
            np.tile(self.width, 2), mid.reshape(-1, *self.mid.shape[1:]), rad,
        )  # fmt: skip

    def halved_in_share(self) -> Patches:
        """Return the halves that are sooner in the braking, then the others."""
        split = halving(SHARE_DEGREE).T.reshape(2, SHARE_DEGREE + 1, SHARE_DEGREE + 1)
        mid = np.concatenate([half @ self.mid for half in split])
        width, rad = self.width / 2, self._halves_rad(SHARE_DEGREE)
        return Patches(
            np.tile(self.item, 2), np.tile(self.place, 2), np.tile(self.length, 2), np.concatenate([self.share, self.share + width]),
            np.tile(width, 2), mid, rad,
        )  # fmt: skip

    def centres(self) -> Floats:
        """Return where braking leads from their middle instants at their middle shares, in floats, m. Shape (n, 3)."""
        return np.einsum("nist,s,t->ni", self.mid, _MIDDLE_SHARE, _BINOMIALS / 2**DEGREE)

    def at(self, places: Floats) -> Floats:
        """Return where braking leads from some instants, at the first and at the last share, in floats, m. Shape (k, n, 3, 2).

        Args:
            places: Where in each patch the instants are, from 0 to 1. Shape (k, n).
        """
        return np.einsum("nist,knt->knis", self.mid[:, :, ::SHARE_DEGREE], _basis(places[..., None]))

    def twice(self) -> Patches:
        """Return them, and once more."""
        return joined([self, self])

    def spans(self, times: Callable[[Patches], tuple[Floats, Floats]]) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return between which instants all of them lie, s, and between which shares.

        Args:
            times: Tells when patches begin and end.
        """
        start, stop = times(self)
        return (float(start.min()), float(stop.max())), (float(self.share.min()), float((self.share + self.width).max()))

    def require_finite(self) -> None:
        """Reject what cannot be computed.

        Raises:
            BadInput: Coefficients are too large.
        """
        if not (np.all(self.size < _FAR) and np.all(self.rad < _FAR)):
            raise BadInput("These coefficients are too large to bound braking.")

    def _halves_rad(self, degree: int) -> Floats:
        """Bound what the coefficients of halves are off: they are means of these, in exact shares, rounded."""
        rad = (self.rad + gamma(degree + 2) * self.size) * _GROW + _TINY
        return np.concatenate([rad, rad])

    def scaled(self, axis: int, factor: Fraction) -> Patches:
        """Return the same with one coordinate multiplied.

        Args:
            axis: Which.
            factor: By what.
        """
        number = float(factor)
        mid, rad = self.mid.copy(), self.rad.copy()
        mid[:, axis] *= number
        rad[:, axis] = rad[:, axis] * abs(number) + 2.0**-51 * np.abs(mid[:, axis]).max(axis=(1, 2))
        return replace(self, mid=mid, rad=rad * _GROW + _TINY)


def shortened(parts: Patches, seconds: Floats, longest: float) -> Patches:
    """Return patches halved in time until none takes longer than is said.

    Args:
        parts: Whose items index the seconds.
        seconds: How long each item takes, s.
        longest: s.
    """
    short: list[Patches] = []
    while len(parts):
        long_ = seconds[parts.item] * parts.length > longest
        short.append(parts[~long_])
        parts = parts[long_].halved_in_time()
    return joined(short)


def _basis(places: Floats) -> Floats:
    """Return Bernstein's polynomials of the instant at places. Shape (..., 1) to (..., 8)."""
    return _BINOMIALS * places**_POWERS * (1 - places) ** (DEGREE - _POWERS)


def joined(parts: Sequence[Patches]) -> Patches:
    """Return several patches as one value, in order."""
    return Patches(
        np.concatenate([one.item for one in parts]),
        np.concatenate([one.place for one in parts]),
        np.concatenate([one.length for one in parts]),
        np.concatenate([one.share for one in parts]),
        np.concatenate([one.width for one in parts]),
        np.concatenate([one.mid for one in parts]),
        np.concatenate([one.rad for one in parts]),
    )


@np.errstate(all="ignore")
def patches_of(paths: TeamPaths, length: Fraction) -> Patches:
    """Return all of the braking from each segment. A robot that hovers stays; braking from a step lies between that from its two ends.

    Args:
        paths: What is flown.
        length: L, s that braking takes.
    """
    pieces = [paths.derivative(0)[:, :3] + weighted_sum(paths, row) for row in weights(length, Fraction(0), Fraction(1))]
    mid, rad = (np.stack([getattr(piece, part) for piece in pieces], axis=2) for part in ("mid", "rad"))
    count, size = len(paths.segments), (3, SHARE_DEGREE + 1, DEGREE + 1)
    all_mid, all_rad = np.empty((count, *size)), np.empty((count, 3))
    all_mid[paths.piece_segments], all_rad[paths.piece_segments] = mid, rad.max(axis=(2, 3))
    row_of = {(s.robot, s.piece): row for row, s in enumerate(paths.segments[i] for i in paths.piece_segments)}
    along = np.arange(DEGREE + 1) / DEGREE
    still = paths.positions
    for i, segment in enumerate(paths.segments):
        if segment.kind == "hover" or (segment.kind == "step" and segment.piece < 0):
            start = np.repeat(still.mid[i, :, :1], SHARE_DEGREE + 1, axis=1)
            error = still.rad[i].max(axis=1)
        elif segment.kind == "step":
            row = row_of[segment.robot, segment.piece]
            start, error = mid[row, :, :, -1], rad[row, :, :, -1].max(axis=1)
        else:
            continue
        stop = start
        if segment.kind == "step":
            row = row_of[segment.robot, segment.after]
            stop, error = mid[row, :, :, 0], np.maximum(error, rad[row, :, :, 0].max(axis=1))
        all_mid[i] = start[..., None] + (stop - start)[..., None] * along
        # the line's own rounding: a difference, a quotient, a product and a sum
        all_rad[i] = (error + 8 * 2.0**-53 * (np.abs(start) + np.abs(stop)).max(axis=1)) * _GROW + _TINY
    ones, none = np.ones(count), np.zeros(count)
    return Patches(np.arange(count), none, ones, none, ones, all_mid, all_rad)


def exact_place(paths: TeamPaths, length: Fraction, segment: int, place: Fraction, share: Fraction) -> Point:
    """Return without rounding where a robot is in a braking.

    Args:
        paths: What is flown.
        length: L, s that braking takes.
        segment: Index of the segment in which it begins.
        place: Where in it, from 0 to 1.
        share: Share of the braking.
    """
    flown = paths.segments[segment]
    if flown.kind != "step":
        return _braked(paths, length, segment, place, share)
    start = _braked(paths, length, segment if flown.piece < 0 else segment - 1, Fraction(flown.piece >= 0), share)
    after = next(
        i
        for i, other in enumerate(paths.segments)
        if (other.robot, other.kind, other.piece) == (flown.robot, "piece", flown.after)
    )
    stop = _braked(paths, length, after, Fraction(0), share)
    x, y, z = (a + (b - a) * place for a, b in zip(start, stop, strict=True))
    return x, y, z


def _braked(paths: TeamPaths, length: Fraction, segment: int, place: Fraction, share: Fraction) -> Point:
    flown = paths.segments[segment]
    moves = weights_at(length, share) if flown.kind == "piece" else ()
    found: list[Fraction] = []
    for polynomial in paths.exact_position(segment):
        value, seconds = fraction(polynomial(rational(place))), flown.stop - flown.start
        for order, weight in enumerate(moves, 1):
            polynomial = polynomial.derivative()
            value += weight * fraction(polynomial(rational(place))) / seconds**order
        found.append(value)
    return found[0], found[1], found[2]
