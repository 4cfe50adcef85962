"""Recordings of patrols: what was flown is broken for good, holds if it goes on so, or cannot tell."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cache
from random import Random

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.live.recordings import aside, asked, claims, judged, recorded
from tests.helpers.missions.random_teams import random_formula, short_timeline
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.helpers.words.bad_prefix_oracle import is_lost, some_lasso
from tests.helpers.words.spot_reading import spot_accepts
from tests.helpers.words.timelines import fill, mission
from verify import Samples, certify, check_flight
from verify.data import Letter, Word
from verify.data.language.formula_reader import parse_formula
from verify.data.plan import Visit
from verify.model_checking.timeline import Change, Enclosure, Relations, Timeline
from verify.recordings.recorded_laps import laps_claim

BALLS = """a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}
b: {center: [0.0, 1.0, 1.0], radii: [0.2, 0.2, 0.2]}
c: {center: [-0.5, 0.0, 1.5], radii: [0.15, 0.15, 0.15]}"""
EASTERN = ([0.0, 0.0, 1.0], [0.0, 0.0, 1.5], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.5])
REPEAT = 3
BUDGET = 20_000


@cache
def patrol(formula: str = "G F a & G F b & G !c", robots: int = 1, team: str = "own"):
    """Three laps past a and b; a second robot flies the same ones 1.5 m above, where there is nothing, and all begin together."""
    starts = [[0.0, 0.0, 1.0 + 1.5 * i] for i in range(robots)]
    asks = small_mission(formula, regions=BALLS, starts=starts, margin=0.05, trace="infinite")
    asks = asks.changed(spec={**asks.spec.model_dump(), "repeat": REPEAT, "team": team})
    plan = plan_of(asks, {"r0": [Visit(region="a"), Visit(region="b")]})
    lassos = {name: robot.model_copy(update={"cycle_visit": 0}) for name, robot in plan.robots.items()}
    plan = plan.model_copy(update={"robots": lassos})
    paths = {f"r{i}": legs([[x, y, z + 1.5 * i] for x, y, z in EASTERN], cycle=1) for i in range(robots)}
    return plan, paths, certify(plan, paths)


def lap_of(made) -> tuple[float, float]:
    """When the first lap begins, and how long laps last, s."""
    path = made[1]["r0"]
    begin = float(path.knots[1])
    return begin, path.duration - begin


def flown(made, change=lambda name, times, places: places, *, laps: float = REPEAT) -> Samples:
    begin, lap = lap_of(made)
    return recorded(made, change, end=begin + laps * lap)


def formula_of(verdict):
    return next(claim for claim in verdict.claims if claim.name == "formula")


@few_of(1, ("robots", "team"), [(1, "own"), (2, "own"), (2, "joint")])
def test_laps_as_planned_are_satisfied_if_it_goes_on_so(robots, team):
    formula = "G F a & G F b & G !c" if team == "joint" or robots == 1 else "G F a & G F b & G(a -> F b)"
    made = patrol(formula, robots, team)
    assert made[2].holds, [claim.sentence for claim in made[2].claims if claim.outcome != "holds"]
    verdict = judged(made, flown(made), max_speed=2.0)
    assert verdict, verdict.sentence
    begin, lap = lap_of(made)
    span = f"from {begin + 2 * lap:.4f} to {begin + 3 * lap:.4f} s"
    assert formula_of(verdict).sentence.startswith(f"If it goes on for ever as in the last lap ({span}), ")
    assert verdict.sentence.endswith(f"`formula` holds only if later laps show what the last one did, {span}.")
    assert verdict.premise in verdict.assumptions


def test_where_a_lap_begins_is_known_only_where_the_start_is():
    made = patrol()
    samples = flown(made)
    for start in (None, (-0.001, 0.0)):
        verdict = check_flight(samples, asked(made), max_speed=2.0, start=start)
        assert formula_of(verdict).outcome == "undecided"
        assert "when exactly it began, is not known" in formula_of(verdict).sentence
        assert verdict.premise == ""


@pytest.mark.parametrize(("laps", "outcome"), [(2.9, "holds"), (2.55, "undecided"), (2.2, "undecided"), (2.0, "undecided")])
def test_a_lap_that_was_cut_off_is_not_taken_for_flown(laps, outcome):
    """In the last tenth of its lap the robot flies home from b, having seen both; the recording tells where it was before."""
    made = patrol("G F a & G F b")
    verdict = judged(made, flown(made, laps=laps), max_speed=2.0)
    assert formula_of(verdict).outcome == outcome
    assert verdict.outcome == "undecided"
    assert "undecided" in claims(verdict)["tube"]


@pytest.mark.parametrize(("lap", "formula"), [(0, "holds"), (1, "holds"), (2, "undecided")])
def test_a_visit_that_was_skipped_in_one_lap(lap, formula):
    """Each region is to be seen again and again: one lap without a breaks that only if it is the one that goes on."""
    made = patrol()
    path = made[1]["r0"]
    when = float(path.knots[2]) + lap * lap_of(made)[1]
    verdict = judged(made, flown(made, aside([0, 0, 0.6], when, robot="r0", width=1.2)), max_speed=2.5)
    assert formula_of(verdict).outcome == formula
    assert claims(verdict)["visits"] == {"fails"}
    assert verdict.outcome == "fails"
    if formula != "holds":
        assert "Even if it went on as in its last lap" in formula_of(verdict).sentence


@few_of(1, ("lap", "told", "robots"), [(0, True, 1), (1, False, 1), (2, True, 1), (1, True, 2)])
def test_a_region_that_is_forbidden_was_entered(lap, told, robots):
    made = patrol("G F a & G F b & G !c", robots, "own")
    begin, length = lap_of(made)
    samples = flown(made, aside([-0.5, 0, 0], begin + lap * length, robot="r0", width=0.3))
    verdict = check_flight(samples, asked(made), max_speed=4.0, start=0.0 if told else (-0.01, 0.0))
    claim = formula_of(verdict)
    assert claim.outcome == "fails", claim.sentence
    assert "nothing can keep `G !c` any more (r0 surely in c)" in claim.sentence
    assert claim.witness.word[0] == ("r0", frozenset({"c"}))
    inside = np.linalg.norm(samples.positions["r0"] - [-0.5, 0.0, 1.5], axis=1) < 0.15
    first = float(samples.times[np.argmax(inside)])
    assert first - 0.011 <= claim.time <= first + 0.05, "sure as soon as a ball around a sample lies inside"


def test_a_region_that_may_have_been_entered_before_the_flight_breaks_nothing():
    made = patrol()
    begin, length = lap_of(made)
    samples = flown(made, aside([-0.5, 0, 0], begin + length, robot="r0", width=0.3))
    early = np.arange(-5.0, -0.001, 0.01)  # hovering before the flight, so that the first row is not its start
    places = np.concatenate([np.tile(samples.positions["r0"][:1], (len(early), 1)), samples.positions["r0"]])
    verdict = check_flight(Samples(np.r_[early, samples.times], {"r0": places}), asked(made), max_speed=4.0)
    assert not verdict.alignment.trusted
    assert formula_of(verdict).outcome == "undecided"
    assert formula_of(verdict).sentence.endswith("when it began is not known.")


# -- letters, against Spot -----------------------------------------------------------------------------------------------


def spelt(rng: Random) -> tuple[Timeline, list[Letter], int]:
    """A flight of which nothing is left open: its timeline, its letters, a second each, and within which its last lap begins.

    One region at the most changes at a time, over the seam, too.
    """
    held = {name: rng.random() < 0.4 for name in "abc"}
    lap, count = rng.randint(0, 2), rng.randint(3, 7)
    letters: list[Letter] = []
    for second in range(count):
        if second and rng.random() < 0.8:
            name = rng.choice("abc")
            held[name] = not held[name]
        letters.append(frozenset(name for name in held if held[name]))
    letters += [letters[lap]] if len(letters[lap] ^ letters[-1]) <= 1 else []
    if letters[lap] != letters[-1]:
        return spelt(rng)
    changes = [
        Change(Enclosure(Fraction(at), Fraction(at)), name, "must" if name in letters[at] else "no")
        for at in range(1, len(letters))
        for name in sorted(letters[at] ^ letters[at - 1])
    ]
    initial = {name: "must" if name in letters[0] else "no" for name in "abc"}
    return Timeline("q0", initial, tuple(changes), Fraction(len(letters))), letters, lap


def against_spot(count: int, seed: int) -> dict[str, int]:
    rng = Random(seed)
    found = {"holds": 0, "fails": 0, "undecided": 0}
    for _ in range(count):
        formula = str(random_formula(rng, rng.randint(2, 7))).replace("water", rng.choice("abc"))
        if rng.random() < 0.3:
            formula = f"({formula}) & {rng.choice(['G !a', 'G(b -> F c)', '!c W b', 'G F a'])}"
        line, letters, lap = spelt(rng)
        asks = mission(formula, trace="infinite")
        word = Word(tuple(letters[:lap]), tuple(letters[lap:]))
        parsed = parse_formula(formula)
        if is_lost(parsed, 1, [(0, letter) for letter in letters], own=True):
            wanted = "fails"
        else:
            wanted = "holds" if spot_accepts(parsed, word) else "undecided"
        claim = laps_claim(asks, {"q0": line}, Relations(), line.duration - lap - Fraction(1, 2), (5.0, 0.0), BUDGET)
        assert claim.outcome == wanted, (formula, letters, lap, claim.sentence)
        blind = laps_claim(asks, {"q0": line}, Relations(), None, (5.0, 0.0), BUDGET)
        assert blind.outcome == ("fails" if wanted == "fails" else "undecided")
        if wanted == "fails":
            until = int(claim.time - 5.0)
            lost = [is_lost(parsed, 1, [(0, letter) for letter in letters[:n]], own=True) for n in range(1, len(letters) + 1)]
            assert until == lost.index(True), "broken in the very second in which Spot says so"
        found[wanted] += 1
    return found


@pytest.mark.slow
def test_what_is_said_of_laps_is_what_spot_says_of_their_letters():
    assert min(against_spot(80, 5).values()) > 8


@pytest.mark.slow
def test_what_is_said_of_many_laps_is_what_spot_says_of_their_letters():
    assert min(against_spot(6000, 6).values()) > 600


def none_that_holds_breaks(count: int, seed: int) -> int:
    rng = Random(seed)
    held = 0
    for _ in range(count):
        robots, reading = rng.choice([(1, "own"), (2, "own"), (2, "joint")])
        formula = str(random_formula(rng, rng.randint(2, 6))).replace("water", rng.choice("abc"))
        team = {f"q{i}": replace(short_timeline(rng, f"q{i}", touching=True), actions=()) for i in range(robots)}
        lap = rng.randint(1, 4)
        asks = mission(formula, trace="infinite", team=reading, robots=robots)
        if laps_claim(asks, team, Relations(), Fraction(lap), (0.0, 0.0), BUDGET).outcome == "holds":
            held += 1
            for _ in range(8):
                word = some_lasso(team, lap, rng, own=reading == "own")
                assert spot_accepts(parse_formula(formula), word), (formula, reading, team, lap, word)
    return held


def test_no_flight_that_agrees_with_laps_that_hold_breaks_them():
    assert none_that_holds_breaks(20, 7) > 3


@pytest.mark.slow
def test_no_flight_of_many_that_agrees_with_laps_that_hold_breaks_them():
    assert none_that_holds_breaks(600, 8) > 90


def test_internal_states_that_do_not_come_back_promise_no_lap():
    asks = mission("G F a", trace="infinite")
    line = Timeline("q0", {"a": "must", "b": "no", "c": "no"}, (), Fraction(8))
    assert laps_claim(asks, {"q0": line}, Relations(), Fraction(4), (0.0, 0.0), BUDGET).outcome == "holds"
    before = replace(line, actions=(fill(2),))
    assert laps_claim(asks, {"q0": before}, Relations(), Fraction(4), (0.0, 0.0), BUDGET).outcome == "holds"
    for action in (fill(6), replace(fill(3), until=Fraction(5))):
        claim = laps_claim(asks, {"q0": replace(line, actions=(action,))}, Relations(), Fraction(4), (0.0, 0.0), BUDGET)
        assert claim.outcome == "undecided"
        assert "q0's internal state at the end of the last lap is not known to be that at its beginning" in claim.sentence


def test_bounds_in_seconds_are_held_against_recorded_laps():
    def visits(*times: tuple[int, int]) -> Timeline:
        changes = [
            Change(Enclosure(Fraction(time), Fraction(time)), "a", status)
            for span in times
            for time, status in zip(span, ("must", "no"), strict=True)
        ]
        return Timeline("q0", dict.fromkeys("abc", "no"), tuple(changes), Fraction(12))

    def said(formula: str, line: Timeline):
        return laps_claim(mission(formula, trace="infinite"), {"q0": line}, Relations(), Fraction(4), (5.0, 0.0), BUDGET)

    patrols = visits((1, 2), (5, 6), (9, 10))
    assert said("G F[0,3] a", patrols).outcome == "holds"
    late = said("G F[0,2] a", patrols)
    assert late.outcome == "fails"
    assert late.time == pytest.approx(5.0 + 4.0, abs=1e-3)  # two seconds after it left a
    once = said("G F[0,7] a", visits((1, 2), (5, 6)))
    assert once.outcome == "undecided"
    assert "`a` never happens" in once.sentence
    slower = said("G F[0,3] a", visits((1, 2), (6, 7), (9, 10)))
    assert slower.outcome == "fails"
    assert (
        laps_claim(
            mission("G F[0,3] a", trace="infinite"), {"q0": patrols}, Relations(), Fraction(4), (5.0, 0.5), BUDGET
        ).outcome
        != "holds"
    )
