"""Polynomials whose coefficients are whole numbers over one power of two, and their Bernstein coefficients on [0, 1].

Every number of a flight is a float, so it is a whole number over a power of two; nothing here rounds.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise

from .statement import require


def _dyadic(value: Fraction | float) -> tuple[int, int]:
    """Return n and s with value = n / 2^s."""
    number, under = value.as_integer_ratio()
    shift = under.bit_length() - 1
    require(under == 1 << shift, "a number is no whole one over a power of two")
    return number, shift


class Polynomial:
    """The polynomial sum(numbers[k] x^k) / 2^shift."""

    __slots__ = ("numbers", "shift")

    def __init__(self, numbers: Sequence[int], shift: int = 0) -> None:
        self.numbers, self.shift = numbers, shift

    @classmethod
    def of(cls, values: Sequence[Fraction | float]) -> Polynomial:
        """Return the polynomial with these coefficients, ascending."""
        pairs = [_dyadic(value) for value in values]
        shift = max((s for _, s in pairs), default=0)
        return cls([n << (shift - s) for n, s in pairs], shift)

    def __add__(self, other: Polynomial) -> Polynomial:
        shift = max(self.shift, other.shift)
        long, short = ([n << (shift - one.shift) for n in one.numbers] for one in (self, other))
        if len(long) < len(short):
            long, short = short, long
        return Polynomial([a + b for a, b in zip(long, short, strict=False)] + long[len(short) :], shift)

    def __neg__(self) -> Polynomial:
        return Polynomial([-n for n in self.numbers], self.shift)

    def __sub__(self, other: Polynomial) -> Polynomial:
        return self + -other

    def __mul__(self, other: Polynomial) -> Polynomial:
        product = [0] * max(len(self.numbers) + len(other.numbers) - 1, 0)
        for i, a in enumerate(self.numbers):
            for k, b in enumerate(other.numbers if a else (), start=i):
                product[k] += a * b
        return Polynomial(product, self.shift + other.shift)

    def derivative(self) -> Polynomial:
        """Return its derivative."""
        return Polynomial([k * n for k, n in enumerate(self.numbers)][1:], self.shift)

    def stretched(self, length: Fraction) -> Polynomial:
        """Return p(length x)."""
        (number, shift), last = _dyadic(length), max(len(self.numbers) - 1, 0)
        found, power = list[int](), 1
        for k, n in enumerate(self.numbers):
            found.append(n * power << shift * (last - k))
            power *= number
        return Polynomial(found, self.shift + shift * last)

    def moved(self, by: Fraction) -> Polynomial:
        """Return p(x + by), by Horner's rule for y = 2^shift x."""
        (number, shift), last = _dyadic(by), max(len(self.numbers) - 1, 0)
        row = [n << shift * (last - k) for k, n in enumerate(self.numbers)]
        for first in range(last):
            for k in range(last - 1, first - 1, -1):
                row[k] += number * row[k + 1]
        return Polynomial([n << shift * k for k, n in enumerate(row)], self.shift + shift * last)

    def at(self, place: Fraction | int) -> Fraction:
        """Return its value, by Horner's rule."""
        (number, shift), value = _dyadic(place), 0
        for k, n in enumerate(reversed(self.numbers)):
            value = value * number + (n << shift * k)
        return Fraction(value, 1 << self.shift + shift * max(len(self.numbers) - 1, 0))

    def bernstein(self, degree: int | None = None) -> Bernstein:
        """Return its Bernstein coefficients on [0, 1], of a degree not below its own (Coq: `bern_power`)."""
        factor, weights = _weights(len(self.numbers) - 1 if degree is None else degree)
        row = [n * w for n, w in zip(self.numbers, weights, strict=False)]
        row += [0] * (len(weights) - len(row))
        found: list[int] = []
        while row:
            found.append(row[0])
            row = [a + b for a, b in pairwise(row)]
        return Bernstein(found, factor << self.shift)


@lru_cache(maxsize=64)
def _weights(degree: int) -> tuple[int, list[int]]:
    """Return the least common multiple of the binomials of a degree, and it over each of them."""
    rows = [math.comb(degree, k) for k in range(degree + 1)]
    return math.lcm(*rows), [math.lcm(*rows) // row for row in rows]


def square(vector: Sequence[Polynomial]) -> Polynomial:
    """Return |v|^2."""
    x, y, z = vector
    return x * x + y * y + z * z


_SIGNS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}


class Bernstein:
    """A polynomial on an interval: numbers[k] / unit are its Bernstein coefficients, unit is above zero.

    Its values lie between the least and the greatest of them (Coq: `bern_lower`, `bern_upper`, `bern_positive`), and rise, or fall,
    where these do (Coq: `bern_monotone`).
    """

    __slots__ = ("highest", "lowest", "numbers", "unit")

    def __init__(self, numbers: list[int], unit: int) -> None:
        self.numbers, self.unit, self.lowest, self.highest = numbers, unit, min(numbers), max(numbers)

    def keeps(self, sign: str, value: Fraction) -> bool:
        """Return whether all coefficients stand so to a value; or whether none is below the one before it (`rises`), or above (`falls`)."""
        if sign in ("rises", "falls"):
            return self.numbers == sorted(self.numbers, reverse=sign == "falls")
        edge = self.lowest if sign in (">", ">=") else self.highest
        return _SIGNS[sign](edge * value.denominator, value.numerator * self.unit)

    def ends(self) -> tuple[Fraction, Fraction]:
        """Return its values at the interval's two ends."""
        return Fraction(self.numbers[0], self.unit), Fraction(self.numbers[-1], self.unit)

    def halves(self) -> tuple[Bernstein, Bernstein]:
        """Return it on the first and on the second half (Coq: `first_half_value`, `second_half_value`)."""
        row, degree = self.numbers, len(self.numbers) - 1
        first, second = [row[0] << degree], [row[-1] << degree]
        for left in range(degree - 1, -1, -1):
            row = [a + b for a, b in pairwise(row)]
            first.append(row[0] << left)
            second.append(row[-1] << left)
        return Bernstein(first, self.unit << degree), Bernstein(second[::-1], self.unit << degree)


def common(rows: Sequence[Bernstein]) -> tuple[list[list[int]], int]:
    """Return the coefficients of polynomials whose units differ by powers of two, over one unit."""
    unit = max(row.unit for row in rows)
    return [[n * (unit // row.unit) for n in row.numbers] for row in rows], unit


def root(value: Fraction) -> tuple[Fraction, Fraction]:
    """Return numbers that enclose the root of a value that is not negative; the root itself twice where it is rational."""
    fine = 1 << 80
    scaled, under = value.numerator * value.denominator * fine * fine, value.denominator * fine
    low = math.isqrt(scaled)
    return Fraction(low, under), Fraction(low if low * low == scaled else low + 1, under)
