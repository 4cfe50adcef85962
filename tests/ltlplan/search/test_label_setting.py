"""The one best-first search, held against networkx."""

from __future__ import annotations

import math

import networkx
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ltlplan.search.label_setting import BestFirst, distances

GRAPHS = st.dictionaries(
    st.integers(0, 7), st.dictionaries(st.integers(0, 7), st.integers(0, 4).map(float), max_size=4), min_size=8, max_size=8
)
"""For each node its successors with the cost of the step."""


@given(GRAPHS, st.sampled_from(["key", "first"]), st.integers(0, 7))
def test_keys_come_once_in_the_order_of_their_costs(graph: dict, ties: str, goal: int) -> None:
    whole = networkx.DiGraph()
    whole.add_nodes_from(range(8))
    whole.add_weighted_edges_from((a, b, cost) for a, out in graph.items() for b, cost in out.items())
    wanted = networkx.single_source_dijkstra_path_length(whole, 0)
    search = BestFirst([0], lambda key: graph[key].items(), ties=ties)
    found = list(search)
    assert [key for key, _, _ in found] == list(dict.fromkeys(key for key, _, _ in found))
    assert {key: cost for key, cost, _ in found} == wanted == search.costs == distances([0], lambda key: graph[key].items())
    assert [cost for _, cost, _ in found] == sorted(cost for _, cost, _ in found)
    for key in wanted:
        path = search.path(key)
        assert (path[0], path[-1]) == (0, key)
        assert networkx.path_weight(whole, path, "weight") == wanted[key]
    left = networkx.single_source_dijkstra_path_length(whole.reverse(), goal)
    guided = list(BestFirst([0], lambda key: graph[key].items(), lambda key: left.get(key, math.inf)))
    assert next((bound for key, _, bound in guided if key == goal), math.inf) == wanted.get(goal, math.inf)
    assert {key for key, _, _ in guided} - {0} <= left.keys()


def test_it_is_lazy_and_several_starts_are_one_search() -> None:
    numbers = BestFirst([5, 3], lambda key: [(key + 1, 1.0)])
    assert [next(walk) for walk in [iter(numbers)] * 3] == [(3, 0.0, 0.0), (5, 0.0, 0.0), (4, 1.0, 1.0)]


@pytest.mark.parametrize(("ties", "second"), [("key", 1), ("first", 2)])
def test_ties_are_broken_as_asked(ties: str, second: int) -> None:
    search = BestFirst([0], lambda key: [(2, 1.0), (1, 1.0)] if key == 0 else [], ties=ties)
    assert [key for key, _, _ in search][1] == second


def test_a_bound_that_falls_by_more_than_a_step_costs_still_leads_to_the_cheapest_goal() -> None:
    edges = {"start": [("near", 3.0), ("far", 1.0)], "far": [("near", 1.0)], "near": [("goal", 3.0)], "goal": []}
    left = {"start": 0.0, "far": 4.0, "near": 0.0, "goal": 0.0}
    search = BestFirst(["start"], edges.__getitem__, left.__getitem__)
    assert next(cost for key, cost, _ in search if key == "goal") == 5.0
    assert search.path("goal") == ["start", "far", "near", "goal"]
