"""Team words that the planner leaves open, against the checker."""

from __future__ import annotations

from random import Random

import pytest

from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.orders.linearisations import Linearisations
from tests.helpers.missions.random_teams import random_formula
from tests.helpers.words.linearisations import events_of
from verify import check_ordered
from verify.data import Formula, parse_formula
from verify.data.language.counting import atoms

Words = dict[str, tuple[frozenset[str], ...]]
Pairs = list[tuple[tuple[str, int], tuple[str, int]]]


def is_broken(formula: Formula, words: Words, pairs: Pairs) -> bool:
    """Tell whether the planner finds a team word under `own` that keeps precedences and breaks a formula."""
    marks, robots = Marks(conjunct_automata(formula, "finite"), atoms(formula)), list(words)
    shown = [[(marks.of(name, letter),) for letter in word] for name, word in words.items()]
    numbered = [((robots.index(a), i), (robots.index(b), j)) for (a, i), (b, j) in pairs]
    return Linearisations(marks, shown, joint=False).broken(numbered) is not None


@pytest.mark.parametrize(("seed", "cases"), [(0, 80), pytest.param(1, 3000, marks=pytest.mark.slow)])
def test_robots_that_are_alike_and_letters_that_are_not_told_apart_lose_no_word(seed: int, cases: int) -> None:
    rng, letters = Random(seed), [frozenset(text) for text in ("", "a", "b", "ab", "c")]
    for case in range(cases):
        one = tuple(rng.choice(letters) for _ in range(rng.randint(2, 4)))
        words = {"quad0": one, "quad1": one, "quad2": tuple(rng.choice(letters) for _ in range(rng.randint(1, 4)))}
        order = events_of(words)
        rng.shuffle(order)
        order.sort(key=lambda event: event[1])
        pairs = [(e, f) for i, e in enumerate(order) for f in order[i + 1 :] if e[0] != f[0] and rng.random() < 0.3]
        formula = parse_formula("F(a & X b)") if case % 5 == 0 else random_formula(rng, rng.randint(2, 7))
        fails = check_ordered(formula, words, pairs, "own").outcome == "fails"
        assert is_broken(formula, words, pairs) == fails, (str(formula), words, pairs)


def test_five_robots_that_carry_before_a_sixth_brings_its_load_are_one_case() -> None:
    """Written out one by one these are over 400 000 steps."""
    carrying, bringing = ("", "p", "pc", "c"), ("", "p", "pc", "c", "cd", "d", "", "p", "pc", "c", "ce", "e", "")
    words = {f"quad{i}": tuple(map(frozenset, carrying)) for i in range(5)} | {"quad5": tuple(map(frozenset, bringing))}
    formula = parse_formula("F(p & c & (c U (d & !c))) & F(p & c & (c U (e & !c)))")
    pairs = [((f"quad{i}", 3), ("quad5", 4)) for i in range(5)]
    assert not is_broken(formula, words, pairs)
    assert is_broken(formula, words, pairs[1:])
    assert check_ordered(formula, words, pairs, "own").outcome == "holds"
