import pytest
from hypothesis import given

from tests.helpers.few import given_few
from tests.helpers.words.spot_reading import spot_accepts
from tests.strategies import finite_words, formulas, lassos, words
from verify.data import BadInput, Formula, Word, parse_formula
from verify.logic.semantics import satisfies, truth_table


def holds(text: str, *letters: str, cycle: str | None = None) -> bool:
    """Letters are strings of one-letter names; the cycle's are separated by blanks."""
    rest = None if cycle is None else [set(letter.strip("-")) for letter in cycle.split()]
    return satisfies(parse_formula(text), Word.of([set(letter) for letter in letters], rest))


@given_few(25, 150, formulas(with_next=True), finite_words())
def test_agrees_with_spot_on_finite_words(formula, word):
    assert satisfies(formula, word) == spot_accepts(formula, word)


@given_few(25, 150, formulas(with_next=True), lassos())
def test_agrees_with_spot_on_lassos(formula, word):
    assert satisfies(formula, word) == spot_accepts(formula, word)


@given(formulas(with_next=True), words())
def test_a_word_satisfies_a_formula_or_its_negation(formula, word):
    assert satisfies(Formula("!", (formula,)), word) != satisfies(formula, word)


@given(formulas(with_next=True), formulas(with_next=True), words())
def test_duals(x, y, word):
    def negated(f):
        return Formula("!", (f,))

    for one, other in (("U", "R"), ("W", "M")):
        direct = satisfies(Formula(one, (x, y)), word)
        assert direct != satisfies(Formula(other, (negated(x), negated(y))), word)
    assert satisfies(negated(Formula("G", (x,))), word) == satisfies(Formula("F", (negated(x),)), word)
    assert satisfies(negated(Formula("X", (x,))), word) == satisfies(Formula("X[!]", (negated(x),)), word)


@given(formulas(), finite_words())
def test_repeating_a_letter_changes_nothing_without_next(formula, word):
    repeated = Word(tuple(letter for letter in word.prefix for _ in range(2)))
    assert satisfies(formula, repeated) == satisfies(formula, word) == satisfies(formula, word.compressed())


@given(formulas(with_next=True), lassos())
def test_unrolling_a_cycle_changes_nothing(formula, word):
    unrolled = Word(word.prefix + word.cycle, word.cycle + word.cycle)
    assert satisfies(formula, unrolled) == satisfies(formula, word)


def test_next_at_the_end_of_a_trace():
    assert holds("X a", "a")  # weak: there is no next letter to break it
    assert not holds("X[!] a", "a")
    assert holds("X[!] b", "a", "b")
    assert not holds("G X[!] true", "a", "b")
    assert holds("G X true", "a", "b")
    assert holds("G X[!] true", "a", cycle="a")


def test_until_and_its_kin():
    assert holds("a U b", "a", "a", "b")
    assert not holds("a U b", "a", "a")
    assert holds("a W b", "a", "a")
    assert holds("b R a", "a", "a")
    assert not holds("b M a", "a", "a")
    assert holds("b M a", "a", "ab", "")
    assert not holds("b M a", "a", "b")


def test_infinitely_often():
    assert holds("G F a", "", cycle="a -")
    assert not holds("F G a", "", cycle="a -")


def test_a_long_formula_and_a_long_word():
    chain = parse_formula(" & ".join(["F a"] * 5000))
    assert satisfies(chain, Word.of([set()] * 200 + [{"a"}]))


def test_every_subformula_at_every_position():
    formula = parse_formula("F a")
    table = truth_table(formula, Word.of([set(), {"a"}, set()]))
    assert table.row(formula) == (True, True, False)
    assert table.at(formula.arguments[0], 1)


def test_too_large_is_bad_input():
    with pytest.raises(BadInput, match="too many to evaluate"):
        satisfies(parse_formula(" & ".join(f"p{i}" for i in range(5000))), Word.of([set()] * 10_000))
