from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ltlplan.automata import Automaton, translate
from ltlplan.budget import Budget, TooLarge
from ltlplan.lasso import lasso_exists
from ltlplan.runs import cheapest_lasso, cheapest_repeated, cheapest_run, k_best
from ltlplan.systems import TransitionSystem
from ltlplan.word_lasso import improve_lasso
from tests.strategies import formulas, letters
from verify.data import BadInput, Formula, Word
from verify.semantics import satisfies


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


@settings(max_examples=60, deadline=None)
@given(systems(), formulas(with_next=True, names=("a", "b"), size=4))
def test_the_cheapest_run_against_all_paths(system: TransitionSystem, formula: Formula) -> None:
    good = [
        cost
        for cost, path in paths(system, 6)
        if (system.final is None or path[-1] in system.final) and satisfies(formula, word(system, path))
    ]
    run = cheapest_run(system, translate(formula))
    if run is None:
        assert not good
    else:
        assert satisfies(formula, run.word)
        assert run.cost <= min(good, default=math.inf)
        if len(run.nodes) <= 6:
            assert run.cost == min(good)


@settings(max_examples=40, deadline=None)
@given(systems(), formulas(names=("a", "b"), size=4))
def test_the_k_best_runs_come_in_order_and_once(system: TransitionSystem, formula: Formula) -> None:
    automaton = translate(formula)
    runs = k_best(system, automaton, 5)
    assert len({run.nodes for run in runs}) == len(runs)
    assert [run.cost for run in runs] == sorted(run.cost for run in runs)
    for run in runs:
        assert satisfies(formula, run.word)
    small = translate(formula, form="small")
    assert [run.cost for run in k_best(system, small, 5)] == [run.cost for run in runs]
    good = sorted(
        cost
        for cost, path in paths(system, 6)
        if (system.final is None or path[-1] in system.final) and satisfies(formula, word(system, path))
    )
    for mine, brute in zip([run.cost for run in runs], good, strict=False):
        assert mine <= brute


@settings(max_examples=40, deadline=None)
@given(systems(), formulas(names=("a", "b"), size=4), st.integers(1, 3))
def test_a_repeated_suffix_against_all_short_ones(system: TransitionSystem, formula: Formula, repeats: int) -> None:
    automaton = translate(formula)
    assert isinstance(automaton, Automaton)
    found = cheapest_repeated(system, automaton, repeats)
    best = math.inf
    every = paths(system, 6)
    for cost, path in every:
        for cut in range(1, len(path)):
            if path[cut - 1] == path[-1]:
                prefix = sum(min(c for t, c in system.edges[a] if t == b) for a, b in itertools.pairwise(path[:cut]))
                flown = (*path[:cut], *(path[cut:] * repeats))
                if satisfies(formula, word(system, flown)):
                    best = min(best, prefix + repeats * (cost - prefix))
    if found is None:
        assert best == math.inf
        return
    assert found.prefix[-1] == found.cycle[-1]
    assert satisfies(formula, word(system, (*found.prefix, *(found.cycle * repeats))))
    assert found.prefix_cost + repeats * found.cycle_cost <= best


@settings(max_examples=60, deadline=None)
@given(systems(), formulas(with_next=True, names=("a", "b"), size=4))
def test_lassos_satisfy_their_formula_and_are_found_if_there_are_any(system: TransitionSystem, formula: Formula) -> None:
    resting = TransitionSystem(system.labels, system.edges, 0, {})  # no hovering: every letter is a step
    automaton = translate(formula, "infinite")
    assert isinstance(automaton, Automaton)
    run = cheapest_lasso(resting, [automaton], weight=2.0)
    assert (run is not None) == lasso_exists(resting, [automaton])
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
    better, certain = improve_lasso(resting, [automaton], run, weight=2.0, states=20_000)
    assert satisfies(formula, Word(tuple(labels[n] for n in better.prefix), tuple(labels[n] for n in better.cycle)))
    assert better.prefix_cost + 2 * better.cycle_cost <= run.prefix_cost + 2 * run.cycle_cost + 1e-6
    if certain:
        assert better.prefix_cost + 2 * better.cycle_cost <= best + 1e-6


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


def test_misuse_is_refused() -> None:
    system = TransitionSystem((frozenset("a"),), (((0, 1.0),),), 0)
    with pytest.raises(BadInput, match="cheapest_lasso"):
        cheapest_run(system, translate("G F a", "infinite"))
    with pytest.raises(BadInput, match="k must be"):
        k_best(system, translate("F a"), 0)
    infinite = translate("G F a", "infinite")
    assert isinstance(infinite, Automaton)
    with pytest.raises(BadInput, match="at least one repetition"):
        cheapest_repeated(system, infinite, 2)
    with pytest.raises(TooLarge):
        k_best(system, translate("F b"), 2, budget=Budget(states=0))
