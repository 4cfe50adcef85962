"""Penalties for limits: their gradients against finite differences, and their signs against the shares that are used."""

from __future__ import annotations

import numpy as np
import pytest

from refine.limits.excess import Penalty
from refine.limits.limits import Limits, Rotors
from refine.limits.usage import Samples

ROTORS = Rotors(mass=0.033, inertia=(16.6e-6, 16.7e-6, 29.3e-6), arm=0.046, torque_to_thrust=0.006, least=0.07, most=0.09)
CASES = {
    "speed": Limits(speed=1.0),
    "acceleration": Limits(acceleration=2.0),
    "thrust_max": Limits(thrust_max=10.5),
    "thrust_min": Limits(thrust_min=9.0),
    "tilt": Limits(tilt=0.2),
    "body_rate": Limits(body_rate=1.0),
    "rotors": Limits(rotors=ROTORS),
}


def drawn(seed: int) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    return tuple(scale * rng.normal(size=(3, 5, 3)) for scale in (1.0, 2.0, 10.0, 100.0))


@pytest.mark.parametrize("limit", CASES)
def test_gradients_are_those_of_finite_differences(limit: str) -> None:
    free = np.full(3, np.inf)
    penalty, motion, weights = Penalty(CASES[limit], free, free), drawn(1), np.random.default_rng(2).uniform(0.5, 1.5, (3, 5))
    total, slopes = penalty(motion, weights)
    assert total.sum() > 0.0
    direction = drawn(3)
    step = 1e-6

    def moved(sign: float) -> float:
        there = tuple(each + sign * step * way for each, way in zip(motion, direction, strict=True))
        return float(penalty(there, weights)[0].sum())

    along = sum(float(np.sum(slope * way)) for slope, way in zip(slopes, direction, strict=True))
    assert (moved(1.0) - moved(-1.0)) / (2 * step) == pytest.approx(along, rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("limit", [name for name in CASES if name != "rotors"])
def test_what_exceeds_a_limit_is_what_uses_more_than_all_of_it(limit: str) -> None:
    free = np.full(3, np.inf)
    for seed in range(20):
        motion = drawn(seed)
        still = (np.zeros((3, 5)),) * 3
        share = Samples(motion, still).shares(CASES[limit])[limit][2]
        penalised = Penalty(CASES[limit], free, free)(motion, np.eye(15)[0].reshape(3, 5))[0].sum()
        assert (penalised > 0.0) == bool(share[0, 0] > 1.0)


def test_each_piece_has_limits_of_its_own() -> None:
    motion, weights = drawn(4), np.ones((3, 5))
    slow = np.array([np.inf, 0.1, np.inf])
    total, _ = Penalty(Limits(), slow, np.full(3, np.inf))(motion, weights)
    assert total[1] > 0.0
    assert total[0] == total[2] == 0.0
    assert Penalty(Limits(), np.full(3, np.inf), slow)(motion, weights)[0][1] > 0.0
