"""Polynomials whose coefficients are whole numbers over one power of two, and their Bernstein coefficients on [0, 1]; evidence.

Every number of a flight is a float, so it is a whole number over a power of two; nothing here rounds.

*Trees.* A subdivision tree is an interval cut into halves, in preorder, with what holds on each leaf (Coq: `check_tree_sound`).

Marks of a tree are letters: `s` splits, `?` claims nothing, any other is a claim that is checked by whole numbers. The proof chooses marks; it cannot
choose what they claim. They stand one after another in the order in which the kernel asks; a number before one says how often it stands there.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from copy import copy
from fractions import Fraction
from functools import cache
from itertools import pairwise, repeat, zip_longest
from typing import Any, Self

from .statement import few, read, read_json, require


def _dyadic(value: Fraction | float) -> tuple[int, int]:
    """Return n and s with value = n / 2^s."""
    number, under = value.as_integer_ratio()
    shift = under.bit_length() - 1
    require(under == 1 << shift, "a number is no whole one over a power of two")
    return number, shift


class Polynomial:
    """The polynomial sum(numbers[k] x^k) / 2^shift."""

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
        rows = ([n << (shift - one.shift) for n in one.numbers] for one in (self, other))
        return Polynomial([a + b for a, b in zip_longest(*rows, fillvalue=0)], shift)

    def __sub__(self, other: Polynomial) -> Polynomial:
        return self + Polynomial([-1]) * other

    def __mul__(self, other: Polynomial) -> Polynomial:
        product = [0] * max(len(self.numbers) + len(other.numbers) - 1, 0)
        for i, a in enumerate(self.numbers):
            for k, b in enumerate(other.numbers if a else (), start=i):
                product[k] += a * b
        return Polynomial(product, self.shift + other.shift)

    def derivative(self) -> Polynomial:
        """Return its derivative."""
        return Polynomial([k * n for k, n in enumerate(self.numbers)][1:], self.shift)

    def stretched(self, length: Fraction | int) -> Polynomial:
        """Return p(length x)."""
        (number, shift), last = _dyadic(length), max(len(self.numbers) - 1, 0)
        return Polynomial([n * number**k << shift * (last - k) for k, n in enumerate(self.numbers)], self.shift + shift * last)

    def at(self, place: Fraction | int) -> Fraction:
        """Return its value."""
        row = self.stretched(place) if place else Polynomial(self.numbers[:1], self.shift)
        return Fraction(sum(row.numbers), 1 << row.shift)

    def bernstein(self, degree: int | None = None) -> Bernstein:
        """Return its Bernstein coefficients on [0, 1], of a degree not below its own (Coq: `bern_power`)."""
        size = len(self.numbers) if degree is None else degree + 1
        binomials = [math.comb(size - 1, k) for k in range(size)]
        factor, found = math.lcm(*binomials), list[int]()
        row = [n * (factor // under) for n, under in zip_longest(self.numbers, binomials, fillvalue=0)]
        while row:
            found.append(row[0])
            row = [a + b for a, b in pairwise(row)]
        return Bernstein(found, factor << self.shift)


def square(vector: Sequence[Polynomial]) -> Polynomial:
    """Return |v|^2."""
    x, y, z = vector
    return x * x + y * y + z * z


_SIGNS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}


class Bernstein:
    """A polynomial on an interval: numbers[k] / unit, with unit above zero, are its Bernstein coefficients. Its values lie between the least and the
    greatest of them, and rise, or fall, where these do (Coq: `bern_lower`, `bern_upper`, `bern_positive`, `bern_monotone`).
    """

    def __init__(self, numbers: list[int], unit: int) -> None:
        self.numbers, self.unit, self.lowest, self.highest = numbers, unit, min(numbers), max(numbers)

    def keeps(self, sign: str, value: Fraction) -> bool:
        """Return whether all coefficients stand so to a value; or whether none is below the one before it (`rises`), or above (`falls`)."""
        if sign in ("rises", "falls"):
            return self.numbers == sorted(self.numbers, reverse=sign == "falls")
        edge = self.lowest if sign in (">", ">=") else self.highest
        return _SIGNS[sign](edge * value.denominator, value.numerator * self.unit)

    def halves(self) -> tuple[Bernstein, Bernstein]:
        """Return it on the first and on the second half (Coq: `first_half_value`, `second_half_value`)."""
        row, degree = self.numbers, len(self.numbers) - 1
        first, second = [row[0] << degree], [row[-1] << degree]
        for left in range(degree - 1, -1, -1):
            row = [a + b for a, b in pairwise(row)]
            first.append(row[0] << left)
            second.append(row[-1] << left)
        return Bernstein(first, self.unit << degree), Bernstein(second[::-1], self.unit << degree)


def root(value: Fraction) -> tuple[Fraction, Fraction]:
    """Return numbers that enclose the root of a value that is not negative; the root itself twice where it is rational."""
    fine = 1 << 80
    scaled, under = value.numerator * value.denominator * fine * fine, value.denominator * fine
    low = math.isqrt(scaled)
    return Fraction(low, under), Fraction(low if low * low == scaled else low + 1, under)


FORMAT = 5

Atom = tuple[Hashable, str, Fraction]
"""What tells a polynomial from others, how it stands to a value (`Bernstein.keeps`), and the value."""
Rules = Mapping[str, Sequence[Sequence[Sequence[Atom]]]]
"""What each mark claims: of some alternative, all of its clauses, of each of which some atom."""


class Evidence:
    """Evidence as a proof's file holds it, by what it is evidence of."""

    def __init__(self, table: Mapping[str, Any]) -> None:
        self._table = table

    def get(self, key: str, kind: Any) -> Any:
        """Return an entry that is of some type; there has to be one, unless the type has None."""
        return read(kind, self._table.get(key), f"the proof's {key}")

    def marks(self, key: str) -> Iterator[str]:
        """Yield an entry's marks; there has to be one if marks are asked for."""
        text = self._table.get(key)
        require(isinstance(text, str), f"the proof has no marks for {key}")
        for run in re.finditer(r"(\d{0,9})(\D|$)", str(text)):
            yield from repeat(run[2], int(run[1] or 1))

    def prove(self, key: str, parts: Iterable[Part]) -> None:
        """Check the trees of parts, which leave nothing open."""
        marks = self.marks(key)
        for part in parts:
            require(all(mark != "?" for _, mark, _ in leaves(part, marks)), f"the proof's {key} leaves something open")


def read_evidence(text: str) -> Evidence:
    """Read a proof's file."""
    data = read_json(text, "proof.json")
    fits = isinstance(data, dict) and data.get("format") == FORMAT and isinstance(data.get("evidence"), dict)
    require(fits, f"proof.json is no proof of format {FORMAT}.")
    return Evidence(data["evidence"])


Part = Any  # knowledge of a part of an interval: `holds` of a mark, whether it is so on all of it; `halves`, the same of both halves


class Cell:
    """Polynomials on a part of an interval, which `row` returns, each found when it is asked for; and what marks claim of them."""

    def __init__(self, find: Callable[[Any], Bernstein], rules: Rules) -> None:
        self.row, self.rules = cache(find), rules

    def holds(self, mark: str) -> bool:
        """Return whether what a mark claims is so (Coq: `check_region_sound`, `check_nonneg_sound`)."""
        ways = self.rules.get(mark, ())
        return any(all(any(self.row(form).keeps(sign, value) for form, sign, value in one) for one in way) for way in ways)

    def halves(self) -> tuple[Self, Self]:
        """Return both halves."""
        both = cache(lambda form: self.row(form).halves())
        first, second = copy(self), copy(self)
        first.row, second.row = cache(lambda form: both(form)[0]), cache(lambda form: both(form)[1])
        return first, second


def leaves(whole: Part, marks: Iterator[str]) -> Iterator[tuple[Fraction, str, Part]]:
    """Yield the leaves of a tree over [0, 1] from left to right, each of them checked: its beginning, its mark and its part."""
    waiting = [(whole, 0, 0)]
    while waiting:
        part, place, depth = waiting.pop()
        mark = next(marks, "")
        if mark == "s":
            few(depth + 1, "halvings of an interval")
            first, second = part.halves()
            waiting += [(second, 2 * place + 1, depth + 1), (first, 2 * place, depth + 1)]
        else:
            require(mark == "?" or part.holds(mark), f"a leaf is marked {mark!r}, and that is not so")
            yield Fraction(place, 1 << depth), mark, part
