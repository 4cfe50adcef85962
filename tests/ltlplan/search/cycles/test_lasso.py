from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from hypothesis import strategies as st
from scipy.sparse import csr_matrix

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.logic.translation import translate
from ltlplan.search.cycles import lasso as lassos
from ltlplan.search.cycles.cheapest_cycles import cycles_below, cycles_may_exist
from ltlplan.search.cycles.lasso import cheapest_lasso
from ltlplan.search.cycles.team_readers import closes_at_once
from ltlplan.systems.transition_systems import TransitionSystem
from tests.helpers.few import few_of, given_few
from tests.helpers.words.timelines import mission
from tests.strategies import formulas, letters
from verify.data import Formula, Word
from verify.logic.semantics import satisfies


@st.composite
def systems(draw: st.DrawFn) -> TransitionSystem:
    size = draw(st.integers(1, 4))
    labels = tuple(draw(letters(("a", "b"))) for _ in range(size))
    edges = tuple(
        tuple((t, float(draw(st.integers(0, 4)))) for t in draw(st.sets(st.integers(0, size - 1), max_size=3)))
        for _ in range(size)
    )
    final = None if draw(st.booleans()) else dict.fromkeys(draw(st.sets(st.integers(0, size - 1))), 0.0)
    return TransitionSystem(labels, edges, 0, final)


def paths(system: TransitionSystem, most: int) -> list[tuple[float, tuple[int, ...]]]:
    found = [(0.0, (system.initial,))]
    for cost, path in found:  # grows while it is walked
        if len(path) < most:
            found += [(cost + step, (*path, target)) for target, step in system.edges[path[-1]]]
    return found


def word(system: TransitionSystem, path: tuple[int, ...]) -> Word:
    return Word(tuple(system.labels[node] for node in path))


@given_few(10, 60, systems(), formulas(with_next=True, names=("a", "b"), size=4))
def test_lassos_satisfy_their_formula_and_are_found_if_there_are_any(system: TransitionSystem, formula: Formula) -> None:
    resting = TransitionSystem(system.labels, system.edges, 0, {})  # no hovering: every letter is a step
    automaton = translate(formula, "infinite")
    assert isinstance(automaton, Automaton)
    run = cheapest_lasso(resting, [automaton], weight=2.0)
    best = math.inf
    for cost, path in paths(resting, 6):
        for cut in range(len(path) - 1):
            if path[cut] == path[-1]:
                prefix = sum(min(c for t, c in resting.edges[a] if t == b) for a, b in itertools.pairwise(path[: cut + 1]))
                lasso = Word(word(resting, path).prefix[:cut], word(resting, path).prefix[cut:-1])
                if satisfies(formula, lasso):
                    best = min(best, prefix + 2 * (cost - prefix))
    if run is None:
        assert best == math.inf
        return
    labels = resting.labels
    assert satisfies(formula, Word(tuple(labels[n] for n in run.prefix), tuple(labels[n] for n in run.cycle)))


@given_few(10, 60, systems(), formulas(with_next=False, names=("a", "b"), size=4))
def test_no_word_is_cheaper_than_the_cheapest_cycle(system: TransitionSystem, formula: Formula) -> None:
    """A cycle of a word may be less than a round of the automaton: the search judges it by what it does to all states."""
    asked = mission("true", trace="infinite")
    free = dataclasses.replace(system, final=None)  # it may hover anywhere
    automaton = translate(formula, "infinite")
    assert isinstance(automaton, Automaton)
    run = cheapest_lasso(free, [automaton])
    assert (run is not None) == cycles_may_exist(asked, [free], formula, DEFAULT_BUDGET)
    found = cycles_below(asked, [free], formula, DEFAULT_BUDGET, math.inf)
    if run is None or found.cycles is None:
        assert run is None
        assert found.cycles is None
        return
    (prefix,), (cycle,) = found.cycles.prefixes, found.cycles.cycles
    assert satisfies(formula, Word(word(free, prefix).prefix, word(free, cycle[1:] or cycle).prefix))
    cost = sum(min(c for t, c in free.edges[a] if t == b) for way in (prefix, cycle) for a, b in itertools.pairwise(way))
    assert cost <= run.cost(1.0) + 1e-6
    assert found.cycles.exact
    assert found.least == pytest.approx(cost, abs=1e-5)
    for price, path in paths(free, 5):
        for cut in range(len(path)):
            if path[cut] == path[-1] and price < cost - 1e-6:
                letters_before, lap = word(free, path).prefix[: cut + 1], word(free, path).prefix[cut + 1 :]
                assert not satisfies(formula, Word(letters_before, lap or letters_before[-1:]))


def test_two_goals_for_ever_take_one_round_in_the_shorter_order() -> None:
    labels = tuple(map(frozenset, ([], ["a"], ["b"], ["c"])))
    away = {(1, 2): 5.0, (2, 3): 5.0, (3, 1): 5.0, (1, 3): 1.0, (3, 2): 1.0, (2, 1): 1.0}
    edges = tuple(
        tuple((t, away.get((s, t), 1.0)) for t in range(1, 4) if t != s) if s else tuple((t, 1.0) for t in range(1, 4))
        for s in range(4)
    )
    system = TransitionSystem(labels, edges, 0)
    automata = [translate(f"G F {name}", "infinite") for name in "abc"]
    run = cheapest_lasso(system, automata)  # type: ignore[arg-type]
    assert run is not None
    assert run.cycle_cost == pytest.approx(3.0, abs=1e-6)
    assert run.prefix_cost == pytest.approx(1.0, abs=1e-6)


def places(count: int, seed: int) -> tuple[TransitionSystem, np.ndarray]:
    """A robot at the first of some places, each with a name of its own, that all can be reached from each other on straight lines."""
    points = np.random.default_rng(seed).uniform(-3, 3, (count + 1, 2))
    away = np.linalg.norm(points[:, None] - points[None], axis=2)
    labels = tuple(frozenset({f"p{i}"} if i else ()) for i in range(count + 1))
    edges = tuple(tuple((t, float(away[s, t])) for t in range(1, count + 1) if t != s) for s in range(count + 1))
    return TransitionSystem(labels, edges, 0), away


def always_again(names: list[str]) -> list[Automaton]:
    automata = [translate(f"G F {name}", "infinite") for name in names]
    return [automaton for automaton in automata if isinstance(automaton, Automaton)]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("weight", [1.0, 3.0])
def test_many_goals_for_ever_against_every_order(seed: int, weight: float) -> None:
    system, away = places(6, seed)
    run = cheapest_lasso(system, always_again([f"p{i}" for i in range(1, 7)]), weight=weight)
    tours = [(1, *order) for order in itertools.permutations(range(2, 7))]
    lengths = [sum(away[a, b] for a, b in itertools.pairwise((*order, order[0]))) for order in tours]
    assert run is not None
    assert run.prefix_cost + weight * run.cycle_cost == pytest.approx(away[0, 1:].min() + weight * min(lengths), abs=1e-6)
    assert run.bound == pytest.approx(run.prefix_cost + weight * run.cycle_cost, abs=1e-6)


@few_of(3, "seed", range(8))
def test_bounds_by_trees_and_by_orders_lead_to_the_same_round(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Goals may be shown at several places; a round is found with one bound and with the other."""
    system, _ = places(11, seed)
    rng = np.random.default_rng(seed)
    labels = tuple(letter | ({f"q{rng.integers(4)}"} if rng.random() < 0.5 else set()) for letter in system.labels)
    system = dataclasses.replace(system, labels=labels)
    automata = [*always_again([f"p{i}" for i in range(1, 8)] + ["q0", "q1"]), translate("G(p3 -> F q0)", "infinite")]
    runs = []
    for most in (lassos.MOST_ORDERED, 0):
        monkeypatch.setattr(lassos, "MOST_ORDERED", most)
        runs.append(cheapest_lasso(system, automata, weight=2.0))  # type: ignore[arg-type]
    first, second = runs
    if first is None or second is None:
        assert first is second
        return
    assert first.prefix_cost + 2 * first.cycle_cost == pytest.approx(second.prefix_cost + 2 * second.cycle_cost, abs=1e-6)
    hurried = cheapest_lasso(system, automata, weight=2.0, budget=Budget(rounds=1))  # type: ignore[arg-type]
    assert hurried is not None
    cost = hurried.prefix_cost + 2 * hurried.cycle_cost
    exact = first.prefix_cost + 2 * first.cycle_cost
    assert hurried.bound - 1e-6 <= exact <= cost + 1e-6
    assert hurried.bound < cost - 1e-6 or cost == pytest.approx(exact, abs=1e-6)
    word = Word(tuple(labels[n] for n in hurried.prefix), tuple(labels[n] for n in hurried.cycle))
    assert all(automaton.accepts(word) for automaton in automata)


def test_thirty_goals_for_ever_are_one_round_and_thirty_goals_once_are_refused_in_words() -> None:
    system, _ = places(30, 0)
    names = [f"p{i}" for i in range(1, 31)]
    run = cheapest_lasso(system, always_again(names))
    assert run is not None
    assert set(run.cycle) == set(range(1, 31))
    assert run.bound == pytest.approx(run.prefix_cost + run.cycle_cost, abs=1e-6)
    once = [translate(f"F {name}", "infinite") for name in names]
    with pytest.raises(TooLarge, match="more than 2,000 states"):
        cheapest_lasso(system, once, budget=Budget(lasso=2_000))  # type: ignore[arg-type]


def test_an_automaton_that_forgets_closes_at_once() -> None:
    assert closes_at_once(*always_again(["a"]))
    for formula in ("F a", "G(a -> F b)", "F G a"):
        automaton = translate(formula, "infinite")
        assert isinstance(automaton, Automaton)
        assert not closes_at_once(automaton)


def test_the_weight_decides_between_prefix_and_cycle() -> None:
    labels = tuple(map(frozenset, ([], ["a"], ["a"])))
    system = TransitionSystem(labels, (((1, 1.0), (2, 10.0)), ((1, 3.0),), ((2, 0.5),)), 0, {})
    automaton = translate("G F a", "infinite")
    near = cheapest_lasso(system, [automaton], weight=1.0)  # type: ignore[list-item]
    far = cheapest_lasso(system, [automaton], weight=10.0)  # type: ignore[list-item]
    assert near is not None
    assert far is not None
    assert near.cycle == (1,)
    assert far.cycle == (2,)


def test_the_best_round_of_a_local_search_is_found_next_to_costs_beside_which_a_hover_is_none():
    """A leg that was shut out costs so much that what lies behind it is no nearer after a step than after a hover."""
    graph = csr_matrix(np.array([[1e-11, 1e-10, 0.0], [0.0, 1e-11, 3e5], [1.0, 0.0, 1e-11]]))
    component = lassos.Rounds(graph, np.array([0.0, 1.0, 1.0]), [0b01, 0b00, 0b10], 2, 1.0)
    (home,) = component.homes
    found = component.through(home, np.inf, 0)
    assert sorted(found.places) == [0, 1, 2]
    assert found.cost == pytest.approx(300_001.0)
