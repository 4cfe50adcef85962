"""Random labelled graphs and conjunctions, for holding searches against plain walks over everything."""

from __future__ import annotations

import math

from hypothesis import strategies as st

from ltlplan.systems.transition_systems import TransitionSystem
from tests.strategies import formulas
from verify.data import Formula, Letter, Word

LETTERS: tuple[Letter, ...] = tuple(frozenset(names) for names in ("", "a", "b", "c", "ab", "d"))  # d: no formula asks for it


@st.composite
def systems(draw: st.DrawFn, most: int = 7) -> TransitionSystem:
    """Any labelled graph with costs: letters repeat, edges are few, some nodes are no places to end at."""
    size = draw(st.integers(1, most))
    labels = tuple(draw(st.sampled_from(LETTERS)) for _ in range(size))
    edges = tuple(
        tuple(
            (target, float(draw(st.integers(0, 5))))
            for target in draw(st.lists(st.integers(0, size - 1), max_size=3, unique=True))
        )
        for _ in range(size)
    )
    final = draw(st.none() | st.dictionaries(st.integers(0, size - 1), st.just(0.0), min_size=1))
    return TransitionSystem(labels, edges, 0, final)


def _conjunction(parts: list[Formula]) -> Formula:
    whole = parts[0]
    for part in parts[1:]:
        whole = Formula("&", (whole, part))
    return whole


def tasks(*, with_next: bool) -> st.SearchStrategy[Formula]:
    """Conjunctions of small formulas."""
    return st.lists(formulas(size=4, with_next=with_next), min_size=1, max_size=3).map(_conjunction)


def simple_words(system: TransitionSystem, most: int) -> list[tuple[float, Word]]:
    """The cheapest path for each word of at most `most` nodes."""
    found: dict[Word, float] = {}
    paths = [((system.initial,), 0.0)]
    for path, cost in paths:  # grows while it is walked
        if system.final is None or path[-1] in system.final:
            word = Word(tuple(system.labels[node] for node in path)).compressed()
            found[word] = min(cost, found.get(word, math.inf))
        if len(path) < most:
            paths += [((*path, target), cost + step) for target, step in system.edges[path[-1]]]
    return [(cost, word) for word, cost in found.items()]
