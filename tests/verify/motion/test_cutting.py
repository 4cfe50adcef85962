"""Trajectories cut in flight: what is left of them is where they were, to the nanometre that the margin is larger by."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

from tests.helpers.few import few_of
from verify.data import BadInput, Trajectory
from verify.motion.cutting import SHIFT, cut


@pytest.mark.parametrize("seed", range(5))
def test_a_cut_trajectory_is_the_rest_of_it(seed):
    rng = np.random.default_rng(seed)
    track = Trajectory(rng.uniform(0.3, 2, 4).astype(np.float32), rng.normal(0, 0.3, (4, 4, 8)).astype(np.float32))
    at = Fraction(int(rng.integers(0, int(track.duration * 50))), 50)
    rest = cut(track, at)
    times = np.linspace(0, float(track.duration) - float(at), 200)
    # jumps between random pieces: away from the knots, where both readings round their times
    clear = np.abs((times + float(at))[:, None] - track.knots).min(axis=1) > 1e-6
    assert np.abs(rest.evaluate(times) - track.evaluate(times + float(at)))[clear].max() < 2 * SHIFT
    assert np.allclose(cut(track, Fraction(100)).evaluate(0.5), track.evaluate(100.0), atol=1e-12)


def test_a_trajectory_that_is_cut_at_its_end_is_the_hover_there():
    track = Trajectory([0.75, 1.5], np.random.default_rng(3).normal(0, 0.3, (2, 4, 8)).astype(np.float32))
    for late in (Fraction(0), Fraction(1, 2**40), Fraction(7)):
        rest = cut(track, Fraction(9, 4) + late)
        assert len(rest) == 1
        assert np.abs(rest.evaluate([0.0, 0.5, 99.0]) - track.evaluate(2.25)).max() < 1e-12


def at_exactly(track, time):
    """The position at an exact time, without any rounding; at a joint that of the later piece."""
    knots = [Fraction(0), *itertools.accumulate(map(Fraction, track.durations.tolist()))]
    piece = max(i for i in range(len(track.durations)) if knots[i] <= time)
    local = min(time, knots[-1]) - knots[piece]
    return [sum(Fraction(c) * local**k for k, c in enumerate(row)) for row in track.coefficients[piece, :3].tolist()]


@few_of(2, "size", [1e2, 1e5, 1e6, 1e7, 1e9])
@pytest.mark.parametrize("length", [0.25, 8.0])
def test_a_cut_is_refused_where_rounding_would_move_the_rest_too_far(length, size):
    """Terms c_k T^k of some size, rounded to 2^-53 of themselves: at 1e7 m that is a nanometre, at 1e2 m it never is."""
    rng = np.random.default_rng(int(size))
    refused = 0
    for _ in range(20):
        terms = rng.normal(size=(2, 4, 8)) * size
        track = Trajectory([length, length], terms / length ** np.arange(8))
        at = Fraction(float(rng.uniform(0, length)))
        try:
            rest = cut(track, at)
        except BadInput:
            refused += 1
            continue
        left = Fraction(length) - at
        for share in (0, Fraction(1, 3), Fraction(7, 8), 1 - Fraction(1, 2**30)):
            moved_to, was = at_exactly(rest, left * share), at_exactly(track, at + left * share)
            assert sum((a - b) ** 2 for a, b in zip(moved_to, was, strict=True)) <= Fraction(SHIFT) ** 2
    assert refused == {1e2: 0, 1e9: 20}.get(size, refused)


@pytest.mark.parametrize("size", [2.0**10, 2.0**28])
@pytest.mark.parametrize("moving", [0, 1])
@pytest.mark.parametrize("power", [1, 2])
def test_a_cut_whose_rounded_length_moves_what_follows_is_refused(moving, size, power):
    """7 2/3 s are no float: a piece that moves quickly, first or after it, is elsewhere by what its speed makes of the rest."""
    terms = np.zeros((2, 4, 8))
    terms[moving, 0, power] = 9 * size  # a multiple of 9, so that cutting it at 1/3 s is exact
    if moving == 0:
        terms[1, 0, 0] = 9 * size * 8.0**power
    track, at = Trajectory([8.0, 8.0], terms), Fraction(1, 3)
    left = 8 - at
    assert Fraction(float(left)) != left
    try:
        rest = cut(track, at)
    except BadInput:
        assert size > 2**20
        return
    assert size < 2**20
    for time in (left, (left + Fraction(float(left))) / 2, Fraction(float(left)), left + 1, left + Fraction(31, 4)):
        was, moved_to = at_exactly(track, at + time), at_exactly(rest, time)
        assert abs(was[0] - moved_to[0]) <= Fraction(SHIFT)


def test_a_hover_far_away_is_refused_where_rounding_would_move_it():
    far = np.zeros((1, 4, 8))
    far[0, :3, 0:2] = [[2.0**40, 1 / 3], [0.0, 0.0], [1.0, 0.0]]
    near = far.copy()
    near[0, 0, 0] = 1.0
    assert at_exactly(cut(Trajectory([1.0], near), Fraction(2)), Fraction(0))[0] == pytest.approx(4 / 3, abs=SHIFT)
    with pytest.raises(BadInput, match="too large"):
        cut(Trajectory([1.0], far), Fraction(2))
