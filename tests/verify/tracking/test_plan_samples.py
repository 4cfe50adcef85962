"""Bounds on a plan between commands, against dense samples by numpy's own polynomials."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from verify.data import Trajectory
from verify.tracking.plan_samples import ORDERS, sample_plan
from verify.tracking.sampled_loop import TICK

DENSE = 41


def drawn(seed: int, pieces: int = 4) -> Trajectory:
    """Return pieces that do not even meet, so that every derivative jumps at each joint."""
    rng = np.random.default_rng(seed)
    coefficients = np.zeros((pieces, 4, 8))
    coefficients[:, :3] = rng.normal(size=(pieces, 3, 8)) / 4.0 ** np.arange(8)
    return Trajectory(rng.uniform(0.03, 0.4, pieces), coefficients)


def derivatives(path: Trajectory, piece: int, local: float | np.ndarray, heading: float) -> np.ndarray:
    """Return place and derivatives of a piece at local times, in a frame turned by a heading. Shape (ORDERS, 3, ...)."""
    own = np.stack([[Polynomial(path.coefficients[piece, axis]).deriv(k)(local) for axis in range(3)] for k in range(ORDERS)])
    turned = own.copy()
    turned[:, 0] = math.cos(heading) * own[:, 0] + math.sin(heading) * own[:, 1]
    turned[:, 1] = math.cos(heading) * own[:, 1] - math.sin(heading) * own[:, 0]
    return turned


@pytest.mark.parametrize(("heading", "delay"), [(0.0, 0.0), (0.7, 0.0), (0.0, 0.033)])
@pytest.mark.parametrize("seed", range(4))
def test_lengths_between_commands_hold_dense_samples(seed, heading, delay):
    path = drawn(seed)
    plan = sample_plan(path, path.duration + delay, heading, 0.0, delay)
    knots = path.knots + delay
    reached = np.zeros((len(plan), 2, ORDERS))
    for piece in range(len(path)):
        times = np.linspace(knots[piece], knots[piece + 1], 40 * DENSE)
        found = derivatives(path, piece, times - knots[piece], heading)
        sizes = np.stack([np.hypot(found[:, 0], found[:, 1]), np.abs(found[:, 2])])
        for near in (-1e-12, 1e-12):  # an instant of a command is in both spans
            ticks = np.clip(((times + near) / TICK).astype(np.intp), 0, len(plan) - 1)
            assert np.all(sizes <= np.stack([plan.across[ticks].T, plan.along[ticks].T]) + 1e-12)
            np.maximum.at(reached, ticks, sizes.transpose(2, 0, 1))
    whole = slice(math.ceil(delay / TICK) + 1, len(plan) - 1)
    bounds = np.stack([plan.across[whole], plan.along[whole]], axis=1)
    assert np.median(bounds / (reached[whole] + 1e-6)) < 1.5, "bounds are near what is reached"


@pytest.mark.parametrize("heading", [0.0, -1.1])
def test_what_jumps_at_joints_is_counted_where_they_are(heading):
    path = drawn(7)
    plan = sample_plan(path, path.duration, heading, 0.0)
    for joint in range(1, len(path)):
        tick = int(path.knots[joint] / TICK)
        before = derivatives(path, joint - 1, float(path.durations[joint - 1]), heading)
        step = derivatives(path, joint, 0.0, heading) - before
        assert np.all(np.linalg.norm(step, axis=1) <= plan.jumps[tick] + 1e-12)
        assert np.all(np.abs(step[:, 2]) <= plan.rises[tick] + 1e-12)
    joints = {int(time / TICK) for time in path.knots[:-1]}
    still = [tick for tick in range(len(plan) - 2) if tick not in joints]
    assert np.all(plan.jumps[still] == 0.0)


@pytest.mark.parametrize("late", [0.0, 0.006, 0.02])
def test_what_is_seen_late_is_where_the_path_was(late):
    path = drawn(3, pieces=1)
    plan = sample_plan(path, path.duration, 0.3, late)
    for tick, time in enumerate(plan.times[:-1]):
        now = derivatives(path, 0, float(time), 0.3)[:2]
        then = derivatives(path, 0, max(float(time - late), 0.0), 0.3)[:2]
        then[1] = then[1] if time >= late else 0.0
        assert plan.seen[tick] == pytest.approx(then - now, abs=1e-12)
