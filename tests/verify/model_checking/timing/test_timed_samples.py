"""Verdicts on bounds in seconds against samples of flights in the tube, on a grid that is made finer around each event."""

from __future__ import annotations

import random
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import ltlplan
from ltlplan.pipeline import Certified, certified_team
from tests.helpers.missions.timed_rooms import room
from tests.helpers.words.timed_signals import drawn_formula
from verify import judge
from verify.data.language.formula import Formula

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
NAMES = ("dock", "shelf", "pit")
FORMULA = "F[0,8] G[0,3] dock & F[9,14] shelf & G[0,12] !pit"
GRID = 0.02  # s
CLOSE = 1e-7
"""s on each side of an event, where the grid has a sample."""


@cache
def flown() -> Certified:
    return certified_team(ltlplan.plan(room(FORMULA)))


class Flight:
    """A flight in the tube: places away from the path by less than the margin, on a clock that is late or early."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        certified, self._regions = flown(), flown().plan.mission.regions
        self._path, self.end = certified.team["quad0"], certified.certificate.duration
        away = rng.normal(size=(2, 3))
        share = certified.plan.mission.margin * 0.999 / np.linalg.norm(away, axis=1).sum()
        self._away, self._turns = away * share, rng.uniform(0.0, 4.0, 2)
        error = certified.certificate.clock_error
        self._late, self._drift = rng.uniform(-error, error) / 2, rng.uniform(-error, error) / 2
        times = np.arange(0.0, self.end + 1.0, GRID)
        shown = {name: self.inside(name, times) for name in NAMES}
        events = [self._event(name, times[k], times[k + 1]) for name in NAMES for k in np.flatnonzero(np.diff(shown[name]))]
        self.times = np.unique(np.concatenate([times, *([event - CLOSE, event + CLOSE] for event in events)]))
        self.shown = {name: self.inside(name, self.times) for name in NAMES}

    def inside(self, name: str, times: Floats) -> Flags:
        """Return at which times of the reference clock the robot is in a region."""
        own = np.clip(times + self._late + self._drift * np.sin(times), 0.0, self.end)
        centre = np.array([self._path.evaluate(float(time))[:3] for time in own])
        swing = [away * np.sin(turns * own)[:, None] for away, turns in zip(self._away, self._turns, strict=True)]
        return self._regions[name].level(centre + sum(swing)) <= 1

    def _event(self, name: str, before: float, after: float) -> float:
        was = self.inside(name, np.array([before]))[0]
        for _ in range(40):
            middle = (before + after) / 2
            before, after = (middle, after) if self.inside(name, np.array([middle]))[0] == was else (before, middle)
        return after


def sampled(node: Formula, flight: Flight) -> Flags:
    """Return at which samples a formula holds, by looking at all samples that its bounds reach; nothing bounded counts after the flight."""
    times = flight.times
    parts = [sampled(part, flight) for part in node.arguments]
    match node.operator:
        case "true":
            return np.ones(len(times), bool)
        case "name":
            return flight.shown[node.name]
        case "!":
            return ~parts[0]
        case "&":
            return parts[0] & parts[1]
        case "|":
            return parts[0] | parts[1]
        case "->":
            return ~parts[0] | parts[1]
        case "F":
            return until(np.ones(len(times), bool), parts[0], node, times)
        case "G":
            return ~until(np.ones(len(times), bool), ~parts[0], node, times)
        case "U":
            return until(parts[0], parts[1], node, times)
        case "R":
            return ~until(~parts[0], ~parts[1], node, times)
        case "M":
            return until(parts[1], parts[0] & parts[1], node, times)
        case _:  # W
            return ~until(~parts[1], ~parts[0] & ~parts[1], node, times)


def until(held: Flags, reached: Flags, node: Formula, times: Floats) -> Flags:
    low, high = node.window or (0, None)
    found = np.zeros(len(times), bool)
    stops = np.array([*np.flatnonzero(~held), len(times)])
    for k, time in enumerate(times):
        first = np.searchsorted(times, time + float(low) - CLOSE / 4)
        last = len(times) if high is None else np.searchsorted(times, time + float(high) + CLOSE / 4, side="right")
        found[k] = reached[first : min(last, stops[np.searchsorted(stops, k)] + 1)].any()
    return found


def bounded(rng: random.Random) -> Formula:
    """Draw a formula whose bounds are spans, in which there are samples, and end in the flight, so that landing decides nothing."""
    while True:
        formula = drawn_formula(rng, NAMES, rng.randint(1, 3))
        windows = [n.window for n in formula.walk() if n.operator in ("F", "G", "U", "R", "W", "M")]
        if windows and all(w and w[1] is not None and w[0] < w[1] < 6 for w in windows) and reach(formula) < Fraction(12):
            return formula


def reach(node: Formula) -> Fraction:
    """Return how far ahead a formula looks, s."""
    own = node.window[1] if node.window and node.window[1] is not None else Fraction(0)
    return own + max((reach(part) for part in node.arguments), default=Fraction(0))


def contradictions(seed: int, formulas: int, flights: int) -> tuple[int, list[str]]:
    """Return how many verdicts are sure, and what samples say against them."""
    rng, certified = random.Random(seed), flown()
    every = [Flight(1000 * seed + k) for k in range(flights)]
    sure, wrong = 0, list[str]()
    for _ in range(formulas):
        formula = bounded(rng)
        mission = certified.plan.mission.changed(spec={"formula": str(formula)})
        claims = judge(certified.plan.changed(mission=mission), certified.team, largest=False).claims
        outcomes = {claim.outcome for claim in claims if claim.name in ("timing", "formula")}
        if not outcomes or outcomes - {"holds"} == {"undecided"}:
            continue
        so = outcomes == {"holds"}
        if so or "fails" in outcomes:
            sure += 1
            wrong += [f"{formula}: {outcomes}" for flight in every if sampled(formula, flight)[0] != so]
    return sure, wrong


def test_the_mission_is_kept_by_samples() -> None:
    formula = flown().plan.mission.formula
    assert all(sampled(formula, Flight(seed))[0] for seed in range(1))


def test_samples_of_flights_do_not_contradict_the_verdict() -> None:
    sure, wrong = contradictions(1, 10, 2)
    assert wrong == []
    assert sure > 4


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 12))
def test_samples_of_many_flights_do_not_contradict_the_verdict(seed: int) -> None:
    sure, wrong = contradictions(seed, 150, 8)
    assert wrong == []
    assert sure > 60
