"""Bernstein coefficients and trees against Sturm's sequences, at and around ties, with numbers of hundreds of bits."""

import random
from fractions import Fraction

import pytest

from tests.helpers.motion.sturm import is_nowhere_negative, value
from verify.kernel.statement import MOST, Refused
from verify.kernel.trees import Cell, Evidence, Polynomial, leaves
from verify.proofs.search import Style, tree_of


def ends(row):
    return Fraction(row.numbers[0], row.unit), Fraction(row.numbers[-1], row.unit)


def above_zero(coefficients):
    """Return the claim that a polynomial is nowhere negative."""
    row = Polynomial.of(coefficients).bernstein()
    return Cell(lambda _: row, {"m": [[[(0, ">=", Fraction(0))]]]})


def check(part, marks):
    Evidence({"limits": marks}).prove("limits", [part])


def product(*factors):
    total = [Fraction(1)]
    for factor in factors:
        result = [Fraction(0)] * (len(total) + len(factor) - 1)
        for i, a in enumerate(total):
            for k, b in enumerate(factor):
                result[i + k] += a * b
        total = result
    return total


def dyadic(rng, bits=20):
    return Fraction(rng.randrange(-(1 << bits), 1 << bits), 1 << rng.randrange(bits + 4))


def near_ties(rng):
    """A square with double roots inside, times something, lifted or lowered by next to nothing, or not at all."""
    root = Fraction(rng.randrange(1, 64), 64)
    body = product([-root, Fraction(1)], [-root, Fraction(1)], [1 + abs(dyadic(rng, 6)), dyadic(rng, 2) / 8])
    if rng.random() < 0.5:
        other = Fraction(rng.randrange(1, 64), 64)
        body = product(body, [-other, Fraction(1)], [-other, Fraction(1)])
    body[0] += rng.choice([0, 1, -1]) * Fraction(1, 1 << rng.choice([8, 30, 300]))
    return body


def is_proved(coefficients, depth=30):
    """Whether a search of some depth finds a proof, which is then checked."""
    whole = above_zero(coefficients)
    marks = tree_of(Style("m", depth), whole)
    if "?" in marks:
        return False
    check(above_zero(coefficients), marks)
    return True


@pytest.mark.parametrize("number", [60, pytest.param(1000, marks=pytest.mark.slow)])
def test_a_proof_is_found_only_where_sturm_agrees(number):
    rng, proved = random.Random(1), 0
    for _ in range(number):
        coefficients = near_ties(rng) if rng.random() < 0.7 else [dyadic(rng) for _ in range(rng.randrange(1, 9))]
        truth = is_nowhere_negative(coefficients)
        found = is_proved(coefficients, 12)
        assert truth or not found, coefficients
        proved += found
    assert proved > number // 10


def test_random_marks_prove_nothing_that_is_false():
    rng = random.Random(2)
    for _ in range(500):
        coefficients = near_ties(rng)
        marks = "".join(rng.choice("sm") for _ in range(rng.randrange(1, 40)))
        try:
            check(above_zero(coefficients), marks)
        except Refused:
            continue
        assert is_nowhere_negative(coefficients), (coefficients, marks)


def test_halves_are_the_polynomial_on_each_half():
    rng = random.Random(3)
    for _ in range(50):
        polynomial = Polynomial.of([dyadic(rng) for _ in range(rng.randrange(1, 16))])
        whole = polynomial.bernstein()
        first, second = whole.halves()
        assert ends(whole) == (polynomial.at(0), polynomial.at(1))
        assert ends(first) == (polynomial.at(0), polynomial.at(Fraction(1, 2)))
        assert ends(second) == (polynomial.at(Fraction(1, 2)), polynomial.at(1))


def test_polynomials_are_stretched_multiplied_and_subtracted():
    rng = random.Random(4)
    for _ in range(50):
        coefficients = [dyadic(rng) for _ in range(rng.randrange(1, 9))]
        polynomial, length, x = Polynomial.of(coefficients), abs(dyadic(rng)), dyadic(rng)
        assert polynomial.at(x) == value(coefficients, x)
        assert polynomial.stretched(length).at(x) == value(coefficients, x * length)
        other = [dyadic(rng) for _ in range(rng.randrange(1, 9))]
        assert (polynomial * Polynomial.of(other)).at(x) == value(coefficients, x) * value(other, x)
        assert (polynomial - Polynomial.of(other)).at(x) == value(coefficients, x) - value(other, x)


def test_a_tree_is_not_deeper_than_it_may_be():
    whole = above_zero([Fraction(0), Fraction(1)])
    with pytest.raises(Refused, match="halvings"):
        list(leaves(whole, iter("s" * (MOST["halvings of an interval"] + 1))))


def test_a_tree_may_leave_open_only_what_is_not_required():
    whole = above_zero([Fraction(1)])
    assert [mark for _, mark, _ in leaves(whole, iter("sm?"))] == ["m", "?"]
    with pytest.raises(Refused, match="open"):
        check(whole, "sm?")
