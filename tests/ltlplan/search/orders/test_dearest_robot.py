"""The dearest robot of plans under precedences, against all short words and all orders of their events."""

from __future__ import annotations

import itertools
import math
from random import Random

import pytest

from ltlplan.search.exact import assign
from tests.helpers.missions.own_places import own_places
from tests.helpers.missions.worlds import PLACES
from tests.helpers.words.linearisations import courses
from tests.helpers.words.plain_team_words import holds
from tests.ltlplan.search.orders.test_against_brute_force import TEAMS, read_plainly, words_of
from verify import check_ordered
from verify.data import Formula, Letter, Unsatisfiable

PARTS = ("F a", "F b", "F c", "!b U a", "!c U b", "!a U c", "!(b | c) U a", "F(a & F c)", "G(a -> F b)", "F(b | c)")
VISITS = 2
BESIDE = ((0.5, -1.0), (3.0, 0.8), (-1.0, 1.0))
"""Starts from which no straight leg passes a region: legs are counted around what the formula forbids for a while, and words here are not."""


def length(letters: tuple[Letter, ...], start: tuple[float, float]) -> float:
    """Return the straight way of a word, m."""
    places = [start, *(PLACES[name] for letter in letters for name in letter)]
    return sum(math.dist(a, b) for a, b in itertools.pairwise(places))


def satisfies(formula: Formula, words: dict[str, tuple[Letter, ...]], team: str) -> bool:
    """Tell whether some order of the words' events satisfies a formula whatever is read when."""
    for course in courses(words, (), shared=False):
        order = [event for (event,) in course]
        if holds(formula, read_plainly(words, order, team == "joint")):
            chain = [pair for pair in itertools.combinations(order, 2) if pair[0][0] != pair[1][0]]
            if team == "joint" or check_ordered(formula, words, chain, "own"):
                return True
    return False


def cheapest(formula: Formula, may_enter: dict[str, str], team: str) -> float:
    """Return what the dearest robot pays at the least with short words; infinite where none of them do it."""
    each = [
        [(length(word, start), word) for word in words_of(places, VISITS)]
        for places, start in zip(may_enter.values(), BESIDE, strict=False)
    ]
    for costs, words in sorted(
        ((tuple(cost for cost, _ in choice), tuple(word for _, word in choice)) for choice in itertools.product(*each)),
        key=lambda choice: max(choice[0]),
    ):
        if satisfies(formula, dict(zip(may_enter, words, strict=True)), team):
            return max(costs)
    return math.inf


def agrees(seed: int) -> bool:
    """Hold a plan under precedences against all short words; False where there is none."""
    rng = Random(seed)
    parts, may_enter, team = rng.sample(PARTS, rng.randint(2, 4)), rng.choice(TEAMS[:3]), rng.choice(["own", "joint"])
    mission = own_places(
        " & ".join(f"({part})" for part in parts), may_enter, team=team, starts=BESIDE, extra="planner: {objective: longest}"
    )
    try:
        found = assign(mission, explained=False)
    except Unsatisfiable:
        return False
    if not found.precedences:
        return False
    best = cheapest(mission.formula, may_enter, team)
    assert found.lower_bound is not None
    assert found.lower_bound <= best + 1e-6, seed
    assert found.complete, seed
    assert found.cost <= best + 1e-5, seed
    if all(len(robot.visits) <= VISITS for robot in found.robots.values()):
        assert found.cost == pytest.approx(best, abs=1e-5), seed
    return True


def test_the_dearest_robot_pays_least_under_precedences() -> None:
    assert agrees(0) or agrees(1) or agrees(2)


@pytest.mark.slow  # all orders of all short words
def test_the_dearest_robots_of_many_teams_pay_least_under_precedences() -> None:
    assert sum(agrees(seed) for seed in range(120)) > 20
