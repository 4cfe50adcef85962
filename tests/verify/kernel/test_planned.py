"""Planned words under waits: the kernel against brute force and the judge, and which letters a plan's waits are between."""

from __future__ import annotations

import json
from fractions import Fraction
from random import Random
from types import SimpleNamespace
from typing import Any, Literal

import pytest

from tests.helpers.kernel.kernel_words import kernel_statement
from tests.helpers.missions.random_teams import random_formula
from tests.helpers.words.brute_force import Together, outcomes
from tests.helpers.words.random_counts import random_counting_formula
from tests.helpers.words.timelines import mission
from verify import check_ordered
from verify.data import Formula, Letter, Word
from verify.data.plan import Meeting, Precedence, RobotPlan, Visit, Waypoint
from verify.data.sections import Action
from verify.kernel.statement import Refused, Statement, Wait
from verify.kernel.trees import Evidence
from verify.kernel.words import check_words, planned
from verify.proofs.words import find_ordered
from verify.trace_checking import planned_order

FILL = Action.model_validate({"from": "dry", "to": "wet", "at": "a"})

READINGS: tuple[Literal["own"], Literal["joint"]] = ("own", "joint")

Events = list[tuple[tuple[str, int], tuple[str, int]]]


def stated(formula: Formula | str, reading: str, words: dict[str, tuple[Letter, ...]]) -> Any:
    """Return a statement of planned words; a test gives it waits."""
    statement: Any = kernel_statement(mission(str(formula), team=reading, robots=len(words)), Fraction(0))
    statement.words = words
    for robot in statement.robots.values():
        robot.visits, robot.changes = (), ()
    return statement


def accepts(statement: Statement) -> bool:
    """Return whether the kernel accepts the proof that the search finds."""
    try:
        check_words(planned(statement), Evidence(json.loads(json.dumps(find_ordered(statement)))))
    except Refused:
        return False
    return True


@pytest.mark.parametrize(("seed", "number"), [(1, 60), pytest.param(2, 3000, marks=pytest.mark.slow)])
def test_planned_words_agree_with_brute_force_and_judge(seed: int, number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = Random(seed)
    events: Events = []
    monkeypatch.setattr("verify.kernel.words.waits_between", lambda _: events)
    found: set[bool] = set()
    for _ in range(number):
        robots = ("q0", "q1", "q2")[: rng.randint(1, 3)]
        if rng.random() < 0.45:
            formula, reading = random_counting_formula(rng, rng.randint(1, 7), robots), "joint"
        else:
            formula, reading = random_formula(rng, rng.randint(1, 7)), rng.choice(READINGS)
        words = {
            robot: tuple(frozenset(name for name in "abc" if rng.random() < 0.4) for _ in range(rng.randint(1, 3)))
            for robot in robots
        }
        comes = [(robot, k) for robot, word in words.items() for k in range(1, len(word))]
        events = [(a, b) for a in comes for b in comes if a[0] != b[0] and rng.random() < 0.2]
        mine = accepts(stated(formula, reading, words))
        case = str(formula), reading, words, events
        assert mine == (outcomes(formula, robots, Together(words, reading, events)) == {True}), case
        assert mine == (check_ordered(formula, words, events, reading).outcome == "holds"), case
        found.add(mine)
    assert found == {True, False}


def walk(rng: Random) -> tuple[tuple[Letter, ...], list[Visit]]:
    """Return a word in which regions are come to one at a time, and the visits that it shows; water is taken in at a."""
    inside, wet = {"b"} if rng.random() < 0.2 else set[str](), False
    letters = [frozenset(inside)]
    visits = [] if not inside or rng.random() < 0.5 else [Visit(region="b")]
    for _ in range(rng.randint(0, 5)):
        if "a" in inside and not wet and rng.random() < 0.6:
            wet, at = True, max(k for k, visit in enumerate(visits) if visit.region == "a")
            visits[at] = Visit(region="a", actions=(FILL,))
        else:
            region = rng.choice("abc")
            if region not in inside:
                visits.append(Visit(region=region))
            inside ^= {region}
        letters.append(frozenset(inside) | ({"water"} if wet else set()))
    return tuple(letters), visits


def judged(
    walks: dict[str, tuple[tuple[Letter, ...], list[Visit]]], waits: list[Precedence | Meeting], monkeypatch: pytest.MonkeyPatch
) -> Events | None:
    """Return the events between which the judge of plans takes waits to be; None where one waits for what never happens."""
    given = mission("true", robots=len(walks))
    rest = (Waypoint(position=(0.0, 0.0, 1.0), role="start"),)
    robots = {
        name: RobotPlan(word=Word.of(letters), visits=tuple(visits), waypoints=rest, times=(0.0,))
        for name, (letters, visits) in walks.items()
    }
    asked: list[Events] = []
    monkeypatch.setattr(planned_order, "check_ordered", lambda formula, words, pairs, *_, **__: asked.append(list(pairs)))
    plan: Any = SimpleNamespace(
        mission=given,
        robots=robots,
        words={name: robot.word for name, robot in robots.items()},
        precedences=[wait for wait in waits if isinstance(wait, Precedence)],
        meetings=[wait for wait in waits if isinstance(wait, Meeting)],
    )
    planned_order.check_planned_order(plan)
    return asked[0] if asked else None


@pytest.mark.parametrize(("seed", "number"), [(1, 300), pytest.param(2, 8000, marks=pytest.mark.slow)])
def test_waits_are_between_the_same_events_as_the_judge_says(seed: int, number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = Random(seed)
    found: set[bool] = set()
    for _ in range(number):
        walks = {name: walk(rng) for name in ("q0", "q1")}
        if not all(visits for _, visits in walks.values()):
            continue
        statement = stated("true", "joint", {name: letters for name, (letters, _) in walks.items()})
        waits: list[Precedence | Meeting] = []
        for first, then in rng.choice([[("q0", "q1")], [("q1", "q0")], [("q0", "q1"), ("q0", "q1")]]):
            ends = {"first": (first, rng.randrange(len(walks[first][1]))), "then": (then, rng.randrange(len(walks[then][1])))}
            done, due = rng.choice(["left", "entered", "acted"]), rng.choice(["enters", "leaves", "acts"])
            meets = rng.random() < 0.3
            waits.append(
                Meeting.model_validate(ends) if meets else Precedence.model_validate({**ends, "done": done, "due": due})
            )
        waits.sort(key=lambda wait: isinstance(wait, Meeting))
        for name, (_, visits) in walks.items():
            statement.robots[name].visits = tuple(SimpleNamespace(region=visit.region) for visit in visits)
            statement.robots[name].changes = tuple(
                SimpleNamespace(visit=k, before="dry", after="wet") for k, visit in enumerate(visits) for _ in visit.actions
            )
        statement.waits = tuple(
            Wait(wait.first, wait.then, "entered", "sets out")
            if isinstance(wait, Meeting)
            else Wait(wait.first, wait.then, wait.done, wait.due)
            for wait in waits
        )
        wanted = judged(walks, waits, monkeypatch)
        try:
            mine: Events | str | None = list(next(planned(statement))[1].waits)
        except Refused as refused:
            mine = str(refused)
        never = isinstance(mine, str)
        assert (mine == wanted and not never) or (never and (wanted is None or "circle" in str(mine))), (walks, waits)
        found.add(bool(mine) and not never)
    assert found == {True, False}


def test_words_that_do_not_show_the_visits_are_refused() -> None:
    statement = stated("F a", "own", {"q0": (frozenset(), frozenset("a")), "q1": (frozenset(), frozenset("b"))})
    statement.robots["q0"].visits, statement.robots["q1"].visits = (
        (SimpleNamespace(region="a"),),
        (SimpleNamespace(region="b"),),
    )
    statement.waits = (Wait(("q0", 0), ("q1", 0), "entered", "enters"),)
    assert accepts(statement)
    statement.robots["q0"].visits = (SimpleNamespace(region="c"),)
    assert not accepts(statement)


def test_who_waits_for_each_other_in_a_circle_flies_nowhere() -> None:
    words = {"q0": (frozenset[str](), frozenset("a")), "q1": (frozenset[str](), frozenset("b"))}
    statement = stated("false", "own", words)
    for name, region in (("q0", "a"), ("q1", "b")):
        statement.robots[name].visits = (SimpleNamespace(region=region),)
    statement.waits = (Wait(("q0", 0), ("q1", 0), "entered", "enters"), Wait(("q1", 0), ("q0", 0), "entered", "enters"))
    with pytest.raises(Refused, match="circle"):
        check_words(planned(statement), Evidence({}))
