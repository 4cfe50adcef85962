"""Numbers of states, and all states that some lead to."""

from __future__ import annotations

import itertools

import networkx
import pytest

from ltlplan.search.numbering import Numbers, closure


def test_keys_are_numbered_as_they_come_up() -> None:
    numbers = Numbers(["a", "b"])
    assert [numbers[key] for key in ("b", "c", "a", "c")] == [1, 2, 0, 2]
    assert numbers.known == ["a", "b", "c"]


@pytest.mark.parametrize("seed", range(5))
def test_a_closure_is_what_can_be_reached_each_once(seed: int) -> None:
    graph = networkx.gnp_random_graph(12, 0.1, seed=seed, directed=True)
    found = list(closure([0, 3, 0], graph.successors))
    assert sorted(found) == sorted({0, 3} | networkx.descendants(graph, 0) | networkx.descendants(graph, 3))


def test_an_endless_closure_is_walked_as_far_as_it_is_asked_for() -> None:
    assert list(itertools.islice(closure([1], lambda n: (2 * n, 2 * n + 1)), 7)) == [1, 2, 3, 4, 5, 6, 7]
