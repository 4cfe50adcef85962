"""Formulas that grow: every question about words ends in a verdict, or in `undecided` with the budget that ran out."""

from __future__ import annotations

import itertools
import random

import pytest

from tests.helpers.few import few_of
from verify import check_team, check_word
from verify.data import Formula, Word, parse_formula
from verify.data.language.counting import written_out
from verify.logic.normal_form import conjuncts, normal_form
from verify.logic.progression import OutOfBudget
from verify.logic.semantics import satisfies
from verify.logic.spot_opinion import LetterGraph, some_word_breaks
from verify.logic.tableau_size import tableau_states
from verify.model_checking.inclusion import READINGS
from verify.model_checking.lassos import Tableau


def xor(names: int) -> str:
    return " xor ".join(f"a{i}" for i in range(names))


def equivalences(names: int) -> str:
    return " <-> ".join(f"F a{i}" for i in range(names))


def responses(count: int) -> str:
    return " U ".join(f"G(a{i} -> F b{i})" for i in range(count))


def nested(count: int) -> str:
    text = "true"
    for i in range(count):
        text = f"(({text}) U (a{i} & F b{i}))"
    return text


FAMILIES = {"xor": xor, "equivalences": equivalences, "responses": responses, "nested": nested}


def random_team(seed: int, size: int) -> dict[str, list[set[str]]]:
    rng = random.Random(seed)
    names = [f"{letter}{i}" for letter in "ab" for i in range(size)]
    return {f"q{k}": [set(rng.sample(names, 2)), set(rng.sample(names, 3)), set(names[:size])] for k in range(3)}


@pytest.mark.parametrize(
    ("size", "teams"),
    [
        (4, 1),
        pytest.param(12, 3, marks=pytest.mark.slow),
        (17, 1),
        *(pytest.param(size, 3, marks=pytest.mark.slow) for size in (20, 30)),
    ],
)
@few_of(2, "family", FAMILIES)
def test_one_after_another_is_what_all_orders_give(family: str, size: int, teams: int) -> None:
    """Held against every order, word by word, by direct semantics."""
    formula = parse_formula(FAMILIES[family](size))
    for seed in range(teams):
        team = random_team(seed, size)
        verdict = check_team(formula, team)
        orders = itertools.permutations(team)
        kept = all(satisfies(formula, Word.of([x for name in order for x in team[name]])) for order in orders)
        if verdict.sequential.outcome == "undecided":
            assert "more than" in verdict.sequential.sentence
        else:
            assert verdict.sequential.outcome == ("holds" if kept else "fails")
        if verdict.parallel.outcome == "holds":
            assert kept
        assert check_word(formula, team["q0"]).outcome == ("holds" if satisfies(formula, Word.of(team["q0"])) else "fails")


@pytest.mark.parametrize(
    ("formula", "says"),
    [
        (xor(300), "600 temporal operators and literals; 250 is the most"),
        ("F(" + " | ".join(f"a{i}" for i in range(5000)) + ")", "10000 temporal operators and literals; 250 is the most"),
        (responses(60), "250 is the most"),
    ],
)
def test_what_is_too_large_names_the_budget(formula: str, says: str) -> None:
    team = check_team(formula, random_team(0, 4))
    for verdict in (team.sequential, team.parallel):
        assert verdict.outcome == "undecided"
        assert says in verdict.sentence


@pytest.mark.slow
def test_hundreds_of_conjuncts_are_one_question_each() -> None:
    words = random_team(0, 5)
    text = " & ".join(f"F a{i}" for i in range(400))
    assert check_team(text, words).sequential.outcome == "fails"
    assert (
        check_team(" & ".join(f"(a{i} | !a{i + 1} | F b{i % 5})" for i in range(400)), words).sequential.outcome != "undecided"
    )


def test_a_formula_that_shares_its_parts_costs_its_parts() -> None:
    node = Formula("name", (), "a0")
    for i in range(60):
        node = Formula("xor", (node, Formula("|", (node, Formula("name", (), f"a{i % 7}")))))
    word = [{"a0", "a3"}, {"a1"}]
    assert check_word(node, word).outcome == check_team(node, {"r0": word}).sequential.outcome


@pytest.mark.parametrize("formula", [equivalences(10), responses(8), xor(20), nested(14)])
def test_spot_is_not_asked_for_what_it_would_take_long_for(formula: str) -> None:
    (part,) = conjuncts(normal_form(parse_formula(formula)))
    letters = tuple((0, frozenset({f"a{i}"}), 1) for i in range(3))
    with pytest.raises(OutOfBudget, match=r"Spot is not asked for the second opinion: .* more than"):
        some_word_breaks(LetterGraph(2, letters, final=frozenset({1})), part)


def test_spot_is_not_asked_for_a_team_that_is_too_large_with_its_formula() -> None:
    (part,) = conjuncts(normal_form(parse_formula(nested(7))))
    edges = tuple((i, frozenset[str](), i + 1) for i in range(9_999))
    with pytest.raises(OutOfBudget, match="states together; 1000000 is the most"):
        some_word_breaks(LetterGraph(10_000, edges, final=frozenset({9_999})), part)


def test_long_chains_of_visits_are_small() -> None:
    text = "a0"
    for i in range(1, 40):
        text = f"a{i} & F({text})"
    (part,) = conjuncts(normal_form(parse_formula(f"F({text})"), negated=True))
    assert tableau_states(part) < 200
    (both,) = conjuncts(normal_form(parse_formula(equivalences(7)), negated=True))
    assert 3**6 < tableau_states(both) < 3**8


def test_many_robots_at_once_are_counted_by_readings() -> None:
    team = {f"q{i}": [[f"a{i}"], [], [f"a{i}"], ["b"]] for i in range(9)}
    verdict = check_team(" | ".join(f"G(a{i} -> F b)" for i in range(9)), team, "joint", budget=500).parallel
    assert verdict.outcome == "undecided"
    assert f"more than {READINGS * 500} readings" in verdict.sentence or "more than 500 configurations" in verdict.sentence


@pytest.mark.slow
def test_reading_an_infinite_trace_is_counted() -> None:
    text = " | ".join(f"(G F a{i} & F G b{i})" for i in range(14))
    tableau = Tableau(normal_form(parse_formula(text), negated=True))
    with pytest.raises(OutOfBudget, match="more than"):
        tableau.read(tableau.initial, frozenset())


def test_a_count_in_a_formula_that_shares_its_parts_is_written_out_once() -> None:
    node = Formula("count", (Formula("name", (), "a0"),), bound=(">=", 2))
    for i in range(60):
        node = Formula("&", (Formula("F", (node,)), Formula("|", (node, Formula("name", (), f"a{i % 7}")))))
    assert sum(1 for _ in written_out(node, ("q0", "q1")).nodes()) == sum(1 for _ in node.nodes())
