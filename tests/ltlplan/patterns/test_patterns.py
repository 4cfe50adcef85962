"""Every pattern of `docs/patterns.md` is planned, for one to four robots, by words that Spot accepts; and refined and certified."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from random import Random

import pytest

from ltlplan import plan
from ltlplan.allocation import Allocation, Itinerary
from ltlplan.logic.conjunction import conjuncts
from ltlplan.pipeline import certified_team
from ltlplan.search.exact import assign
from tests.helpers.few import few_of
from tests.helpers.missions.patterns import cases, patterns
from tests.helpers.words.plain_team_words import Held, holds
from tests.helpers.words.spot_reading import spot_accepts
from verify.data import Formula, Letter, Mission, Word
from verify.data.plan import Precedence

ORDERS = 3
"""Orders of a team that are judged, drawn where there are more."""
FLOWN = ("visit-1-own", "fair_patrolling-1-own", "upper_restricted_avoidance-2-joint", "wait-4-joint", "patrolling-2-joint")
CASES = {str(case): case for case in cases()}
WORDS = [name for name, case in CASES.items() if case.robots == 1 or case.pattern.trace == "finite"]
"""Those whose words are judged here; laps of teams are by the certificate."""
QUICK = ("past_avoidance", "global_avoidance", "wait", "escort", "one_at_a_time")
"""Patterns that four robots under `joint` are asked in every run; the others take seconds of Spot's."""


def planned_in_every_run(name: str) -> bool:
    case = CASES[name]
    return case.team == "own" or case.robots == 2 or (case.robots == 4 and name.startswith(QUICK))


def slow_unless(quick: bool, name: str):
    return pytest.param(name, marks=() if quick else pytest.mark.slow)


def test_all_patterns_that_need_no_next_are_there() -> None:
    names = [pattern.name for pattern in patterns()]
    assert len(names) == len(set(names)) == 25
    movement = ["", "sequenced ", "ordered ", "strict ordered ", "fair "]
    published = [f"{how}{what}" for what in ("visit", "patrolling") for how in movement]
    published += ["past avoidance", "global avoidance", "future avoidance", "wait"]
    published += [f"{how} restricted avoidance" for how in ("upper", "exact", "lower")]
    published += ["instantaneous reaction", "delayed reaction"]
    assert set(published) <= set(names)


@few_of(5, "name", [slow_unless(planned_in_every_run(name), name) for name in WORDS])
def test_a_pattern_is_planned_by_words_that_spot_accepts(name: str) -> None:
    case = CASES[name]
    mission = case.mission
    found = assign(mission)
    if case.robots == 1:
        (robot,) = found.robots.values()
        assert tuple(visit.region for visit in robot.visits) == case.pattern.flown
        assert accepted(mission.formula, robot.word)
    elif case.team == "own":
        for order in itertools.islice(itertools.permutations(found.robots.values()), ORDERS):
            letters = [letter for robot in order for letter in robot.word.letters]
            assert accepted(mission.formula, Word(tuple(letters)))
    else:
        for seed in range(ORDERS):
            assert accepted(*as_propositions(mission, flown_in_some_order(found, Random(seed))))


@few_of(2, "name", [slow_unless(name in FLOWN, name) for name in CASES])
def test_a_pattern_is_refined_and_certified(name: str, pace: float | str) -> None:
    done = certified_team(plan(CASES[name].mission, pace=pace))
    assert all(claim.outcome == "holds" for claim in done.certificate.claims)


def accepted(formula: Formula, word: Word) -> bool:
    """Tell whether Spot accepts a word by each part of a formula."""
    return all(spot_accepts(part, word) for part in conjuncts(formula))


def flown_in_some_order(found: Allocation, rng: Random) -> list[Held]:
    """Return a team word of words that keep their waits: one robot goes on by one letter at each position, drawn at random."""
    words = {name: robot.word.letters for name, robot in found.robots.items()}
    entered = {name: list(_entered(robot)) for name, robot in found.robots.items()}
    at = dict.fromkeys(words, 0)
    team = [{name: word[0] for name, word in words.items()}]

    def letter(event: str, robot: str, visit: int) -> int:
        """Return at which letter a visit is entered or left."""
        if event.startswith("enter"):
            return entered[robot][visit]
        return _left(words[robot], entered[robot][visit], found.robots[robot].visits[visit].region) + 1

    def is_due(wait: Precedence) -> bool:
        return at[wait.then[0]] + 1 >= letter(wait.due, *wait.then) and at[wait.first[0]] < letter(wait.done, *wait.first)

    while True:
        free = [
            name
            for name, word in words.items()
            if at[name] + 1 < len(word)
            and not any(is_due(wait) for wait in found.precedences if wait.then[0] == name)
            and all(
                at[first] >= entered[first][visit]
                for first, visit, then in ((m.first[0], m.first[1], m.then[1]) for m in found.meetings if m.then[0] == name)
                if at[name] + 1
                > (_left(words[name], entered[name][then - 1], found.robots[name].visits[then - 1].region) if then else 0)
            )
        ]
        if not free:
            assert all(at[name] + 1 == len(word) for name, word in words.items()), "the waits go round in a circle"
            return team
        at[rng.choice(free)] += 1
        team.append({name: word[at[name]] for name, word in words.items()})


def _entered(robot: Itinerary) -> Iterator[int]:
    """Yield at which letter each visit begins."""
    at = 0
    for visit in robot.visits:
        letters = robot.word.letters
        while visit.region not in letters[at] or (at and visit.region in letters[at - 1]):
            at += 1
        yield at
        at += 1


def _left(word: tuple[Letter, ...], entered: int, region: str) -> int:
    """Return at which letter a stay in a region that was begun is last shown."""
    last = entered
    while last + 1 < len(word) and region in word[last + 1]:
        last += 1
    return last


def as_propositions(mission: Mission, team: list[Held]) -> tuple[Formula, Word]:
    """Return formula and word over a proposition for each thing that is said of the team, told position by position."""
    said: dict[str, Formula] = {}

    def named(formula: Formula) -> Formula:
        if formula.operator in ("name", "count"):
            said[formula.atom] = formula
            return Formula("name", (), formula.atom)
        return Formula(formula.operator, tuple(named(part) for part in formula.arguments))

    asked = named(mission.formula)
    return asked, Word(tuple(frozenset(text for text, node in said.items() if holds(node, [held])) for held in team))
