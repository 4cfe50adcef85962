"""Which parts to keep, against every subset."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ltlplan.logic.budget import TooLarge
from ltlplan.search.explanations.max_weight_subset import MostWeight, Parts, comparable

CORES = st.lists(st.frozensets(st.integers(0, 5), min_size=1, max_size=3), max_size=5)
WEIGHTS = st.lists(st.sampled_from([0.1, 0.2, 0.3, 1.0, 2.5]), min_size=6, max_size=6)


def cost_beside(cores: list[Parts], searched: list[Parts] | None = None):
    """Return costs of keeping parts of which some cannot be kept together."""

    def cost_of(kept: Parts) -> float | None:
        if searched is not None:
            searched.append(kept)
        return None if any(core <= kept for core in cores) else float(sum((part + 3) ** 2 % 7 for part in kept))

    return cost_of


@given(CORES, WEIGHTS, st.frozensets(st.integers(0, 5), max_size=2))
def test_the_choice_is_the_best_of_all_subsets(cores: list[Parts], weights: list[float], forced: Parts) -> None:
    cost_of, shares = cost_beside(cores), comparable(weights)
    subsets = (frozenset(kept) | forced for n in range(7) for kept in itertools.combinations(range(6), n))
    possible = [(-sum(shares[i] for i in kept), cost) for kept in subsets if (cost := cost_of(kept)) is not None]
    searched: list[Parts] = []
    found = MostWeight(weights, cost_beside(cores, searched)).choose(forced)
    if found is None:
        assert not possible
        return
    assert (-sum(shares[i] for i in found.parts), found.cost) == min(possible)
    assert found.certain
    assert forced <= found.parts
    assert len(searched) == len(set(searched))


@given(CORES, WEIGHTS, st.sampled_from([0.1, 3.0, 7.7, 1e-6, 1e6]))
def test_the_unit_of_weights_changes_nothing(cores: list[Parts], weights: list[float], unit: float) -> None:
    choices = [MostWeight([w * by for w in weights], cost_beside(cores)).choose() for by in (1.0, unit)]
    assert choices[0] == choices[1]


def test_equal_sums_are_equal_and_small_weights_still_count() -> None:
    thirds, small = comparable([0.1, 0.2, 0.3]), comparable([1e-9, 1.0])
    assert thirds[0] + thirds[1] == thirds[2]
    assert 0 < small[0] < small[1] == 1


@pytest.mark.parametrize("searches", [0, 1, 3, 7])
def test_few_searches_leave_a_choice_that_is_possible_and_said_to_be_uncertain(searches: int) -> None:
    cores = [frozenset({a, b}) for a, b in itertools.combinations(range(6), 2)]
    found = MostWeight([1.0, 2.0, 3.0, 6.0, 5.0, 4.0], cost_beside(cores), searches=searches).choose()
    assert found is not None
    assert found.parts == {3}
    assert not found.certain


def test_what_is_too_large_to_search_is_not_taken_for_impossible() -> None:
    asked: list[Parts] = []

    def cost_of(kept: Parts) -> float | None:
        asked.append(kept)
        if len(kept) == 2:
            raise TooLarge("The search needs", 2, "states", 1)
        return 1.0

    choices = MostWeight([1.0, 2.0], cost_of)
    found = choices.choose()
    choices.choose(frozenset({0}))
    assert asked.count(frozenset({0, 1})) == 1  # not again
    assert found is not None
    assert found.parts == {1}
    assert not found.certain
    assert not choices.alone_impossible(0)
