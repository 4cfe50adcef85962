"""Polynomials with rational coefficients, and questions about them answered without any rounding.

The balls of `balls` decide nearly everything; what they leave open, an exact tie say, is decided here: squarefree
factors by python-flint, their roots in an interval by Descartes' rule on integer Bernstein coefficients (the method
of Vincent, Collins and Akritas). A polynomial is an `fmpq_poly`; intervals are given by exact ends.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from flint import fmpq, fmpq_poly


@dataclass(frozen=True, slots=True)
class Root:
    """Exactly one real root (of that multiplicity) lies within [low, high]; it is `low` where they are equal."""

    low: Fraction
    high: Fraction
    multiplicity: int


def rational(value: float | Fraction) -> fmpq:
    """Return a finite float's or a fraction's exact value."""
    numerator, denominator = value.as_integer_ratio()
    return fmpq(numerator, denominator)


def fraction(value: fmpq) -> Fraction:
    """Return a flint rational as Python's own."""
    return Fraction(int(value.p), int(value.q))


def polynomial(coefficients: Sequence[float]) -> fmpq_poly:
    """Return the polynomial with these ascending coefficients, exactly."""
    return fmpq_poly([rational(float(c)) for c in coefficients])


def nonnegative(p: fmpq_poly, start: Fraction = Fraction(0), stop: Fraction = Fraction(1)) -> bool:
    """Decide whether p(t) >= 0 for all t in [start, stop].

    Args:
        p: In t, exact.
        start: First t, exact.
        stop: Last t, exact; not below `start`.

    Raises:
        AssertionError: A polynomial has more roots than its degree, which no arithmetic of ours may say.
    """
    if p.degree() < 1 or start == stop:
        return p(rational(start)) >= 0
    unit = on_unit_interval(p, start, stop)
    roots = _roots_in_unit(unit)
    if any(root.multiplicity % 2 == 1 and root.high > 0 and root.low < 1 for root in roots):
        return False  # it changes sign inside
    for k in range(1, p.degree() + 2):
        value = unit(fmpq(k, p.degree() + 2))
        if value != 0:
            return value > 0
    raise AssertionError("a polynomial has no more roots than its degree")


def roots(p: fmpq_poly, start: Fraction, stop: Fraction, width: Fraction) -> tuple[Root, ...]:
    """Isolate the real roots in [start, stop], in order, in intervals no wider than `width` and without common points.

    A polynomial that is zero everywhere has no isolated roots and is rejected.

    Args:
        p: In t, exact.
        start: First t, exact.
        stop: Last t, exact; above `start`.
        width: Above 0, in the unit of t, exact.

    Raises:
        ValueError: The polynomial is zero everywhere.
    """
    if p.degree() < 0:
        raise ValueError("the zero polynomial has no isolated roots")
    if p.degree() == 0:
        return ()
    length = stop - start
    found = _roots_in_unit(on_unit_interval(p, start, stop), width / length)
    return tuple(Root(start + length * r.low, start + length * r.high, r.multiplicity) for r in found)


def on_unit_interval(p: fmpq_poly, start: Fraction, stop: Fraction) -> fmpq_poly:
    """Return p as a polynomial in u in [0, 1], where t = start + (stop - start) u.

    Args:
        p: In t, exact.
        start: t at u = 0, exact.
        stop: t at u = 1, exact.
    """
    return p(fmpq_poly([rational(start), rational(stop - start)]))


def _roots_in_unit(p: fmpq_poly, width: Fraction = Fraction(1)) -> list[Root]:
    _, factors = p.factor_squarefree() if hasattr(p, "factor_squarefree") else p.factor()
    found: list[tuple[Fraction, Fraction, int, fmpq_poly]] = []
    for factor, multiplicity in factors:
        found += [(low, high, int(multiplicity), factor) for low, high in _isolate(factor)]
    while True:
        found = [(*_narrowed(factor, low, high, width), multiplicity, factor) for low, high, multiplicity, factor in found]
        found.sort(key=lambda item: (item[0], item[1]))
        if all(a[1] < b[0] for a, b in itertools.pairwise(found)):
            return [Root(low, high, multiplicity) for low, high, multiplicity, _ in found]
        width /= 16  # roots of different factors differ, so some width parts them


def _isolate(p: fmpq_poly) -> list[tuple[Fraction, Fraction]]:
    """Isolate the roots of a squarefree polynomial in [0, 1]; an open interval (low, high) has one root inside."""
    found: list[tuple[Fraction, Fraction]] = []
    coefficients = _bernstein(p)
    if coefficients[0] == 0:
        found.append((Fraction(0), Fraction(0)))
    if coefficients[-1] == 0:
        found.append((Fraction(1), Fraction(1)))
    stack = [(coefficients, Fraction(0), Fraction(1))]
    while stack:
        values, low, high = stack.pop()
        changes = _sign_changes(values)
        if changes == 0:
            continue
        if changes == 1:
            found.append((low, high))
            continue
        left, right = _halved(values)
        middle = (low + high) / 2
        if left[-1] == 0:
            found.append((middle, middle))
        stack += [(left, low, middle), (right, middle, high)]
    return found


def _narrowed(p: fmpq_poly, low: Fraction, high: Fraction, width: Fraction) -> tuple[Fraction, Fraction]:
    """Bisect an open interval with one simple root; ends that are themselves roots of `p` are stepped away from."""
    if low == high:
        return low, high
    sign_high = _sign_below(p, high)
    while high - low > width or p(rational(low)) == 0 or p(rational(high)) == 0:
        middle = (low + high) / 2
        value = p(rational(middle))
        if value == 0:
            return middle, middle
        if (value > 0) == sign_high:
            high = middle
        else:
            low = middle
    return low, high


def _sign_below(p: fmpq_poly, place: Fraction) -> bool:
    """Return whether a polynomial without multiple roots is positive just below a place."""
    value = p(rational(place))
    return value > 0 if value != 0 else p.derivative()(rational(place)) < 0


def _bernstein(p: fmpq_poly) -> list[int]:
    """Return positive multiples of the Bernstein coefficients on [0, 1], as integers."""
    degree = p.degree()
    numerators = [int(c) for c in p.numer().coeffs()]
    scale = math.lcm(*(math.comb(degree, k) for k in range(degree + 1)))
    parts = [c * (scale // math.comb(degree, k)) for k, c in enumerate(numerators)]
    return [sum(math.comb(i, k) * parts[k] for k in range(i + 1)) for i in range(degree + 1)]


def _halved(values: list[int]) -> tuple[list[int], list[int]]:
    """De Casteljau at 1/2 without division: the level j is 2^j times too large, which the scaling evens out."""
    degree = len(values) - 1
    left, right = [0] * (degree + 1), [0] * (degree + 1)
    row = values
    for level in range(degree + 1):
        left[level] = row[0] << (degree - level)
        right[degree - level] = row[-1] << (degree - level)
        row = [a + b for a, b in itertools.pairwise(row)]
    return left, right


def _sign_changes(values: list[int]) -> int:
    signs = [v > 0 for v in values if v != 0]
    return sum(a != b for a, b in itertools.pairwise(signs))
