"""Numbers just below and just above roots, pi, sines and cosines; intervals of such numbers.

Ends of intervals are whole numbers over 2^64; every result holds all that may come of the operands.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache

from .polynomials import Bernstein
from .refused import Refused

BITS = 64
ONE = 1 << BITS
PI = Fraction(3141592653589793238462643383279502884197, 10**39)
"""Below pi, by less than 1e-39."""
_GRID = 1 << 16


def root(value: Fraction) -> tuple[Fraction, Fraction]:
    """Return numbers that enclose the root of a value that is not negative; the root itself twice where it is rational."""
    fine = 1 << 80
    scaled, under = value.numerator * value.denominator * fine * fine, value.denominator * fine
    low = math.isqrt(scaled)
    return Fraction(low, under), Fraction(low if low * low == scaled else low + 1, under)


class Interval:
    """All numbers from low / 2^64 to high / 2^64."""

    __slots__ = ("high", "low")

    def __init__(self, low: int, high: int) -> None:
        self.low = low
        self.high = high

    @classmethod
    def of(cls, value: Fraction) -> Interval:
        """Return the least interval that holds a number."""
        scaled = value.numerator << BITS
        return cls(scaled // value.denominator, -(-scaled // value.denominator))

    @classmethod
    def range_of(cls, row: Bernstein) -> Interval:
        """Return an interval that holds all values of a polynomial."""
        return cls((row.lowest << BITS) // row.unit, -((-row.highest << BITS) // row.unit))

    def __add__(self, other: Interval) -> Interval:
        return Interval(self.low + other.low, self.high + other.high)

    def __sub__(self, other: Interval) -> Interval:
        return Interval(self.low - other.high, self.high - other.low)

    def __neg__(self) -> Interval:
        return Interval(-self.high, -self.low)

    def __mul__(self, other: Interval) -> Interval:
        a, b, c, d = self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high
        return Interval(min(a, b, c, d) >> BITS, -(-max(a, b, c, d) >> BITS))

    def __truediv__(self, other: Interval) -> Interval:
        if other.low <= 0 <= other.high:
            raise Refused("a divisor may be zero")
        pairs = [(n << BITS, d) for n in (self.low, self.high) for d in (other.low, other.high)]
        return Interval(min(n // d for n, d in pairs), max(-(-n // d) for n, d in pairs))

    def squared(self) -> Interval:
        """Return all squares."""
        a, b = self.low * self.low, self.high * self.high
        return Interval(0 if self.low <= 0 <= self.high else min(a, b) >> BITS, -(-max(a, b) >> BITS))

    def root(self) -> Interval:
        """Return the roots of what is not negative."""
        return Interval(math.isqrt(max(self.low, 0) << BITS), math.isqrt(max(self.high, 0) << BITS) + 1)

    def within(self, low: Fraction, high: Fraction) -> bool:
        """Return whether all of it lies between two numbers."""
        return self.low * low.denominator >= low.numerator * ONE and self.high * high.denominator <= high.numerator * ONE


def cosine_and_sine(angle: Interval) -> tuple[Interval, Interval]:
    """Return all cosines and all sines of angles: those of one in the middle, and as far beside as angles are."""
    middle = (angle.low + angle.high) * _GRID // (2 * ONE)
    at = middle * ONE // _GRID
    away = max(angle.high - at, at - angle.low)
    cosine, sine = (Interval(max(c.low - away, -ONE), min(c.high + away, ONE)) for c in _cosine_and_sine(middle))
    return cosine, sine


@lru_cache(maxsize=65536)
def _cosine_and_sine(middle: int) -> tuple[Interval, Interval]:
    """Return cosine and sine of middle / _GRID, less full turns, by Taylor's sums; what they leave out is less than the next term."""
    angle = Fraction(middle, _GRID)
    turns = round(angle / (2 * PI))
    x = Fraction(round((angle - 2 * turns * PI) * ONE), ONE)
    loose = abs(turns) * Fraction(2, 10**39) + Fraction(1, ONE)
    sums, term = [Fraction(0), Fraction(0)], Fraction(1)
    for k in range(40):
        sums[k % 2] += term if k % 4 < 2 else -term
        term = Fraction(round(term * x / (k + 1) * ONE * ONE), ONE * ONE)
    loose += abs(term) + Fraction(100, ONE)  # and what comes of rounding terms, each by less than 2^-128
    low, high = ([Interval.of(value + sign * loose) for value in sums] for sign in (-1, 1))
    return Interval(low[0].low, high[0].high), Interval(low[1].low, high[1].high)
