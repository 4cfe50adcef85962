"""Shortest times: judged for all times, never slower than stretching, and the same after a turn of the whole course."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from refine import Limits, time_optimal
from refine.heading.spin import with_least_spin
from refine.limits.limits import rotors_of
from refine.limits.usage import peaks
from refine.planes import Plane
from refine.solvers.fastest import stretched_guess
from refine.solvers.retiming import pace, retime
from tests.helpers.few import few_of
from tests.helpers.missions.refinement_courses import (
    HOOP6,
    HOOP6_BLEND,
    HOOP6_LIMITS,
    SPLIT_S,
    flown,
    hoop6_vehicle,
    limit_verdicts,
    racer,
)
from verify.data import BadInput, Infeasible


def certified(path, yaw=None, vehicle=None, names=None) -> bool:
    claims = limit_verdicts(flown(path, yaw), vehicle or hoop6_vehicle())
    return all(claims[name].outcome == "holds" for name in (names or claims))


def test_hoop6_is_fast_and_certified() -> None:
    one = time_optimal(HOOP6, HOOP6_LIMITS)
    assert certified(one)
    assert 4.358 < one.duration <= 5.45


@pytest.mark.slow
def test_hoop6_is_faster_in_more_pieces_and_blends_as_published() -> None:
    two = time_optimal(HOOP6, HOOP6_LIMITS, pieces=2)
    assert certified(two)
    assert two.duration <= 5.0
    blend = time_optimal(HOOP6, HOOP6_LIMITS, objective="blend", weight=1000.0, instants=8)
    assert certified(blend)
    assert blend.snap_cost() + 1000 * blend.duration == pytest.approx(HOOP6_BLEND, rel=1e-3)


def test_a_blend_needs_no_limits() -> None:
    points = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0]])
    paths = [time_optimal(points, limits, objective="blend", weight=100.0) for limits in (Limits(), Limits(speed=1000.0))]
    free, wide = (path.snap_cost() + 100.0 * path.duration for path in paths)
    assert free == pytest.approx(wide, rel=1e-3)


def test_a_turned_course_takes_as_long() -> None:
    """All limits are norms or angles to the vertical, so a turn about z changes nothing."""
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    points = HOOP6[:4]
    here, there = time_optimal(points, HOOP6_LIMITS), time_optimal(points @ turn.T + 2.0, HOOP6_LIMITS)
    assert there.duration == pytest.approx(here.duration, rel=1e-3)


@few_of(1, "seed", range(4))
def test_random_courses_are_certified_and_never_slower_than_stretching(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(size=(int(rng.integers(2, 6)), 3)), axis=0)
    path = time_optimal(points, HOOP6_LIMITS)
    assert certified(path)
    assert path.duration <= stretched_guess(points, HOOP6_LIMITS).duration * (1 + 1e-6)
    np.testing.assert_allclose(path.nodes, points, atol=1e-9)


@pytest.mark.slow
def test_retiming_keeps_the_path_and_beats_stretching() -> None:
    guess = stretched_guess(HOOP6, HOOP6_LIMITS)
    times = pace(guess, HOOP6_LIMITS)
    assert np.all(np.diff(times) > 0)
    assert times[-1] < guess.duration
    faster = retime(guess, HOOP6_LIMITS, within=0.02)
    assert faster.duration < 0.9 * guess.duration
    assert certified(faster)
    shares = np.linspace(0, 1, 60)
    gaps = np.linalg.norm(
        faster.sample(shares).reshape(-1, 1, 3) - guess.sample(np.linspace(0, 1, 300)).reshape(1, -1, 3), axis=2
    )
    assert gaps.min(axis=1).max() <= 0.025
    strict = retime(guess, HOOP6_LIMITS, within=1e-9)
    assert strict.duration == pytest.approx(guess.duration, rel=2e-3)  # nothing fits so closely: stretching stands


@pytest.mark.slow
def test_a_race_with_rotor_limits_and_little_spin() -> None:
    """The first legs of the Split-S course: every limit of the racer but tilt, for all times."""
    vehicle, points = racer(), SPLIT_S[:5]
    limits = Limits(
        thrust_min=vehicle.thrust_min / vehicle.mass,
        thrust_max=vehicle.thrust_max / vehicle.mass,
        body_rate=15.0,
        yaw_rate=3.0,
        rotors=rotors_of(vehicle),
    )
    floor = Plane(np.array([0.0, 0.0, 1.0]), 0.3)
    path = time_optimal(points, limits, tolerance=0.29, end="free", walls=[floor], instants=12)
    path, yaw = with_least_spin(path, limits)
    assert path.duration < 6.0
    assert certified(
        path, yaw, vehicle, ("thrust_max", "thrust_min", "rotor_thrust_max", "rotor_thrust_min", "body_rate", "yaw_rate")
    )
    assert np.linalg.norm(path.nodes[1:-1] - points[1:-1], axis=1).max() <= 0.29 + 1e-6
    assert path.sample(np.linspace(0, 1, 200))[..., 2].min() >= 0.3 - 1e-6
    still = replace(limits, rotors=None)
    spin = {peak.name: peak.value for peak in peaks(path, yaw, still)}["yaw_rate"]
    plain = {peak.name: peak.value for peak in peaks(path, None, still)}["yaw_rate"]
    assert spin < plain


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"waypoints": [[0, 0, 0], [0, 0, 0]]}, "coincide"),
        ({"waypoints": [[0, 0, 0]]}, "at least two"),
        ({"waypoints": [[0, 0, 0], [1, 0, float("nan")]]}, r"\[1, 2\] is nan"),
        ({"limits": Limits()}, "needs a limit"),
        ({"pieces": 0}, "at least 1"),
        ({"tolerance": -1.0}, "tolerance"),
        ({"end": "crash"}, "'rest' or 'free'"),
    ],
)
def test_bad_input_is_named(change: dict, words: str) -> None:
    arguments = {"waypoints": HOOP6, "limits": HOOP6_LIMITS, **change}
    with pytest.raises(BadInput, match=words):
        time_optimal(arguments.pop("waypoints"), arguments.pop("limits"), **arguments)


@pytest.mark.slow
def test_walls_that_no_flight_can_keep_are_refused() -> None:
    with pytest.raises(Infeasible, match="walls"):
        time_optimal(HOOP6[:3], HOOP6_LIMITS, walls=[Plane(np.array([0.0, 0.0, 1.0]), 5.0)])


def test_a_distance_that_is_none_is_refused() -> None:
    with pytest.raises(BadInput, match="within"):
        retime(stretched_guess(HOOP6, HOOP6_LIMITS), HOOP6_LIMITS, within=0.0)
