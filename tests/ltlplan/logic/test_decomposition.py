from __future__ import annotations

import pytest
from hypothesis import given, settings

import ltlplan
from ltlplan.logic.automaton import DEAD, Automaton
from ltlplan.logic.conjunction import Conjunction
from ltlplan.logic.decomposition import decomposes, decomposition_set
from ltlplan.logic.translation import translate
from tests.helpers.words.actions import actions_of_words
from tests.strategies import formulas
from verify.data import BadInput, Formula


def after(automaton: Automaton, *letters: str) -> int:
    at = automaton.initial
    for letter in letters:
        at = automaton.successor(at, letter.split())
    return at


def test_fire_fighting_decomposes_everywhere() -> None:
    automaton = ltlplan.translate("F loc1 & F loc2 & G(smoke -> carrying)")
    assert ltlplan.decomposition_set(automaton) == frozenset(automaton.states)
    assert len(automaton.states) == 4


def test_known_answers() -> None:
    ordered = translate("F(a & F b)")
    assert decomposition_set(ordered) == {ordered.initial, after(ordered, "a b")}
    until = translate("(!b U a) & F b")
    assert decomposition_set(until) == {until.initial}
    three = translate("F a & F b & F c")
    assert decomposition_set(three) == frozenset(three.states)
    assert len(three.states) == 8
    response = translate("G(a -> F b)")
    assert decomposition_set(response) == {response.initial, after(response, "")}
    assert after(response, "a") not in decomposition_set(response)
    guarded = translate("F a & F b & (!c W a)")
    assert decomposition_set(guarded) == {guarded.initial, after(guarded, "b")}


def test_essential_sequences_would_be_wrong_here() -> None:
    automaton = translate("F a & F b & (!c U a)")
    assert after(automaton, "a") not in decomposition_set(automaton)


def test_nothing_decomposes_where_nothing_can_be_accepted() -> None:
    automaton = translate("F a & G !a")
    assert decomposition_set(automaton) == {automaton.initial}  # vacuously: no word leads to acceptance


@settings(max_examples=60, deadline=None)
@given(formulas(with_next=True, size=4))
def test_against_what_all_words_do(formula: Formula) -> None:
    automaton = translate(formula)
    assert isinstance(automaton, Automaton)
    does = actions_of_words(automaton)
    if does is None:
        return
    start = automaton.initial
    found = decomposition_set(automaton)
    for state in automaton.states:
        first = {f[start] for f in does if f[state] in automaton.accepting}
        second = [g for g in does if g[start] == state]
        kept = all(at != DEAD and g[at] in automaton.accepting for at in first for g in second)
        assert kept == (state in found)


@settings(max_examples=40, deadline=None)
@given(formulas(size=5))
def test_fewer_letters_only_enlarge_the_set(formula: Formula) -> None:
    automaton = translate(formula)
    assert decomposition_set(automaton) <= decomposition_set(automaton, [[], ["a"], ["b"]])


@settings(max_examples=40, deadline=None)
@given(formulas(size=4), formulas(size=4))
def test_part_by_part_suffices_and_the_whole_is_exact(first: Formula, second: Formula) -> None:
    parts = [translate(first), translate(second)]
    whole = Conjunction(parts)  # type: ignore[arg-type]
    exact = decomposition_set(whole)
    for state in whole.states:
        assert isinstance(state, tuple)
        by_parts = all(decomposes(part, at) for part, at in zip(parts, state, strict=True))
        assert decomposes(whole, state) == (state in exact)
        assert not by_parts or state in exact


def test_misuse_is_refused() -> None:
    with pytest.raises(BadInput, match="deterministic automaton on finite words"):
        decomposition_set(translate("G F a", "infinite"))
    with pytest.raises(BadInput, match="deterministic automaton on finite words"):
        decomposition_set(translate("F(a & X b)", form="small"))
