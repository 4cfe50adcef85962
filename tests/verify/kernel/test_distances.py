"""Distances of pairs: trees are accepted only where paths that are sampled keep apart."""

from __future__ import annotations

import random
from contextlib import suppress
from fractions import Fraction
from itertools import pairwise
from math import dist
from types import SimpleNamespace
from typing import Any

from tests.helpers.few import few_of
from verify.kernel.flights import Path, Segment
from verify.kernel.statement import Refused
from verify.kernel.trees import Evidence, Polynomial
from verify.kernel.zones import Flight, Pair
from verify.proofs.proposed_roots import parted_trees
from verify.proofs.search import run_lengths, trees_of

STATEMENT: Any = SimpleNamespace(separation=Fraction(3, 8), separation_z=None, margin=Fraction(0))
ROBOT: Any = SimpleNamespace(radius=Fraction(1, 16))


def flown(rng: random.Random, *, odd: bool) -> Path:
    """Return a path of four pieces; of two paths no two begin a piece at one instant, at which only steps, which are left out here, would join them."""
    times = sorted({Fraction(0), Fraction(4), *(Fraction(2 * rng.randrange(1, 16) + odd, 8) for _ in range(3))})
    segments = []
    for start, stop in pairwise(times):
        axes = [Polynomial.of([Fraction(rng.randrange(-64, 65), 64 << 2 * k) for k in range(4)]) for _ in range(3)]
        segments.append(Segment(start, stop, axes))
    return Path("r", ROBOT, segments, segments, None)


def places(path: Path, time: Fraction) -> list[list[float]]:
    """Return where a path is at a time, at a joint on both sides."""
    here = [one for one in path.segments if one.start <= time <= one.stop]
    return [[float(axis.at(time - one.start)) for axis in one.axes] for one in here]


def is_near(one: Path, other: Path, error: Fraction) -> bool:
    """Return whether two paths are sampled too near each other at times that differ by no more than an error."""
    times = [Fraction(k, 32) for k in range(129)]
    both = [(a, b) for a in times for b in times if abs(a - b) <= error]
    return any(dist(p, q) < 0.375 for a, b in both for p in places(one, a) for q in places(other, b))


def is_proved(parts: Any, marks: str) -> bool:
    with suppress(Refused):
        Evidence({"apart": marks}).prove("apart", parts)
        return True
    return False


@few_of(
    1,
    ("seed", "number", "error", "least"),
    [(1, 20, Fraction(0), 2), (1, 60, Fraction(0), 6), (2, 20, Fraction(1, 16), 2), (2, 10, Fraction(1, 16), 1)],
)
def test_what_is_proved_is_so(seed: int, number: int, error: Fraction, least: int) -> None:
    rng = random.Random(seed)
    found = {True: 0, False: 0}
    for _ in range(number):
        pair = Pair(STATEMENT.separation, Flight(STATEMENT, flown(rng, odd=False)), Flight(STATEMENT, flown(rng, odd=True)))
        near = is_near(*(one.path for one in pair.flights), error)
        marks = run_lengths(trees_of("apart", list(pair.parts(error))))
        for text in (marks, "9m", "99m", "s9m", "99k", "s99m"):
            assert not (is_proved(pair.parts(error), text) and near)
        found[is_proved(pair.parts(error), marks)] += 1
    assert min(found.values()) >= least


@few_of(4, "seed", range(40))
def test_trees_that_floats_propose_are_accepted(seed: int) -> None:
    rng = random.Random(seed)
    one, other = (Flight(STATEMENT, flown(rng, odd=odd)) for odd in (False, True))
    parts = list(Pair(Fraction(3, 8), one, other).parts(Fraction(1, 8)))
    found = [(part, tree) for part, tree in zip(parts, parted_trees(parts), strict=True) if tree]
    assert all(is_proved([part], run_lengths([tree])) for part, tree in found)


def test_robots_that_meet_are_not_halved_for_ever() -> None:
    flight = Flight(STATEMENT, flown(random.Random(1), odd=False))
    parts = list(Pair(Fraction(3, 8), flight, flight).parts(Fraction(0)))
    assert parts
    assert "" in parted_trees(parts)
