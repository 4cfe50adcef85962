import pytest

from tests.helpers.few import given_few
from tests.strategies import finite_words, formulas, letters
from verify.data import parse_formula
from verify.logic.normal_form import conjuncts, normal_form, to_formula
from verify.logic.progression import REFUTED, SETTLED, Automaton, OutOfBudget
from verify.logic.semantics import satisfies


def accepts(automaton: Automaton, word) -> bool:
    return automaton.accepts(automaton.run(word.prefix))


@given_few(50, 300, formulas(with_next=True), finite_words())
def test_progression_agrees_with_semantics(formula, word):
    expected = satisfies(formula, word)
    assert accepts(Automaton(normal_form(formula)), word) == expected
    assert accepts(Automaton(normal_form(formula, negated=True)), word) != expected


@given_few(25, 150, formulas(with_next=True), finite_words())
def test_normal_form_and_conjuncts_mean_the_same(formula, word):
    normal = normal_form(formula)
    expected = satisfies(formula, word)
    assert satisfies(to_formula(normal), word) == expected
    assert all(satisfies(to_formula(part), word) for part in conjuncts(normal)) == expected


@given_few(25, 150, formulas(with_next=True), finite_words(), letters())
def test_doomed_and_settled_are_for_ever(formula, word, letter):
    automaton = Automaton(normal_form(formula))
    state = automaton.run(word.prefix)
    after = automaton.step(state, automaton.cut(letter))
    if state == REFUTED:
        assert after == REFUTED
        assert not automaton.accepts(state)
    if state == SETTLED:
        assert after == SETTLED
        assert automaton.accepts(state)


def test_always_comes_apart():
    parts = conjuncts(normal_form(parse_formula("G(a & (b -> c)) & F d & F(a | b)")))
    assert sorted(str(to_formula(part)) for part in parts) == ["F a | F b", "F d", "G (!b | c)", "G a"] or len(parts) == 4


def test_a_conjunction_of_twelve_goals_is_walked_without_its_4096_states():
    automaton = Automaton(normal_form(parse_formula(" & ".join(f"F p{i}" for i in range(12)))))
    state = automaton.initial
    for i in range(12):
        assert not automaton.accepts(state)
        state = automaton.step(state, frozenset({f"p{i}"}))
    assert state == SETTLED


def test_a_disjunction_of_conjunctions_stays_small():
    formula = parse_formula(" & ".join(f"(F a{i} | F b{i})" for i in range(30)))
    automaton = Automaton(normal_form(formula))
    state = automaton.run([frozenset({f"a{i}"}) for i in range(29)])
    assert not automaton.accepts(state)
    assert automaton.run([frozenset({"b29"})], state) == SETTLED


def test_too_many_operators_are_out_of_budget():
    with pytest.raises(OutOfBudget, match="temporal operators"):
        Automaton(normal_form(parse_formula(" | ".join(f"F G p{i}" for i in range(400)))))
