"""Motion capture and its filter: the estimate is better than the raw measurement, drop-outs or not."""

from __future__ import annotations

import numpy as np
import pytest

import flight
from flight.model.sensing import CLIP, Kalman, MotionCapture
from tests.helpers.motion.stand_ins import flight as made_flight
from verify.data import BadInput


@pytest.fixture(scope="module")
def log():
    plan, team = made_flight()
    sensor = MotionCapture(noise=0.002, delay=0.01, dropout=0.05)
    return flight.fly(plan, team, noise=sensor, wind="0.3+0.2", seed=2)


def test_the_filters_error_is_below_the_raw_noise(log):
    assert 0.0015 < log.measurement_rms < 0.0021  # cut at four standard deviations
    assert log.estimate_rms < 0.8 * log.measurement_rms


def test_measurements_drop_out_as_often_as_said_and_keep_their_bound(log):
    lost = np.isnan(log.measured[:, :, 0])
    assert not lost[0].any()
    assert 0.01 < np.mean(lost) < 0.12
    error = np.linalg.norm((log.measured - log.position)[~lost], axis=1)
    assert np.max(error) <= MotionCapture(noise=0.002).bound


def test_without_noise_the_flight_is_the_same_but_for_the_delay():
    plan, team = made_flight()
    quiet = MotionCapture(noise=0.0, dropout=0.0, attitude_noise=0.0, rate_noise=0.0)
    log = flight.fly(plan, team, noise=quiet)
    assert log.measurement_rms == 0.0
    assert log.worst_error() < 0.01


def test_the_filter_tracks_an_accelerating_body_through_a_long_drop_out():
    sensor = MotionCapture(noise=0.001, delay=0.02)
    rng = np.random.default_rng(0)
    truth = Kalman(sensor, np.zeros((3, 1)))
    push = np.array([[0.5], [-0.2], [0.1]])
    unseen = []
    for k in range(300):
        t = k / sensor.rate
        place = 0.5 * (push + 0.3) * t * t  # 0.3 m/s^2 that the thrust does not explain
        seen = np.array([not 200 <= k < 215])
        truth.frame(place + 0.001 * rng.normal(size=(3, 1)), seen, push)
        position, velocity = truth.estimate()
        if k > 150:
            assert np.max(np.abs(position - place)) < 0.01
            unseen.append(float(np.max(np.abs(velocity - (push + 0.3) * t))))
        truth.advance()
    assert max(unseen) < 0.15


def test_the_filter_gives_the_textbook_answer_when_nothing_is_lost():
    """Against the Riccati recursion written out with matrices."""
    sensor, dt = MotionCapture(noise=0.001, delay=0.0), 0.01
    made = Kalman(sensor, np.zeros((3, 1)))
    a = np.array([[1, dt, dt * dt / 2], [0, 1, dt], [0, 0, 1]])
    rough = (Kalman.JERK * dt) ** 2 * dt
    q = np.array([[dt * dt / 4, dt / 2, 0], [dt / 2, 1, 0], [0, 0, 0]]) * rough + np.diag([0, 0, Kalman.DRIFT**2 * dt])
    p, x = np.diag([1e-6, 1e-4, 1e-2]), np.zeros(3)
    rng = np.random.default_rng(1)
    for _ in range(50):
        z, u = 0.01 * rng.normal(), rng.normal()
        made.frame(np.full((3, 1), z), np.array([True]), np.full((3, 1), u))
        gain = p[:, 0] / (p[0, 0] + 1e-6)
        x = x + gain * (z - x[0])
        p = p - np.outer(gain, p[0])
        position, velocity = made.estimate()
        assert np.allclose([position[0, 0], velocity[0, 0]], x[:2], atol=1e-12)
        made.advance()
        x = a @ x + u * np.array([dt * dt / 2, dt, 0])
        p = a @ p @ a.T + q


@pytest.mark.parametrize(
    "values",
    [
        {"rate": 30},
        {"rate": 100.0},
        {"noise": -1},
        {"noise": 3.0},
        {"delay": 10.0},
        {"dropout": 0.9},
        {"burst": 0},
        {"burst": np.nan},
        {"rate_noise": np.nan},
    ],
)
def test_a_motion_capture_that_cannot_be_is_refused(values):
    with pytest.raises(BadInput):
        MotionCapture(**values)


def test_the_bound_is_what_the_cut_allows():
    assert MotionCapture(noise=0.001).bound == pytest.approx(CLIP * 0.001 * np.sqrt(3))
