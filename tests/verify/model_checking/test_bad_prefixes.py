"""Formulas for ever that are broken already, held against Spot's automata."""

from __future__ import annotations

from fractions import Fraction
from random import Random

import pytest

from tests.helpers.missions.random_teams import random_formula, short_timeline
from tests.helpers.words.bad_prefix_oracle import is_lost, some_events
from verify.data.language.formula import Formula
from verify.data.language.formula_reader import parse_formula
from verify.model_checking.bad_prefixes import first_never_kept, never_kept, until
from verify.model_checking.timeline import Change, Enclosure, InternalChange, Relations, Timeline

BUDGET = 20_000
FREELY = Relations()


def crossings(rng: Random, robot: str, *, robots: int, index: int, count: int) -> Timeline:
    """A robot that surely goes into regions and out again, never at the instant at which another one does."""
    initial = {name: rng.choice(["no", "must"]) for name in "abc"}
    status, changes = dict(initial), []
    for number in range(count):
        name = rng.choice("abc")
        status[name] = "no" if status[name] == "must" else "must"
        time = Fraction(1 + number * robots + index)
        changes.append(Change(Enclosure(time, time), name, status[name]))
    return Timeline(robot, initial, tuple(changes), Fraction(1 + count * robots))


def eventful(rng: Random, size: int) -> Formula:
    """A formula without internal states, often one that can be broken at once."""
    formula = random_formula(rng, size).substitute({"water": Formula("name", (), "a")})
    return formula if rng.random() < 0.4 else Formula("&", (formula, Formula("G", (random_formula(rng, 2),)))).substitute(
        {"water": Formula("name", (), "b")}
    )  # fmt: skip


def held_against_spot(count: int, seed: int) -> tuple[int, int]:
    rng = Random(seed)
    yes = no = 0
    for _ in range(count):
        robots, reading = rng.choice([(1, "own"), (1, "own"), (2, "own"), (2, "joint")])
        formula = eventful(rng, rng.randint(1, 7))
        team = {
            f"r{i}": crossings(rng, f"r{i}", robots=robots, index=i, count=rng.randint(1, 4) if robots == 1 else 2)
            for i in range(robots)
        }
        found = never_kept(formula, team, FREELY, reading, BUDGET)
        wanted = is_lost(formula, robots, some_events(team, rng), own=reading == "own")
        assert (found is not None) == wanted, (str(formula), team, reading)
        yes, no = yes + wanted, no + (not wanted)
    return yes, no


@pytest.mark.slow
def test_flights_that_leave_nothing_open_are_lost_exactly_where_spot_says_so():
    yes, no = held_against_spot(250, 1)
    assert yes > 50
    assert no > 50


@pytest.mark.slow
def test_many_flights_that_leave_nothing_open_are_lost_exactly_where_spot_says_so():
    assert min(held_against_spot(8000, 2)) > 1600  # a fifth of them, as of the few


def none_lost_is_saved(count: int, seed: int) -> int:
    rng = Random(seed)
    lost = 0
    for _ in range(count):
        robots, reading = rng.choice([(1, "own"), (2, "own"), (2, "joint")])
        formula = eventful(rng, rng.randint(1, 6))
        team = {f"r{i}": short_timeline(rng, f"r{i}", touching=True) for i in range(robots)}
        team = {name: Timeline(name, line.initial, line.changes, line.duration) for name, line in team.items()}
        if never_kept(formula, team, FREELY, reading, BUDGET) is None:
            continue
        lost += 1
        for _ in range(10):
            events = some_events(team, rng)
            assert is_lost(formula, robots, events, own=reading == "own"), (str(formula), team, events)
    return lost


def test_no_flight_that_agrees_with_what_is_lost_can_be_saved():
    assert none_lost_is_saved(50, 3) > 7


@pytest.mark.slow
def test_no_flight_of_many_that_agrees_with_what_is_lost_can_be_saved():
    assert none_lost_is_saved(6000, 4) > 900


def line(*changes: tuple[float, str, str], end: float = 10.0, **initial: str) -> Timeline:
    found = [Change(Enclosure(Fraction(t), Fraction(t)), name, status) for t, name, status in changes]
    return Timeline("r0", {"a": "no", "b": "no", **initial}, tuple(found), Fraction(end))


VISIT = line((2, "a", "may"), (3, "a", "must"), (5, "a", "may"), (6, "a", "no"))


@pytest.mark.parametrize(
    ("formula", "since"),
    [
        ("G !a", 3),
        ("!a U b", 3),
        ("G F b & G !a", 3),
        ("G(a -> F b) & G !b", 3),  # of the two parts together, none of which is broken by itself
        ("F G a & G(!a -> F G !a)", 0),  # once out of a it never settles there
        ("G a", 0),
        ("G F a & F G !b", None),
        ("G F b", None),
        ("G(a -> F b)", None),
        ("G(b -> F a)", None),
    ],
)
def test_what_is_lost_is_lost_from_the_first_instant_that_is_sure(formula, since):
    asked = parse_formula(formula)

    def lost(flown) -> bool:
        return never_kept(asked, flown, FREELY, "own", BUDGET) is not None

    assert lost({"r0": VISIT}) == (since is not None)
    if since is not None:
        assert first_never_kept({"r0": VISIT}, lost) == since


def test_letters_that_regions_do_not_allow_save_nothing():
    asked, flown = parse_formula("F(a & b)"), {"r0": VISIT}
    assert never_kept(asked, flown, FREELY, "own", BUDGET) is None
    apart = Relations(disjoint=frozenset({("a", "b")}))
    assert str(never_kept(asked, flown, apart, "own", BUDGET)) == "F (a & b)"
    two = {"r0": VISIT, "r1": Timeline("r1", VISIT.initial, (), VISIT.duration)}
    assert never_kept(asked, two, apart, "own", BUDGET) is not None
    assert never_kept(asked, two, apart, "joint", BUDGET) is None, "one robot in each"


def test_what_may_or_may_not_have_been_loses_nothing():
    assert never_kept(parse_formula("G !a"), {"r0": line((2, "a", "may"), (3, "a", "no"))}, FREELY, "own", BUDGET) is None


def test_nothing_is_cut_off_while_an_action_may_be_under_way():
    action = InternalChange(Fraction(2), "", "", "", -1, frozenset({"wet"}), Fraction(4))
    flown = Timeline(
        "r0", {"a": "no"}, (Change(Enclosure(Fraction(3), Fraction(3)), "a", "must"),), Fraction(9), actions=(action,)
    )
    asked = parse_formula("G !wet")
    seen: list[Fraction] = []

    def lost(flights) -> bool:
        seen.append(flights["r0"].duration)
        return never_kept(asked, flights, FREELY, "own", BUDGET) is not None

    assert first_never_kept({"r0": flown}, lost) == 4
    assert not any(2 <= time < 4 for time in seen)
    assert until(flown, Fraction(1)).actions == ()


def test_more_letters_than_can_be_followed_refute_nothing():
    names = [f"x{i}" for i in range(12)]
    flown = {"r0": Timeline("r0", dict.fromkeys(names, "must"), (), Fraction(1))}
    asked = parse_formula("G(" + " & ".join(f"F !{name}" for name in names) + " & !(" + " & ".join(names) + "))")
    assert never_kept(parse_formula("G !x0"), flown, FREELY, "own", BUDGET) is not None
    assert never_kept(asked, flown, FREELY, "own", BUDGET) is None
