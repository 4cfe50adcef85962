"""The cheapest plans of small worlds, found by trying everything: tours of a few visits for each robot, in the order of their costs.

What a robot shows and what its tour costs is written down here from the geometry of `tests.helpers.missions.worlds`: round regions far apart,
robots that start in free flight, legs from middle to middle, and a region left and entered again at twice its radius.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from tests.helpers.words.brute_force import Held, Vectors
from tests.helpers.words.plain_team_words import in_turn
from verify.data import Letter, Mission


@dataclass(frozen=True)
class Tour:
    """Visits of one robot, in order, its word and its cost in m."""

    visits: tuple[str, ...]
    word: tuple[Letter, ...]
    cost: float


def tours(start: tuple[float, float, float], places: Mapping[str, tuple[float, float]], radius: float, most: int) -> list[Tour]:
    """Return all tours of up to `most` visits; each ends in its last region or leaves it, which costs nothing."""
    found = [Tour((), (frozenset(),), 0.0)]
    for count in range(1, most + 1):
        for visits in itertools.product(places, repeat=count):
            cost = math.dist(start[:2], places[visits[0]])
            for one, other in itertools.pairwise(visits):
                cost += 2 * radius if one == other else math.dist(places[one], places[other])
            word = tuple(letter for visit in visits for letter in (frozenset(), frozenset({visit})))
            found += [Tour(visits, word, cost), Tour(visits, (*word, frozenset()), cost)]
    return found


def keeps(words: Mapping[str, Sequence[Letter]], reading: str, vectors: Vectors) -> bool:
    """Tell whether robots that fly one after another keep a formula, in every order."""
    return all(vectors.is_true(worth(word, vectors)) for word in _orders(words, reading))


def _orders(words: Mapping[str, Sequence[Letter]], reading: str) -> Iterator[list[Held]]:
    if reading == "joint":
        yield from in_turn(words)
        return
    for order in itertools.permutations(words):
        yield [{"": letter} for name in order for letter in words[name]]


def worth(word: Sequence[Held], vectors: Vectors) -> int:
    """Return what a formula's parts are worth at the beginning of a finite word."""
    vector = None
    for held in reversed(word):
        vector = vectors.before(held, vector)
    assert vector is not None
    return vector


def teams(
    mission: Mission, places: Mapping[str, tuple[float, float]], radius: float, most: int
) -> list[tuple[float, dict[str, Tour]]]:
    """Return all choices of a tour for each robot, the cheapest first."""
    each = [tours(agent.start, places, radius, most) for agent in mission.agents.values()]
    chosen = (dict(zip(mission.agents, choice, strict=True)) for choice in itertools.product(*each))
    return sorted(((sum(tour.cost for tour in choice.values()), choice) for choice in chosen), key=lambda pair: pair[0])


def words_of(choice: Mapping[str, Tour]) -> dict[str, tuple[Letter, ...]]:
    """Return the words of a choice of tours."""
    return {name: tour.word for name, tour in choice.items()}
