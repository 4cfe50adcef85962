"""Exact roots and signs, held against polynomials whose roots are known because they are made of them."""

from __future__ import annotations

import itertools
from fractions import Fraction

import pytest
from flint import fmpq, fmpq_poly
from hypothesis import assume
from hypothesis import strategies as st

from tests.helpers.few import given_few
from verify.arithmetic.exact import nonnegative, rational, roots

PLACES = st.fractions(min_value=-1, max_value=2, max_denominator=16)
WIDTH = Fraction(1, 1000)


def made_of(places: list[Fraction]) -> fmpq_poly:
    """Return a polynomial with these roots, as often as they are named, positive behind the last."""
    product = fmpq_poly([1])
    for place in places:
        product *= fmpq_poly([-rational(place), fmpq(1)])
    return product


def assert_found(places: list[Fraction], start: Fraction, stop: Fraction) -> None:
    """Fail unless the roots that are found are those that were put in."""
    inside = sorted({place for place in places if start <= place <= stop})
    found = roots(made_of(places), start, stop, WIDTH)
    assert len(found) == len(inside)
    for root, place in zip(found, inside, strict=True):
        assert root.low <= place <= root.high <= root.low + WIDTH
        assert root.multiplicity == places.count(place)
    assert all(a.high < b.low for a, b in itertools.pairwise(found))


def test_a_root_is_found_where_it_is_though_complex_ones_hide_it() -> None:
    bend = fmpq_poly([fmpq(1, 16) + fmpq(1, 256), fmpq(-1, 2), 1])  # (t - 1/4)^2 + 1/256
    (root,) = roots(bend * fmpq_poly([fmpq(-7, 9), 1]), Fraction(0), Fraction(1), WIDTH)
    assert root.low <= Fraction(7, 9) <= root.high
    assert root.multiplicity == 1


@given_few(10, 60, st.lists(PLACES, min_size=1, max_size=6), PLACES, PLACES)
def test_roots_are_those_that_were_put_in(places: list[Fraction], start: Fraction, stop: Fraction) -> None:
    assume(start != stop)
    assert_found(places, min(start, stop), max(start, stop))


@pytest.mark.parametrize(
    "places",
    [
        [Fraction(1, 3), Fraction(2, 3)],
        [Fraction(0), Fraction(1, 2), Fraction(1)],
        [Fraction(1, 2), Fraction(1, 2), Fraction(3, 4)],
        [Fraction(7, 16), Fraction(1, 2), Fraction(9, 16), Fraction(1)],
        [Fraction(1, 2), Fraction(501, 1000)],
    ],
)
def test_roots_at_ends_halves_and_beside_each_other(places: list[Fraction]) -> None:
    assert_found(places, Fraction(0), Fraction(1))
    assert_found([place - 5 for place in places], Fraction(-5), Fraction(-4))


@given_few(10, 60, st.lists(PLACES, min_size=1, max_size=5), st.booleans())
def test_signs_are_those_between_the_roots(places: list[Fraction], turned: bool) -> None:
    p = -made_of(places) if turned else made_of(places)
    ends = sorted({Fraction(0), Fraction(1), *(place for place in places if 0 < place < 1)})
    between = [(a + b) / 2 for a, b in itertools.pairwise(ends)]
    assert nonnegative(p, Fraction(0), Fraction(1)) == all(p(rational(place)) >= 0 for place in between)


def test_a_falling_line_is_not_what_it_is_at_its_start() -> None:
    line = fmpq_poly([1, -2])  # 1 - 2 t
    assert nonnegative(line, Fraction(0), Fraction(1, 2))
    assert not nonnegative(line, Fraction(0), Fraction(501, 1000))
    assert not nonnegative(-line, Fraction(0), Fraction(1))
    assert nonnegative(-line, Fraction(1, 2), Fraction(1))
