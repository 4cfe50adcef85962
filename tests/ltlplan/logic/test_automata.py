from __future__ import annotations

import itertools
import time

import pytest
from hypothesis import given, settings

import ltlplan
from ltlplan.logic.automaton import DEAD, Automaton
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.logic.conjunction import Conjunction, conjunct_automata
from ltlplan.logic.determinisation import determinise, determinised, intersection, minimise
from ltlplan.logic.product_automaton import Task
from ltlplan.logic.small_automata import read_hoa
from ltlplan.logic.translation import translate
from tests.helpers.few import given_few
from tests.strategies import finite_words, formulas, lassos
from verify.data import BadInput, Formula, FormulaError, Word
from verify.logic.semantics import satisfies

FIRE = "F loc1 & F loc2 & G(smoke -> carrying)"


@given_few(10, 60, formulas(with_next=True, size=6), finite_words())
def test_finite_automata_accept_what_the_formula_means(formula: Formula, word: Word) -> None:
    wanted = satisfies(formula, word)
    assert translate(formula).accepts(word) == wanted
    small = translate(formula, form="small")
    assert isinstance(small, Automaton)
    assert small.accepts(word) == wanted
    assert determinised(small).accepts(word) == wanted


SHORT_WORDS = tuple(
    Word(word)
    for length in range(1, 5)
    for word in itertools.product((frozenset[str](), frozenset("a"), frozenset("b"), frozenset("ab")), repeat=length)
)


@given_few(4, 25, formulas(with_next=True, names=("a", "b"), size=5))
def test_all_short_words_are_accepted_as_the_formula_means(formula: Formula) -> None:
    """All 340 words of up to four letters, by the smallest automaton, a conjunction and a task that reads letters by number."""
    automaton = translate(formula)
    letters = (frozenset[str](), frozenset("a"), frozenset("b"), frozenset("ab"))
    task = Task(conjunct_automata(formula, "finite"), letters)
    for word in SHORT_WORDS:
        meant = satisfies(formula, word)
        assert automaton.accepts(word) == meant
        after = task.run(letters.index(letter) for letter in word.prefix)
        assert (after != DEAD and task.is_accepting(after)) == meant


@given_few(10, 60, formulas(with_next=True, size=6), lassos())
def test_buchi_automata_accept_what_the_formula_means(formula: Formula, word: Word) -> None:
    assert translate(formula, "infinite").accepts(word) == satisfies(formula, word)


@settings(max_examples=30, deadline=None)
@given(formulas(size=6), finite_words())
def test_a_repeated_letter_changes_nothing_without_next(formula: Formula, word: Word) -> None:
    automaton = translate(formula)
    twice = Word(tuple(letter for letter in word.prefix for _ in range(2)))
    assert automaton.accepts(word) == automaton.accepts(twice)


@settings(max_examples=30, deadline=None)
@given(formulas(with_next=True, size=5), formulas(with_next=True, size=5), finite_words())
def test_a_conjunction_accepts_what_both_parts_accept(first: Formula, second: Formula, word: Word) -> None:
    both = Formula("&", (first, second))
    wanted = satisfies(first, word) and satisfies(second, word)
    assert translate(both).accepts(word) == wanted
    one, other = translate(first), translate(second)
    assert isinstance(one, Automaton)
    assert isinstance(other, Automaton)
    assert minimise(intersection(one, other)).accepts(word) == wanted
    assert Conjunction((translate(first, form="small"), other)).accepts(word) == wanted  # type: ignore[arg-type]


@given_few(5, 30, formulas(with_next=True, size=6), finite_words())
def test_deterministic_automata_have_one_way_and_no_smaller_equal(formula: Formula, word: Word) -> None:
    automaton = translate(formula)
    assert isinstance(automaton, Automaton)
    assert automaton.deterministic
    assert len(minimise(automaton).states) == len(automaton.states)
    assert len(determinise(automaton).states) == len(automaton.states)
    at = automaton.initial
    for letter in word.prefix:
        at = automaton.successor(at, letter)
        assert at == DEAD or at in automaton.states
    assert (at in automaton.accepting) == automaton.accepts(word)


@settings(max_examples=30, deadline=None)
@given(formulas(with_next=True, size=6), finite_words(), lassos())
def test_hoa_keeps_the_language(formula: Formula, word: Word, lasso: Word) -> None:
    finite, infinite = translate(formula), translate(formula, "infinite")
    assert isinstance(finite, Automaton)
    assert isinstance(infinite, Automaton)
    assert read_hoa(finite.to_hoa(), trace="finite").accepts(word) == finite.accepts(word)
    assert read_hoa(infinite.to_hoa(), trace="infinite").accepts(lasso) == infinite.accepts(lasso)


@settings(max_examples=20, deadline=None)
@given(formulas(with_next=True, size=6), finite_words())
def test_every_letter_acts_as_one_of_the_representatives(formula: Formula, word: Word) -> None:
    automaton = translate(formula)
    assert isinstance(automaton, Automaton)
    acts = {tuple(automaton.successor(s, letter) for s in automaton.states) for letter in automaton.letters}
    for letter in word.prefix:
        assert tuple(automaton.successor(s, letter) for s in automaton.states) in acts


def test_the_fire_fighting_automaton() -> None:
    automaton = ltlplan.translate(FIRE)
    assert len(automaton.states) == 4
    assert len(automaton.accepting) == 1
    assert automaton.successor(automaton.initial, {"smoke"}) == DEAD
    assert automaton.successor(DEAD, {"loc1"}) == DEAD
    at = automaton.initial
    for letter in [{"loc1"}, set(), {"smoke", "carrying"}, {"loc2", "carrying"}]:
        at = automaton.successor(at, letter)
    assert at in automaton.accepting


def test_guards_are_readable() -> None:
    automaton = translate("F(a & b)")
    assert isinstance(automaton, Automaton)
    (end,) = automaton.accepting
    assert automaton.guard(automaton.initial, end) == "a & b"
    assert automaton.guard(end, end) == "true"
    assert automaton.guard(end, automaton.initial) == "false"
    graph = automaton.to_networkx()
    assert graph.nodes[automaton.initial]["initial"]
    assert {data["guard"] for _, _, data in graph.edges(data=True)} >= {"a & b", "true"}
    assert "doublecircle" in automaton.to_dot()


def test_names_that_begin_like_operators_are_names() -> None:
    automaton = translate("F Gate1 & G !FIRE")
    assert automaton.propositions == ("FIRE", "Gate1")
    assert automaton.accepts(Word.of([[], ["Gate1"]]))
    assert not automaton.accepts(Word.of([["FIRE"], ["Gate1"]]))


def test_strong_and_weak_next_at_the_end_of_a_word() -> None:
    assert translate("X a").accepts(Word.of([[]]))
    assert not translate("X[!] a").accepts(Word.of([[]]))


def test_a_word_may_end_where_a_weak_next_has_no_next() -> None:
    for text in ("G X X[!] a", "X G X[!] a", "a & G X X[!] a"):
        assert translate(text).accepts(Word.of([["a"]]))
        assert not translate(text).accepts(Word.of([["a"], ["a"]]))


def test_a_proposition_may_be_called_alive() -> None:
    assert translate("F !alive").accepts(Word.of([["alive"], []]))
    assert not translate("G alive").accepts(Word.of([["alive"], []]))


def test_the_empty_language_has_no_accepting_state() -> None:
    assert not translate("F a & G !a").accepting
    assert not translate("F a & G !a", "infinite").accepting


def test_twelve_goals_are_not_multiplied_out() -> None:
    automaton = translate(" & ".join(f"F p{i}" for i in range(12)))
    assert isinstance(automaton, Conjunction)
    assert automaton.accepts(Word.of([[f"p{i}"] for i in range(12)]))
    assert not automaton.accepts(Word.of([[f"p{i}"] for i in range(11)]))


def test_a_conjunction_lists_its_states_when_asked() -> None:
    parts = [translate(f"F {name}") for name in "abc"]
    automaton = Conjunction(parts)  # type: ignore[arg-type]
    assert len(automaton.states) == 8
    assert len(automaton.accepting) == 1
    assert automaton.successor(automaton.initial, {"a", "b", "c"}) in automaton.accepting


def test_twenty_nested_goals_are_quick() -> None:
    text = "F p20"
    for i in range(19, 0, -1):
        text = f"F(p{i} & {text})"
    start = time.process_time()
    automaton = translate(text)
    assert len(automaton.states) == 21
    assert time.process_time() - start < 10


def test_a_hostile_formula_ends_with_an_error() -> None:
    hostile = "G F z <-> (" + " & ".join(f"G F a{i}" for i in range(14)) + ")"
    start = time.monotonic()
    with pytest.raises(TooLarge, match="Translating the formula"):
        translate(hostile, budget=Budget(seconds=0.3))
    assert time.monotonic() - start < 20


def test_a_hostile_formula_does_not_fill_the_memory() -> None:
    hostile = "F G z <-> (" + " & ".join(f"(F G a{i} | G F b{i})" for i in range(14)) + ")"
    with pytest.raises(TooLarge):
        translate(hostile, budget=Budget(seconds=5.0, megabytes=300))


def test_determinising_has_a_budget() -> None:
    automaton = translate("F(a & X X X X X X X X b)", form="small")
    assert isinstance(automaton, Automaton)
    with pytest.raises(TooLarge, match="more than 20 states"):
        determinise(automaton, budget=Budget(automaton=20))
    with pytest.raises(TooLarge, match="more than 5 states"):
        Conjunction((automaton,), Budget(automaton=5)).states  # noqa: B018


@pytest.mark.parametrize(
    ("text", "reason"),
    [("HOA: v1\nfoo", "no automaton in HOA"), ("", "no automaton in HOA"), ("digraph {}", "no automaton in HOA")],
)
def test_broken_hoa_is_refused(text: str, reason: str) -> None:
    with pytest.raises(BadInput, match=reason):
        read_hoa(text, trace="finite")


def test_hoa_for_finite_words_needs_acceptance_on_states() -> None:
    text = 'HOA: v1\nStates: 1\nStart: 0\nAP: 1 "a"\nAcceptance: 2 Inf(0) & Inf(1)\n--BODY--\nState: 0\n[0] 0 {0 1}\n--END--\n'
    with pytest.raises(BadInput, match="Inf"):
        read_hoa(text, trace="finite")
    assert read_hoa(text, trace="infinite").accepts(Word.of([], [["a"]]))


def test_misuse_is_refused() -> None:
    with pytest.raises(FormulaError):
        translate("F (a")
    with pytest.raises(BadInput, match="trace"):
        translate("a", "forever")  # type: ignore[arg-type]
    with pytest.raises(BadInput, match="form"):
        translate("a", form="big")  # type: ignore[arg-type]
    finite, infinite = translate("F a"), translate("G F a", "infinite")
    with pytest.raises(BadInput, match="finite"):
        finite.accepts(Word.of([], [["a"]]))
    with pytest.raises(BadInput, match="cycle"):
        infinite.accepts(Word.of([["a"]]))
    with pytest.raises(BadInput, match="not the string"):
        finite.successor(finite.initial, "a")
    small = translate("F(a & X b)", form="small")
    assert isinstance(small, Automaton)
    assert len(small.successors(small.initial, {"a"})) > 1
    with pytest.raises(BadInput, match="nondeterministic"):
        small.successor(small.initial, {"a"})
    assert isinstance(infinite, Automaton)
    with pytest.raises(BadInput, match="not made deterministic"):
        determinised(infinite)
