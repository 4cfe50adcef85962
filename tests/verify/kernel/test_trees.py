"""Bernstein coefficients and trees against Sturm's sequences, at and around ties, with numbers of hundreds of bits."""

import random
from fractions import Fraction

import pytest

from tests.helpers.sturm import is_nowhere_negative, value
from verify.kernel.polynomials import Polynomial
from verify.kernel.refused import Refused
from verify.kernel.trees import DEEPEST, at_least, leaves, require
from verify.proofs.search import Style, _Chosen


class Given:
    """Marks from a text."""

    def __init__(self, text):
        self.left = list(text)

    def take(self, part, depth):
        return self.left.pop(0) if self.left else "?"


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
    whole = at_least([(Polynomial.of(coefficients).bernstein(), Fraction(0))])
    chosen = _Chosen(Style("m", depth))
    try:
        require(whole, chosen, "it is above zero")
    except Refused:
        return False
    require(at_least([(Polynomial.of(coefficients).bernstein(), Fraction(0))]), Given(chosen.marks), "it is above zero")
    return True


def test_a_proof_is_found_only_where_sturm_agrees():
    rng, proved = random.Random(1), 0
    for _ in range(300):
        coefficients = near_ties(rng) if rng.random() < 0.7 else [dyadic(rng) for _ in range(rng.randrange(1, 9))]
        truth = is_nowhere_negative(coefficients)
        found = is_proved(coefficients, 12)
        assert truth or not found, coefficients
        proved += found
    assert proved > 30


def test_random_marks_prove_nothing_that_is_false():
    rng = random.Random(2)
    for _ in range(500):
        coefficients = near_ties(rng)
        marks = "".join(rng.choice("sm") for _ in range(rng.randrange(1, 40)))
        try:
            require(at_least([(Polynomial.of(coefficients).bernstein(), Fraction(0))]), Given(marks), "it is above zero")
        except Refused:
            continue
        assert is_nowhere_negative(coefficients), (coefficients, marks)


def test_halves_are_the_polynomial_on_each_half():
    rng = random.Random(3)
    for _ in range(50):
        polynomial = Polynomial.of([dyadic(rng) for _ in range(rng.randrange(1, 16))])
        whole = polynomial.bernstein()
        first, second = whole.halves()
        assert whole.ends() == (polynomial.at(0), polynomial.at(1))
        assert first.ends() == (polynomial.at(0), polynomial.at(Fraction(1, 2)))
        assert second.ends() == (polynomial.at(Fraction(1, 2)), polynomial.at(1))


def test_polynomials_are_moved_and_stretched():
    rng = random.Random(4)
    for _ in range(50):
        coefficients = [dyadic(rng) for _ in range(rng.randrange(1, 9))]
        polynomial, by, length, x = Polynomial.of(coefficients), dyadic(rng), abs(dyadic(rng)), dyadic(rng)
        assert polynomial.at(x) == value(coefficients, x)
        assert polynomial.moved(by).at(x) == value(coefficients, x + by)
        assert polynomial.stretched(length).at(x) == value(coefficients, x * length)
        other = [dyadic(rng) for _ in range(rng.randrange(1, 9))]
        assert (polynomial * Polynomial.of(other)).at(x) == value(coefficients, x) * value(other, x)
        assert (polynomial - Polynomial.of(other)).at(x) == value(coefficients, x) - value(other, x)


def test_a_tree_is_not_deeper_than_it_may_be():
    whole = at_least([(Polynomial.of([Fraction(0), Fraction(1)]).bernstein(), Fraction(0))])
    with pytest.raises(Refused, match="too deep"):
        list(leaves(whole, Given("s" * (DEEPEST + 1))))


def test_a_tree_may_leave_open_only_what_is_not_required():
    whole = at_least([(Polynomial.of([Fraction(1)]).bernstein(), Fraction(0))])
    assert [leaf.mark for leaf in leaves(whole, Given("sm?"))] == ["m", "?"]
    with pytest.raises(Refused, match="not proved"):
        require(whole, Given("sm?"), "it is above zero")
