"""Flights within their tubes, drawn as badly as the margin and the clocks allow: none breaks a formula that was said to hold of all of them.

What a region is, and what its robots show, is read here from the mission's own numbers, on a grid of times.
"""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.helpers.missions.random_teams import random_formula
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.helpers.words.plain_team_words import Held, holds
from tests.helpers.words.random_counts import random_counting_formula
from verify import judge
from verify.data import Formula, Letter, Mission, Trajectory, parse_formula

Floats = NDArray[np.float64]

BALL, BOX, SIZE = np.array([0.9, 0.0, 1.0]), np.array([-0.3, 0.8, 1.0]), np.array([0.5, 0.7, 0.6])
L_SHAPE = (np.array([-0.9, -0.7, 1.0]), np.array([-0.4, -0.7, 1.0]))
CORNERS = np.array([[-1.3, 1.3, 1.0], [1.4, -1.2, 1.0], [1.4, 1.2, 1.0]])
CENTRES = {"a": BALL, "b": BOX, "c": L_SHAPE[0]}
REGIONS = """a: {center: [0.9, 0.0, 1.0], radii: [0.35, 0.35, 0.35]}
b: {center: [-0.3, 0.8, 1.0], size: [0.5, 0.7, 0.6]}
c: {union: [{center: [-0.9, -0.7, 1.0], size: [0.5, 0.5, 0.5]}, {center: [-0.4, -0.7, 1.0], size: [0.5, 0.5, 0.5]}]}"""
GRID = 0.005
"""s."""


def shown(places: Floats) -> list[Letter]:
    """What a robot shows at places; shape (times, 3)."""
    within = {
        "a": np.linalg.norm(places - BALL, axis=1) <= 0.35,
        "b": np.all(np.abs(places - BOX) <= SIZE / 2, axis=1),
        "c": np.any([np.all(np.abs(places - part) <= 0.25, axis=1) for part in L_SHAPE], axis=0),
    }
    return [frozenset(name for name in within if within[name][i]) for i in range(len(places))]


def drawn(path: Trajectory, end: float, margin: float, rng: np.random.Generator) -> Floats:
    """A flight within the margin of a path, which leans towards regions and away from them; shape (times, 3)."""
    times = np.arange(0.0, end, GRID)
    places = path.evaluate(times)[:, :3]
    turns = np.unique(np.append(rng.integers(0, len(times), rng.integers(2, 60)), [0, len(times) - 1]))
    towards = np.array([(CENTRES["abc"[rng.integers(3)]] - places[i]) * rng.choice([-1, 1]) for i in turns])
    if rng.random() < 0.3:
        towards = rng.normal(size=towards.shape)
    towards *= margin / np.maximum(np.linalg.norm(towards, axis=1), 1e-9)[:, None]
    return places + np.stack([np.interp(np.arange(len(times)), turns, towards[:, axis]) for axis in range(3)], axis=1)


def team_word(flown: dict[str, list[Letter]], reading: str, error: float, rng: np.random.Generator) -> list[Held]:
    """A team word of what robots show, on clocks that differ."""
    shifts = {name: rng.choice([-0.5, 0.5, rng.uniform(-0.5, 0.5)]) * error for name in flown}
    events = [
        (i * GRID + shifts[name], rng.random(), name, row[i])
        for name, row in flown.items()
        for i in range(1, len(row))
        if row[i] != row[i - 1]
    ]
    held, word = {name: row[0] for name, row in flown.items()}, list[Held]()
    unread = set(flown)

    def read(names: list[str]) -> None:
        for name in names:
            word.append({name: held[name]} if reading == "own" else dict(held))
            unread.discard(name)

    for _, _, name, letter in sorted(events, key=lambda event: event[:2]):
        others = [other for other in flown if rng.random() < 0.3]
        read([*others, name] if name in unread else others)
        held[name] = letter
        unread.add(name)
        if reading == "joint":
            read([name])
    read([str(name) for name in rng.permutation(sorted(unread or flown))])
    return word


def team(rng: np.random.Generator, reading: str) -> tuple[Mission, dict[str, Trajectory]]:
    """One to three robots that fly near regions and through them, judged whatever the formula is."""
    paths: dict[str, Trajectory] = {}
    for i in range(rng.integers(1, 4)):
        points = [CORNERS[i] + rng.uniform(-0.1, 0.1, 3)]
        points += [
            CENTRES["abc"[rng.integers(3)]] + rng.normal(size=3) * rng.choice([0.03, 0.2]) for _ in range(rng.integers(1, 4))
        ]
        paths[f"r{i}"] = legs(points, speed=0.5, hold=float(rng.choice([0.0, np.float32(rng.uniform(0.1, 3.0))])))
    mission = small_mission(regions=REGIONS, starts=[path.evaluate(0.0)[:3] for path in paths.values()], margin=0.0)
    return mission.model_copy(update={"spec": mission.spec.model_copy(update={"team": reading})}), paths


def asked(rng: Random, reading: str, names: tuple[str, ...]) -> Formula:
    if reading == "joint" and rng.random() < 0.6:
        return random_counting_formula(rng, rng.randint(2, 6), names)
    return parse_formula(str(random_formula(rng, rng.randint(2, 6))).replace("water", "c"))


@pytest.mark.parametrize(("seed", "teams"), [(0, 1), *(pytest.param(seed, 60, marks=pytest.mark.slow) for seed in (1, 2))])
def test_no_flight_in_its_tube_breaks_what_is_said_to_hold(seed: int, teams: int) -> None:
    rng, said = np.random.default_rng(seed), {"holds": 0, "fails": 0, "undecided": 0}
    for _ in range(teams):
        reading = str(rng.choice(["own", "joint"]))
        mission, paths = team(rng, reading)
        margin, error = float(rng.choice([0.0, 0.02, 0.06])), float(rng.choice([0.0, 0.05, 0.4]))
        end = max(path.duration for path in paths.values())
        flights = [{name: shown(drawn(path, end, margin, rng)) for name, path in paths.items()} for _ in range(20)]
        words = [team_word(flown, reading, error, rng) for flown in flights]
        for number in range(15):
            formula = asked(Random(int(rng.integers(2**31))), reading, tuple(paths))
            plan = plan_of(mission.asking(str(formula)), {})
            found = judge(plan, paths, margin=margin, clock_error=error, largest=False)
            (claim,) = (claim for claim in found.claims if claim.name == "formula")
            said[claim.outcome] += 1
            broken = claim.outcome == "holds" and any(not holds(formula, word) for word in words)
            assert not broken, (str(formula), reading, margin, error, number)
    assert min(said["holds"], said["fails"]) >= 1
