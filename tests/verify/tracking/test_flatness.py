"""Flatness in intervals against the controller's own, and its slopes against differences."""

import numpy as np

from flight.control.flatness import feed_forward
from verify.tracking.flatness import fed_forward

TICKS = 40


def drawn(seed: int):
    rng = np.random.default_rng(seed)
    force = rng.uniform(-2.0, 2.0, (TICKS, 3)) + np.array([0.0, 0.0, 9.8])
    return force, *(rng.uniform(-k, k, (TICKS, 3)) for k in (5.0, 40.0, 300.0))


def exact(force, jerk, snap):
    zero = np.zeros(len(force))
    found = feed_forward(force.T, jerk.T, snap.T, zero, zero, zero)
    return found.thrust, found.thrust_rate, found.turn[:, 2], found.rates, found.rates_change


def holds(interval, value):
    return np.all(interval.low - 1e-9 <= value) and np.all(value <= interval.high + 1e-9)


def test_intervals_hold_the_controllers_flatness_at_every_feedback():
    force, jerk, snap, _ = drawn(1)
    reach = np.array([[0.6, 0.6, 0.4], [0.5, 0.4, 0.3], [3.0, 2.0, 1.0]])[:, None, :] * np.ones((1, TICKS, 1))
    found, rng = fed_forward(force, jerk, snap, reach), np.random.default_rng(2)
    for _ in range(50):
        drawn_within = (
            at + rng.uniform(-1, 1, (TICKS, 3)) * sides for at, sides in zip((force, jerk, snap), reach, strict=True)
        )
        thrust, rate, axis, rates, change = exact(*drawn_within)
        assert holds(found.length.value, thrust)
        assert holds(found.rate.value, rate)
        for k in range(3):
            assert holds(found.axis[k].value, axis[k])
            assert holds(found.rates[k].value, rates[k])
            assert holds(found.rates_change[k].value, change[k])


def test_slopes_hold_differences():
    force, jerk, snap, _ = drawn(3)
    reach, rng, h = np.full((TICKS, 3), 0.3), np.random.default_rng(4), 1e-6
    found = fed_forward(force, jerk, snap, np.stack([reach, 0.0 * reach, 0.0 * reach]))
    for _ in range(20):
        at = force + rng.uniform(-0.9, 0.9, (TICKS, 3)) * reach
        for c in range(3):
            more, less = (exact(at + sign * h * np.eye(3)[c], jerk, snap) for sign in (1.0, -1.0))
            for k in range(3):
                for jets, index in ((found.rates, 3), (found.rates_change, 4)):
                    slope = (more[index][k] - less[index][k]) / (2 * h)
                    assert np.all(jets[k].slope[c].low - 1e-4 <= slope)
                    assert np.all(slope <= jets[k].slope[c].high + 1e-4)
