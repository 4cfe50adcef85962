"""The judge of words against brute force: random formulas, counts included, and teams; words alone, and flights over time.

Both answers must be equal, for every formula and every team; where they differ, one of the two is wrong.
"""

from __future__ import annotations

from fractions import Fraction
from random import Random

import pytest

from tests.helpers.missions.random_teams import lap_timeline, random_formula, short_timeline
from tests.helpers.words.brute_force import Laps, Timed, Together, for_ever, is_word, outcomes
from tests.helpers.words.plain_team_words import holds, in_turn
from tests.helpers.words.random_counts import random_counting_formula
from tests.helpers.words.timelines import at, mission, timeline
from verify import check_ordered, check_team
from verify.data import Formula, Word, parse_formula
from verify.logic.verdict import TeamVerdict
from verify.model_checking.timeline import Change, Relations, Timeline
from verify.model_checking.word_claims import judge_formula

NAMES = ("quad0", "quad1", "quad2")


def asked(rng: Random, robots: tuple[str, ...], size: int) -> tuple[Formula, str]:
    """Return a formula and how the team is read."""
    if rng.random() < 0.45:
        return random_counting_formula(rng, rng.randint(1, size), robots), "joint"
    return random_formula(rng, rng.randint(1, size)), rng.choice(["own", "joint"])


def words_agree(rng: Random) -> str:
    robots = NAMES[: rng.randint(1, 3)]
    formula, reading = asked(rng, robots, 7)
    words = {
        robot: tuple(frozenset(name for name in "abc" if rng.random() < 0.4) for _ in range(rng.randint(1, 3)))
        for robot in robots
    }
    verdict = check_team(formula, words, reading)
    everywhere = Together(words, reading)
    case = str(formula), reading, words
    assert verdict.parallel.outcome == ("holds" if outcomes(formula, robots, everywhere) == {True} else "fails"), case
    if reading == "joint":
        assert bool(verdict.sequential) == all(holds(formula, word) for word in in_turn(words)), case
    _shows_a_word(verdict, formula, everywhere)
    events = [(robot, i) for robot, word in words.items() for i in range(1, len(word))]
    pairs = [(one, other) for one in events for other in events if one[0] != other[0] and rng.random() < 0.15]
    ordered = outcomes(formula, robots, Together(words, reading, pairs))  # no words at all where they go round in a circle
    assert check_ordered(formula, words, pairs, reading).outcome == ("holds" if ordered == {True} else "fails"), (case, pairs)
    return verdict.parallel.outcome


def _shows_a_word(verdict: TeamVerdict, formula: Formula, words: Together) -> None:
    """A counterexample is a word of the team, and breaks the formula."""
    if verdict.parallel or formula.counts:
        return
    letters = [letter for _, letter in verdict.parallel.readings()]
    assert not holds(formula, [{"": letter} for letter in letters]), str(formula)
    assert is_word(letters, words, lambda held: frozenset().union(*held.values())), (str(formula), letters)


def _open_at_an_end(line: Timeline) -> bool:
    """Tell whether a region that robots may be in, before or after, may change at the very beginning or end."""
    status = dict(line.initial)
    for change in line.changes:
        before, status[change.region] = status[change.region], change.status
        if "may" in (before, change.status) and (change.time.low == 0 or change.time.high == line.duration):
            return True
    return False


def flights_agree(rng: Random) -> tuple[str, bool]:
    robots = tuple(f"q{i}" for i in range(rng.choice([1, 2, 2, 3])))
    formula, reading = asked(rng, robots, 6)
    touching = rng.random() < 0.3
    lines = {robot: short_timeline(rng, robot, touching=touching) for robot in robots}
    error = rng.choice([0, 0, 0, 1]) if len(robots) == 2 else 0
    given = mission(str(formula), team=reading, robots=len(robots))
    (verdict,) = judge_formula(given, lines, Relations(), clock_error=Fraction(error), detail="answer")
    mine = outcomes(formula, robots, Timed(lines, reading, error)) == {True}
    if touching or any(map(_open_at_an_end, lines.values())):  # there the judge leaves the region open
        assert mine or not verdict, (str(formula), reading, error, lines)
    else:
        assert verdict.outcome == ("holds" if mine else "fails"), (str(formula), reading, error, lines)
    return verdict.outcome, mine


def laps_agree(rng: Random, draws: int) -> tuple[bool, bool]:
    """Return whether the judge said yes, and whether a word was drawn that breaks the formula."""
    robots = tuple(f"q{i}" for i in range(rng.choice([1, 2, 2, 3])))
    formula, reading = asked(rng, robots, 6)
    lines = {robot: lap_timeline(rng, robot) for robot in robots}
    error = rng.choice([0, 0, 0, 1]) if len(robots) > 1 else 0
    given = mission(str(formula), team=reading, robots=len(robots), trace="infinite")
    (verdict,) = judge_formula(given, lines, Relations(), clock_error=Fraction(error), detail="counterexample")
    laps = Laps(lines, reading, error)
    words = (laps.word(rng) for _ in range(draws))
    broken = next((word for word in words if word is not None and not for_ever(formula, robots, *word)), None)
    assert not (verdict and broken), (str(formula), reading, error, lines, broken)
    if isinstance(word := verdict.counterexample, Word) and not formula.counts:
        assert not for_ever(formula, ("",), *([{"": letter} for letter in part] for part in (word.prefix, word.cycle or ())))
    return bool(verdict), broken is not None


@pytest.mark.parametrize(("seed", "number"), [(1, 90), *(pytest.param(s, 4000, marks=pytest.mark.slow) for s in (2, 3, 4))])
def test_words_of_teams(seed: int, number: int) -> None:
    rng = Random(seed)
    assert {words_agree(rng) for _ in range(number)} == {"holds", "fails"}


@pytest.mark.parametrize(("seed", "number"), [(1, 8), *(pytest.param(s, 1000, marks=pytest.mark.slow) for s in (2, 3, 4))])
def test_flights_of_teams(seed: int, number: int) -> None:
    rng = Random(seed)
    found = {flights_agree(rng) for _ in range(number)}
    assert found >= {("holds", True), ("fails", False)}


@pytest.mark.parametrize(("seed", "number"), [(1, 6), *(pytest.param(s, 250, marks=pytest.mark.slow) for s in (2, 3))])
def test_laps_of_teams(seed: int, number: int) -> None:
    rng = Random(seed)
    found = [laps_agree(rng, 3 if number < 10 else 8) for _ in range(number)]
    assert {(True, False), (False, True)} <= set(found)
    if number > 100:  # nearly all that is refused is broken by a word that was drawn
        assert found.count((False, True)) > 3 * found.count((False, False))


@pytest.mark.parametrize(
    ("formula", "status", "changes", "holds"),
    [
        ("F !a", "must", [(4, 5, "no")], False),
        ("F !a", "must", [(4, 4.5, "no")], True),
        ("F(!a & F a)", "no", [(4, 5, "must")], True),
        ("!a", "no", [(0, 1, "must")], False),
        ("!a", "no", [(0.5, 1, "must")], True),
        ("a", "must", [(0, 0, "no")], True),
    ],
)
def test_regions_are_closed_at_the_very_ends_of_a_flight(
    formula: str, status: str, changes: list[tuple[float, float, str]], holds: bool
) -> None:
    found = tuple(Change(at(low, high), "a", after) for low, high, after in changes)
    line = Timeline("q0", {"a": status, "b": "no", "c": "no"}, found, Fraction(5))
    assert bool(judge_formula(mission(formula), {"q0": line}, Relations())[0]) == holds
    mine = (
        outcomes(parse_formula(formula), ("q0",), Timed({"q0": line}, "own")) if float(changes[0][1]).is_integer() else {holds}
    )
    assert (mine == {True}) == holds


@pytest.mark.parametrize("trace", ["finite", "infinite"])
@pytest.mark.parametrize(
    ("formula", "says"),
    [
        ("G count(a) <= 0", "`G !a` fails at"),
        ("G !q0.a", "`G !a` fails at"),
        ("each(G !a)", "`G !a` fails at"),
        ("F all(b)", "`b` never happens"),
        ("F count(free & b) >= 1", "`free & b` never happens"),
    ],
)
def test_one_robot_that_counts_itself_is_told_what_it_breaks(formula: str, says: str, trace: str) -> None:
    line = timeline("q0", ("a", 4, 6), cycle=None if trace == "finite" else 2)
    (verdict,) = judge_formula(mission(formula, team="joint", trace=trace), {"q0": line}, Relations())
    assert verdict.outcome == "fails"
    assert says in verdict.sentence


def test_a_team_is_told_what_it_breaks_of_counts_that_come_to_plain_names() -> None:
    lines = {"q0": timeline("q0", ("a", 4, 6)), "q1": timeline("q1", ("b", 4, 6))}
    (verdict,) = judge_formula(mission("G !some(a)", team="joint", robots=2), lines, Relations())
    assert "`G !a` fails at the team's {a" in verdict.sentence
