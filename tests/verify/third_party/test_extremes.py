"""What each drone does by itself: bounds against a dense sampler, and limits that are met exactly."""

from __future__ import annotations

from fractions import Fraction
from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.helpers.few import few_of
from tests.helpers.motion.fleets import sampled, wandering
from verify.arithmetic.balls import Floats
from verify.third_party.extremes import Direction, Rate, rate_extremes, wall_extremes
from verify.third_party.fleet import Fleet, Flight, assemble
from verify.third_party.joints import jumps


def rate(order: Literal[1, 2], limits: Floats, direction: Direction = "all") -> Rate:
    return Rate("limits", "rate", order, direction, limits)


@few_of(1, "seed", range(3))
def test_extremes_agree_with_a_dense_sampler(seed: int) -> None:
    fleet = wandering(3, 3, np.random.default_rng(seed), common=bool(seed % 2))
    speeds, pushes = (rate_extremes(fleet, rate(order, np.full(3, 2.0))) for order in (1, 2))
    floors = wall_extremes(fleet, 2, "min", Fraction(0))
    times = np.linspace(0.0, float(fleet.end), 4001)
    for drone in range(3):
        path = sampled(fleet, drone, times)
        step = times[1] - times[0]
        speed = np.linalg.norm(np.diff(path, axis=0), axis=1) / step
        assert speed.max() <= speeds[drone].bound + 1e-9
        assert speeds[drone].bound <= speed.max() * 1.02 + 0.02
        inside = ~np.isin(np.arange(len(speed) - 1), np.flatnonzero(_near_knots(fleet, drone, times[1:-1], step)))
        push = np.linalg.norm(np.diff(path, 2, axis=0), axis=1) / step**2
        assert push[inside].max(initial=0.0) <= pushes[drone].bound + 1e-4
        assert floors[drone].bound <= path[:, 2].min() + 1e-9
        assert path[:, 2].min() - 0.01 <= floors[drone].bound
        for extreme in (speeds[drone], pushes[drone], floors[drone]):
            good = extreme.bound >= 0 if extreme.what == "z min" else extreme.bound <= 2.0
            assert extreme.outcome == ("holds" if good else "fails")


@pytest.mark.parametrize("seed", range(2))
def test_rates_by_direction_agree_with_a_dense_sampler(seed: int) -> None:
    fleet = wandering(2, 3, np.random.default_rng(seed))
    times = np.linspace(0.0, float(fleet.end), 801)
    for direction in ("level", "up", "down"):
        for drone, extreme in enumerate(rate_extremes(fleet, rate(1, np.full(2, 2.0), direction))):
            velocity = np.diff(sampled(fleet, drone, times), axis=0) / (times[1] - times[0])
            seen = np.hypot(*velocity.T[:2]) if direction == "level" else velocity[:, 2] * (1 if direction == "up" else -1)
            assert seen.max() <= extreme.bound + 1e-9
            assert extreme.bound <= seen.max() * 1.02 + 0.02
            assert extreme.outcome == ("holds" if extreme.bound <= 2.0 else "fails")


def test_a_climb_at_the_limit_holds_and_the_next_float_below_does_not() -> None:
    values = np.array([[[0.0, 0.0], [0.0, 0.0], [0.0, 1.0]]])
    fleet = assemble("show", "bernstein", [Flight("a", np.array([[0.0, 0.0], [1.0, 0.0]]), values, np.ones(1, dtype=np.int8))])
    limits = (1.0, float(np.nextafter(1.0, 0)))
    outcomes = [rate_extremes(fleet, rate(1, np.array([limit]), "up"))[0].outcome for limit in limits]
    assert outcomes == ["holds", "fails"]
    assert rate_extremes(fleet, rate(1, np.array([1e-9]), "down"))[0].outcome == "holds"


def _near_knots(fleet: Fleet, drone: int, times: np.ndarray, step: float) -> NDArray[np.bool_]:
    """Tell which times are so near to a joint, where velocity jumps, that a difference reaches over it."""
    rows = range(int(fleet.first[drone]), int(fleet.first[drone + 1]))
    knots = np.array([float(fleet.start(row)) for row in rows] + [float(fleet.end)])
    return np.min(np.abs(times[:, None] - knots), axis=1) <= 1.01 * step


def straight(speed: float) -> Fleet:
    """Return one drone that flies along (1, 2, 2) / 3 for 3 s."""
    knots, ends = np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([[0.0, speed], [0.0, 2 * speed], [1.0, 1.0 + 2 * speed]])
    return assemble("show", "bernstein", [Flight("d0", knots, ends[None], np.ones(1, np.int8))])


def test_a_limit_that_is_met_exactly_holds_and_the_next_float_below_does_not() -> None:
    fleet = straight(1.0)
    (held,), (broken,) = (rate_extremes(fleet, rate(1, np.array([limit]))) for limit in (1.0, np.nextafter(1.0, 0)))
    assert (held.outcome, held.bound, broken.outcome) == ("holds", 1.0, "fails")
    (floor,), (above,) = (wall_extremes(fleet, 2, "min", at) for at in (Fraction(1), Fraction(1) + Fraction(1, 10**30)))
    assert (floor.outcome, above.outcome) == ("holds", "fails")
    (still,) = rate_extremes(fleet, rate(2, np.array([1e-9])))
    assert still.outcome == "holds"


def test_velocity_jumps_at_a_start_at_speed() -> None:
    found = jumps(straight(2.0), 1)
    assert found.jumps[0] == pytest.approx(2.0)
    assert found.sure[0] == pytest.approx(2.0)
    assert jumps(straight(2.0), 0).jumps[0] == 0.0
