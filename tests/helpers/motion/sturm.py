"""Signs of polynomials by Sturm's sequences, in fractions: what Bernstein coefficients are held against."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

Coefficients = list[Fraction]


def value(polynomial: Coefficients, x: Fraction) -> Fraction:
    total = Fraction(0)
    for coefficient in reversed(polynomial):
        total = total * x + coefficient
    return total


def _trimmed(polynomial: Coefficients) -> Coefficients:
    while polynomial and not polynomial[-1]:
        polynomial = polynomial[:-1]
    return polynomial


def _rest(one: Coefficients, other: Coefficients) -> Coefficients:
    one = list(one)
    while len(one) >= len(other):
        share = one[-1] / other[-1]
        for k in range(1, len(other) + 1):
            one[-k] -= share * other[-k]
        one.pop()
    return _trimmed(one)


def derivative(polynomial: Coefficients) -> Coefficients:
    return [k * c for k, c in enumerate(polynomial)][1:]


def roots_between(polynomial: Coefficients, low: Fraction, high: Fraction) -> int:
    """Return how many different roots lie in (low, high]; neither end may be a root of all of the sequence."""
    chain = [_trimmed(polynomial), _trimmed(derivative(polynomial))]
    while chain[-1]:
        chain.append([-c for c in _rest(chain[-2], chain[-1])])
    chain.pop()

    def changes(x: Fraction) -> int:
        signs = [v for p in chain if (v := value(p, x))]
        return sum((a < 0) != (b < 0) for a, b in pairwise(signs))

    return changes(low) - changes(high)


def is_nowhere_negative(polynomial: Coefficients) -> bool:
    """Return whether a polynomial is nowhere below zero on [0, 1]: it is not at ends, nor between any two of its roots.

    Its roots must be whole numbers over powers of two, or simple, and not at the ends.
    """
    polynomial = _trimmed(polynomial)
    if not polynomial:
        return True
    if value(polynomial, Fraction(0)) < 0 or value(polynomial, Fraction(1)) < 0:
        return False
    waiting = [(Fraction(0), Fraction(1))]
    while waiting:
        low, high = waiting.pop()
        if value(polynomial, low) < 0 or value(polynomial, high) < 0:
            return False
        if (count := roots_between(polynomial, low, high)) == 0:
            continue
        if count == 1 and value(polynomial, low) > 0 and value(polynomial, high) > 0:
            continue  # one root, and the same sign on both sides: it touches
        if high - low < Fraction(1, 1 << 200):
            raise AssertionError("roots lie too close together to tell")
        middle = low + (high - low) * Fraction(5, 11)  # which is no root that has a power of two below it
        waiting += [(low, middle), (middle, high)]
    return True
