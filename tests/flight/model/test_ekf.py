"""The filter on board: its steps are those of the matrices that its papers give, and few vehicles are as many."""

from __future__ import annotations

import numpy as np
import pytest

from flight.model.attitude import matrix
from flight.model.compiled import Compiled
from flight.model.ekf import ROWS, SENSED, ExtendedKalman
from verify.data import GRAVITY
from verify.data.autopilot import load_autopilot

NOISE = load_autopilot("crazyflie-2").ekf
DT = 0.01


def filters(n=3, seed=0):
    rng = np.random.default_rng(seed)
    filter_ = ExtendedKalman(NOISE, DT)
    attitude = rng.standard_normal((4, n)) * 0.2 + np.array([1.0, 0, 0, 0])[:, None]
    attitude /= np.linalg.norm(attitude, axis=0)
    rows = filter_.at_first(rng.standard_normal((3, n)), attitude)
    rows[3:6] = rng.standard_normal((3, n))
    sensed = np.zeros((SENSED, n))
    sensed[:3], sensed[3] = rng.standard_normal((3, n)), GRAVITY + rng.standard_normal(n)
    sensed[7:11] = attitude
    return filter_, rows, sensed


def skew(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def test_a_prediction_without_a_measurement_is_that_of_the_linearised_step():
    filter_, rows, sensed = filters()
    after = filter_.after(rows, sensed)
    for k in range(rows.shape[1]):
        turn, p, gyro, lift = matrix(rows[6:10])[:, :, k], rows[3:6, k], sensed[:3, k], sensed[3, k]
        up = np.array([0.0, 0.0, 1.0])
        moved = rows[:3, k] + turn @ (DT * p + 0.5 * DT**2 * lift * up) - 0.5 * DT**2 * GRAVITY * up
        sped = p + DT * (lift * up - np.cross(gyro, p) - GRAVITY * turn.T @ up)
        assert after[:3, k] == pytest.approx(moved, abs=1e-12)
        assert after[3:6, k] == pytest.approx(sped, abs=1e-12)
        d = 0.5 * DT * gyro
        step = np.eye(9)
        step[:3, 3:6] = DT * turn
        step[:3, 6:] = -DT * turn @ skew(p)
        step[3:6, 3:6] -= DT * skew(gyro)
        step[3:6, 6:] = -DT * GRAVITY * skew(turn.T @ up)
        step[6:, 6:] = np.eye(3) - skew(d) + 0.5 * skew(d) @ skew(d)
        before = rows[10:].reshape(9, 9, -1)[:, :, k]
        wanted = step @ before @ step.T
        short = DT / 10
        accelerations, gyros = np.array(NOISE.acceleration_noise), np.array(NOISE.gyro_noise)
        wanted += 10 * np.diag(np.concatenate([accelerations * short**2, accelerations * short, gyros * short]) ** 2)
        found = after[10:].reshape(9, 9, -1)[:, :, k]
        assert found == pytest.approx(np.where(np.eye(9) > 0, np.maximum(wanted, NOISE.least_variance), wanted), abs=1e-12)


def test_a_measurement_takes_its_share_of_the_error():
    filter_, rows, sensed = filters()
    sensed[4:7], sensed[7:11], sensed[11] = rows[:3], rows[6:10], 1.0
    predicted = filter_.after(rows, np.where(np.arange(SENSED)[:, None] == 11, 0.0, sensed))
    sensed[7:11] = predicted[6:10]
    sensed[4:7] = predicted[:3] + np.array([0.1, 0.0, 0.0])[:, None]
    found = filter_.after(rows, sensed)
    spread = predicted[10:].reshape(9, 9, -1)
    share = spread[0, 0] / (spread[0, 0] + NOISE.position_noise**2)
    assert found[0] - predicted[0] == pytest.approx(0.1 * share, rel=0.05)
    assert np.all(found[10:].reshape(9, 9, -1)[0, 0] < spread[0, 0])


def test_what_hovers_and_is_seen_stays_where_it_is():
    filter_ = ExtendedKalman(NOISE, DT)
    place, level = np.array([[1.0], [2.0], [1.5]]), np.array([[1.0], [0.0], [0.0], [0.0]])
    rows = filter_.at_first(place, level)
    sensed = np.concatenate([np.zeros((3, 1)), [[GRAVITY]], place, level, [[1.0]]])
    for _ in range(50):
        rows = filter_.after(rows, sensed)
    assert filter_.known(rows) == pytest.approx(np.concatenate([place, np.zeros((3, 1)), level]), abs=1e-9)


def test_compiled_and_as_arrays_the_numbers_are_the_same():
    filter_, rows, sensed = filters(seed=4)
    sensed[4:7], sensed[7:11], sensed[11] = rows[:3] + 0.01, rows[6:10], 1.0
    compiled = Compiled(filter_.after, ROWS, SENSED).flight(rows.shape[1])
    assert np.array_equal(compiled.steps(rows, sensed, 1)[0], filter_.after(rows, sensed))
