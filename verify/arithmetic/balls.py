"""Polynomials in Bernstein form whose float coefficients carry proved error bounds, many at a time.

A polynomial of degree n on [0, 1] lies between the least and the greatest of its n + 1 Bernstein coefficients, and
halving the interval tightens that quickly: this is how the checker knows something for *all* times. Here every
coefficient is a ball, a float64 `mid` and a radius `rad`, and each operation adds to the radius what rounding can
have done (Higham, Accuracy and Stability of Numerical Algorithms, section 3.1): a sum of k products, in any order
and fused or not, is off by at most gamma(k) = k u / (1 - k u) times the sum of their magnitudes, with u = 2^-53.
The radii are themselves computed in floats, so each is widened by `_GROW`; `_TINY` covers underflow. Overflow
gives infinities or NaN, which prove nothing: every test on balls is written so that NaN means "not proved", and
the public functions that work on them switch numpy's warnings off for that reason.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_U = 2.0**-53
_GROW = 1.0 + 2.0**-40  # covers the rounding of up to thousands of operations inside one radius
_TINY = 1e-290


def gamma(operations: int) -> float:
    """Return an upper bound on the relative error of a chain of that many rounded operations."""
    return operations * _U * (1.0 + 2.0**-20)


@dataclass(frozen=True, slots=True)
class Balls:
    """Polynomials on [0, 1] in Bernstein form; coefficient i lies within `rad[..., i]` of `mid[..., i]`.

    Attributes:
        mid: Shape (..., degree + 1).
        rad: The same shape, not negative (or NaN or infinite: nothing is known).
    """

    mid: Floats
    rad: Floats

    @property
    def degree(self) -> int:
        """Degree of all the polynomials."""
        return self.mid.shape[-1] - 1

    @property
    def low(self) -> Floats:
        """Lower bounds of the coefficients."""
        return np.nextafter(self.mid - self.rad, -np.inf)

    @property
    def high(self) -> Floats:
        """Upper bounds of the coefficients."""
        return np.nextafter(self.mid + self.rad, np.inf)

    def __getitem__(self, index: object) -> Balls:
        return Balls(self.mid[index], self.rad[index])  # pyright: ignore[reportArgumentType, reportCallIssue]  # numpy's own index types

    def __neg__(self) -> Balls:
        return Balls(-self.mid, self.rad)

    def __add__(self, other: Balls) -> Balls:
        mid = self.mid + other.mid
        return Balls(mid, (self.rad + other.rad + _U * np.abs(mid)) * _GROW + _TINY)

    def __sub__(self, other: Balls) -> Balls:
        mid = self.mid - other.mid
        return Balls(mid, (self.rad + other.rad + _U * np.abs(mid)) * _GROW + _TINY)

    def __mul__(self, other: Balls) -> Balls:
        return _product(self, other, 1)

    def scaled(self, factor: Floats | float, error: Floats | float = 0.0) -> Balls:
        """Return the polynomials times constants known within `error`; these broadcast against `mid`."""
        mid = self.mid * factor
        rad = self.rad * (np.abs(factor) + error) + np.abs(self.mid) * error + _U * np.abs(mid)
        return Balls(mid, rad * _GROW + _TINY)

    def reshape(self, *shape: int) -> Balls:
        """Return the same polynomials in another arrangement."""
        return Balls(self.mid.reshape(shape), self.rad.reshape(shape))


def constants(values: Floats | float, error: Floats | float = 0.0) -> Balls:
    """Return constants as polynomials of degree 0. Shape (...) to (..., 1)."""
    mid = np.asarray(values, dtype=np.float64)[..., None]
    return Balls(mid, np.broadcast_to(np.asarray(error, dtype=np.float64)[..., None] if np.ndim(error) else error, mid.shape))


def nearest(value: Fraction) -> tuple[float, float]:
    """Return the float nearest to a rational and a bound on how far off it is (infinite where it overflows)."""
    ratio = value.as_integer_ratio()
    try:
        number = ratio[0] / ratio[1]  # of whole numbers: rounded once
    except OverflowError:
        return math.inf, math.inf
    return number, 0.0 if number.as_integer_ratio() == ratio else abs(number) * _U + _TINY


def from_power(coefficients: Floats, lengths: Floats) -> Balls:
    """Enclose polynomials given by ascending powers of t in [0, length], as polynomials in u = t / length.

    Args:
        coefficients: Each known up to 4 roundings (exact, or derived from exact ones by integer factors).
            Shape (..., degree + 1).
        lengths: Exact. Shape broadcastable to (...).
    """
    degree = coefficients.shape[-1] - 1
    powers = np.cumprod(np.concatenate([np.ones((*lengths.shape, 1)), np.repeat(lengths[..., None], degree, -1)], -1), -1)
    scaled = coefficients * powers
    basis = _power_to_bernstein(degree)
    # 4 roundings in the coefficient, degree - 1 in the powers, 1 in their product, 2 with the basis, degree in the sum;
    # a power that underflows is off by a little in itself, so its coefficient's size counts
    lost = 1e-300 * np.abs(coefficients).sum(-1, keepdims=True)
    rad = (np.abs(scaled) @ basis * gamma(2 * degree + 7) + lost) * _GROW + _TINY
    return Balls(scaled @ basis, rad)


def dot(a: Balls, b: Balls) -> Balls:
    """Return the inner products over the last axis but one. Shapes (..., k, n + 1), (..., k, m + 1) to (..., n + m + 1)."""
    return _product(a, b, a.mid.shape[-2])


def root_up(value: float) -> float:
    """Return the square root of a number, rounded up; of one below zero that of zero."""
    return float(np.nextafter(np.sqrt(max(value, 0.0)), np.inf))


def concatenate(parts: Sequence[Balls]) -> Balls:
    """Join polynomials of one degree along the first axis."""
    return Balls(np.concatenate([p.mid for p in parts]), np.concatenate([p.rad for p in parts]))


def raised(a: Balls, degree: int) -> Balls:
    """Return the same polynomials written with a higher degree."""
    if degree == a.degree:
        return a
    one = Balls(np.ones(degree - a.degree + 1), np.zeros(degree - a.degree + 1))
    return _product(a, one, 1)


def halves(a: Balls) -> Balls:
    """Return left and right halves, each as a polynomial on [0, 1] again. Shape (k, ..., n + 1) to (2 k, ...), lefts first."""
    split = halving(a.degree)
    inner = a.rad + gamma(a.degree + 2) * np.abs(a.mid)
    count, *rest = a.mid.shape

    def parted(values: Floats) -> Floats:
        both = (values @ split).reshape(count, *rest[:-1], 2, a.degree + 1)
        return np.moveaxis(both, -2, 0).reshape(2 * count, *rest)

    return Balls(parted(a.mid), parted(inner) * _GROW + _TINY)


def restricted(a: Balls, starts: Sequence[Fraction], stops: Sequence[Fraction]) -> Balls:
    """Return each polynomial on its part [start, stop] of [0, 1], as a polynomial on [0, 1] again.

    Args:
        a: Shape (k, ..., n + 1).
        starts: Exact, k of them, at least 0 and below 1.
        stops: Exact, each above its start and at most 1.
    """
    ahead = _parameters(starts, a)
    share = _parameters([_share(start, stop) for start, stop in zip(starts, stops, strict=True)], a)
    return restricted_by(a, ahead, share)


def _share(start: Fraction, stop: Fraction) -> Fraction:
    """Return (stop - start) / (1 - start), as one quotient of whole numbers."""
    (p, q), (r, s) = start.as_integer_ratio(), stop.as_integer_ratio()
    return Fraction(r * q - p * s, s * (q - p))


def restricted_by(a: Balls, ahead: Balls, share: Balls) -> Balls:
    """Return each polynomial on a part of [0, 1], as a polynomial on [0, 1] again.

    Args:
        a: Shape (k, ..., n + 1).
        ahead: How much of [0, 1] lies before the part. Broadcasts against `a`.
        share: How much of what lies after that the part takes. Broadcasts against `a`.
    """
    kept = []
    row = a
    for _ in range(a.degree + 1):  # de Casteljau at `start`: the last coefficients of the rows are those of [start, 1]
        kept.append(row[..., -1:])
        if row.degree:
            row = _blend(row, ahead)
    row = Balls(np.concatenate([k.mid for k in reversed(kept)], -1), np.concatenate([k.rad for k in reversed(kept)], -1))
    kept = []
    for _ in range(a.degree + 1):  # and the first ones those of the left part
        kept.append(row[..., :1])
        if row.degree:
            row = _blend(row, share)
    return Balls(np.concatenate([k.mid for k in kept], -1), np.concatenate([k.rad for k in kept], -1))


def _parameters(values: Sequence[Fraction], like: Balls) -> Balls:
    pairs = np.array([nearest(value) for value in values]).reshape(-1, 2)
    shape = (len(values), *(1 for _ in like.mid.shape[1:]))
    return Balls(pairs[:, 0].reshape(shape), pairs[:, 1].reshape(shape))


def _blend(a: Balls, at: Balls) -> Balls:
    """One step of de Casteljau: (1 - at) c_i + at c_(i+1)."""
    first, second = a[..., :-1], a[..., 1:]
    step = second - first
    mid = step.mid * at.mid
    rad = step.rad * (np.abs(at.mid) + at.rad) + np.abs(step.mid) * at.rad + _U * np.abs(mid)
    return first + Balls(mid, rad * _GROW + _TINY)


def _product(a: Balls, b: Balls, terms: int) -> Balls:
    n, m = a.degree, b.degree
    weights = _product_weights(n, m, terms)
    size_a, size_b = np.abs(a.mid), np.abs(b.mid)
    # each output coefficient sums `terms * (min(n, m) + 1)` products of three factors, the weight rounded once
    chain = gamma(terms * (min(n, m) + 1) + 3)
    mid = _outer(a.mid, b.mid, terms) @ weights
    spread = _outer(a.rad, size_b + b.rad, terms) + _outer(size_a, b.rad + chain * size_b, terms)
    return Balls(mid, (spread @ weights) * _GROW + _TINY)


def _outer(a: Floats, b: Floats, terms: int) -> Floats:
    outer = a[..., :, None] * b[..., None, :]
    kept = outer.ndim - (2 if terms == 1 else 3)
    return outer.reshape(*outer.shape[:kept], -1)


@cache
def _power_to_bernstein(degree: int) -> Floats:
    rows = [
        [float(Fraction(math.comb(i, k), math.comb(degree, k))) if k <= i else 0.0 for i in range(degree + 1)]
        for k in range(degree + 1)
    ]
    return np.array(rows)


@cache
def _product_weights(n: int, m: int, terms: int) -> Floats:
    weights = np.zeros((n + 1, m + 1, n + m + 1))
    for i in range(n + 1):
        for j in range(m + 1):
            weights[i, j, i + j] = float(Fraction(math.comb(n, i) * math.comb(m, j), math.comb(n + m, i + j)))
    return np.tile(weights.reshape(-1, n + m + 1), (terms, 1))


@cache
def halving(degree: int) -> Floats:
    """Return the matrix of both halves; its entries C(i, j) / 2^i are exact. Shape (degree + 1, 2 (degree + 1)), the left half first."""
    split = np.zeros((degree + 1, 2, degree + 1))
    for i in range(degree + 1):
        for j in range(i + 1):
            split[j, 0, i] = math.comb(i, j) / 2.0**i
            split[degree - j, 1, degree - i] = math.comb(i, j) / 2.0**i
    return split.reshape(degree + 1, -1)
