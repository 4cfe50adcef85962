"""Whether there is a plan, against all short words and all orders of their events."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from random import Random

import pytest

from ltlplan.search.exact import assign
from tests.helpers.few import few_of
from tests.helpers.missions.own_places import own_places
from tests.helpers.missions.random_teams import random_formula
from tests.helpers.words.linearisations import Event, Words, courses, events_of
from tests.helpers.words.plain_team_words import Held, holds
from verify import check_ordered, check_team
from verify.data import Formula, Letter, Plan, RobotPlan, Unsatisfiable
from verify.data.language.formula_reader import parse_formula
from verify.trace_checking.planned_order import check_planned_order

TEAMS = (
    {"quad0": "a", "quad1": "bc"},
    {"quad0": "ab", "quad1": "bc"},
    {"quad0": "ac", "quad1": "b"},
    {"quad0": "a", "quad1": "b", "quad2": "c"},
)


def words_of(places: str, visits: int) -> Iterator[tuple[Letter, ...]]:
    """Yield the words of a robot that starts in free flight and makes up to some visits; it may end outside."""
    for count in range(visits + 1):
        for tour in itertools.product(places, repeat=count):
            word = [frozenset[str]()]
            for place in tour:
                word += [frozenset(place), frozenset[str]()]
            yield tuple(word)
            if tour:
                yield tuple(word[:-1])


def read_plainly(words: Words, course: list[Event], joint: bool) -> list[Held]:
    """One team word that an order of events leaves open: everybody is read after each event."""
    at = dict.fromkeys(words, 0)
    found: list[Held] = []
    for event in [None, *course]:
        if event is not None:
            at[event[0]] = event[1]
        held = {name: words[name][index] for name, index in at.items()}
        found += [held] if joint else [{name: letter} for name, letter in held.items()]
    return found


def is_possible(formula: Formula, may_enter: dict[str, str], team: str, visits: int) -> bool:
    """Tell whether some short words and some order of their events satisfy a formula whatever is read when."""
    for letters in itertools.product(*(list(words_of(places, visits)) for places in may_enter.values())):
        words = dict(zip(may_enter, letters, strict=True))
        if len(events_of(words)) > 6:
            continue
        for course in courses(words, (), shared=False):
            order = [event for (event,) in course]
            if not holds(formula, read_plainly(words, order, team == "joint")):
                continue
            chain = [pair for pair in itertools.combinations(order, 2) if pair[0][0] != pair[1][0]]
            if team == "joint" or check_ordered(formula, words, chain, "own"):
                return True
    return False


def agrees(seed: int, visits: int) -> None:
    rng = Random(seed)
    formula = random_formula(rng, rng.randint(3, 8))
    formula = parse_formula(str(formula).replace("water", "a"))
    team = rng.choice(["own", "joint"])
    may_enter = rng.choice(TEAMS)
    mission = own_places(str(formula), may_enter, team=team)
    try:
        found = assign(mission, explained=False)
    except Unsatisfiable:
        assert not is_possible(mission.formula, may_enter, team, visits), (seed, str(formula), team, may_enter)
        return
    words = {name: robot.word for name, robot in found.robots.items()}
    if not found.precedences:
        assert check_team(mission.formula, words, mission.spec.team).sequential, (seed, str(formula), team)
        return
    point = {"position": (0.0, 0.0, 1.0), "role": "start"}
    robots = {
        name: RobotPlan.model_validate({"word": robot.word, "visits": robot.visits, "waypoints": [point], "times": [0.0]})
        for name, robot in found.robots.items()
    }
    plan = Plan(mission=mission, robots=robots, precedences=found.precedences)
    assert check_planned_order(plan).outcome == "holds", (seed, str(formula), team)


@few_of(8, "seed", range(24))
def test_small_worlds_agree_with_brute_force(seed: int) -> None:
    agrees(seed, 1)


@pytest.mark.slow  # all orders of all short words, for three hundred formulas
@pytest.mark.parametrize("block", range(10))
def test_many_small_worlds_agree_with_brute_force(block: int) -> None:
    for seed in range(30 * block, 30 * (block + 1)):
        agrees(1000 + seed, 2)
