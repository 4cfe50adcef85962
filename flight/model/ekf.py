"""The extended Kalman filter that common firmware has on board: position, velocity in body axes and attitude.

After Mueller, Hamer and D'Andrea (ICRA 2015) and Mueller, Hehn and D'Andrea (JGCD 2017), as the Crazyflie has it: predicted 100 times a
second from gyroscopes and the accelerometer along the body's z, corrected by motion capture's position and attitude one number after
the other; no variance is taken for less than a least one, and turns below a least one are dropped. Sines of the small turns of one
step are the first terms of their series. Rows of arrays as on board, see `flight/control/onboard_controller.py`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flight.model.attitude import Floats, matrix, quaternion_product
from verify.data import GRAVITY
from verify.data.autopilot import FilterNoise

_PLACE, _SPEED, _TURN = slice(0, 3), slice(3, 6), slice(6, 9)
_POSITION, _VELOCITY, _ATTITUDE, _SPREAD = slice(0, 3), slice(3, 6), slice(6, 10), slice(10, 91)
ROWS = 91
"""Position in m, velocity in body axes in m/s, attitude, and the covariance of position, velocity and small turns."""
SENSED = 12
"""Rows of what is sensed: gyroscopes, acceleration along the body's z, position, attitude, and 1 where motion capture saw it."""
_SETTLING = 100
"""Steps in which a hovering vehicle's filter settles."""
_NOISE_STEPS = 10
"""Times that process noise is added between two predictions: once a millisecond."""

Repeated = Callable[[Floats, Floats, int], Floats]
"""From rows, what is sensed at each step alike, and how many steps, to the rows after them."""


class ExtendedKalman:
    """The filter of one autopilot, for any number of vehicles."""

    def __init__(self, noise: FilterNoise, dt: float) -> None:
        self._dt, self._noise = dt, noise
        short = dt / _NOISE_STEPS
        acceleration, gyro = np.array(noise.acceleration_noise), np.array(noise.gyro_noise)
        parts = [acceleration * short * short, acceleration * short, gyro * short]
        self._rough = (_NOISE_STEPS * np.concatenate(parts) ** 2)[:, None]
        self._variances = [noise.position_noise**2] * 3 + [noise.attitude_noise**2] * 3

    def at_first(self, position: Floats, attitude: Floats, repeated: Repeated | None = None) -> Floats:
        """Return the filter of vehicles that hover and have been seen for a while. Shape (ROWS, n).

        Args:
            position: m. Shape (3, n).
            attitude: Quaternion w x y z. Shape (4, n).
            repeated: What `after` does, so many times, where it is known sooner.
        """
        starts, same = np.unique(np.concatenate([position, attitude]), axis=1, return_inverse=True)  # many runs begin alike
        settled = self._settled(starts[:3], starts[3:], repeated or self._repeated)
        return np.take(settled, same.reshape(-1), axis=1)

    def _repeated(self, rows: Floats, sensed: Floats, count: int) -> Floats:
        for _ in range(count):
            rows = self.after(rows, sensed)
        return rows

    def _settled(self, position: Floats, attitude: Floats, repeated: Repeated) -> Floats:
        rows = np.zeros((ROWS, position.shape[1]))
        rows[_POSITION], rows[_ATTITUDE] = position, attitude
        spread = rows[_SPREAD].reshape(9, 9, -1)
        for i, variance in enumerate([self._variances[0]] * 3 + [1e-4] * 3 + [self._variances[3]] * 3):
            spread[i, i] = max(variance, self._noise.least_variance)
        rows = repeated(rows, _still(position, attitude), _SETTLING).copy()
        rows[_POSITION], rows[_VELOCITY], rows[_ATTITUDE] = position, 0.0, attitude
        return rows

    def known(self, rows: Floats) -> Floats:
        """Return position, velocity in the world and attitude. Shapes (ROWS, n) to (10, n)."""
        found = rows[:10].copy()
        turn = matrix(rows[_ATTITUDE])
        found[3:6] = turn[:, 0] * rows[3] + turn[:, 1] * rows[4] + turn[:, 2] * rows[5]
        return found

    def after(self, rows: Floats, sensed: Floats) -> Floats:
        """Predict over one step and take motion capture's measurement.

        Args:
            rows: Shape (ROWS, n).
            sensed: Means over the step of gyroscopes in rad/s and of the acceleration along the body's z in m/s^2, then
                position in m and attitude as measured, and 1 where they were, 0 elsewhere. Shape (SENSED, n).
        """
        return self._corrected(self._predicted(rows, sensed[:3], sensed[3]), sensed[4:7], sensed[7:11], sensed[11])

    def _predicted(self, rows: Floats, gyro: Floats, lift: Floats) -> Floats:
        dt, after = self._dt, np.empty_like(rows)
        p, q = rows[_VELOCITY], rows[_ATTITUDE]
        turn = matrix(q)
        down = GRAVITY * turn[2]
        moved = dt * p
        moved[2] += (0.5 * dt * dt) * lift
        after[_POSITION] = rows[_POSITION] + turn[:, 0] * moved[0] + turn[:, 1] * moved[1] + turn[:, 2] * moved[2]
        after[2] -= 0.5 * dt * dt * GRAVITY
        push = np.empty_like(p)
        push[0] = gyro[2] * p[1] - gyro[1] * p[2] - down[0]
        push[1] = gyro[0] * p[2] - gyro[2] * p[0] - down[1]
        push[2] = gyro[1] * p[0] - gyro[0] * p[1] - down[2] + lift
        after[_VELOCITY] = p + dt * push
        after[_ATTITUDE] = _rotated(q, dt * gyro)
        spread = rows[_SPREAD].reshape(9, 9, -1)
        links = self._links(turn, p, gyro)
        half = _linked(links, spread)
        spread = _linked(links, half.swapaxes(0, 1)).swapaxes(0, 1)
        flat = after[_SPREAD]
        flat[...] = spread.reshape(81, -1)
        flat[::10] = np.maximum(flat[::10] + self._rough, self._noise.least_variance)
        return after

    def _links(self, turn: Floats, p: Floats, gyro: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """Return the blocks of the linearised step: velocity to place, turn to place, velocity, turn to velocity, turn to turn."""
        dt = self._dt
        place = dt * turn
        leaning = np.empty_like(turn)
        leaning[:, 0] = p[1] * place[:, 2] - p[2] * place[:, 1]
        leaning[:, 1] = p[2] * place[:, 0] - p[0] * place[:, 2]
        leaning[:, 2] = p[0] * place[:, 1] - p[1] * place[:, 0]
        return place, leaning, _skew(dt * gyro, 1.0), _skew(dt * GRAVITY * turn[2], 0.0), _half_turn(dt * gyro)

    def _corrected(self, rows: Floats, position: Floats, attitude: Floats, seen: Floats) -> Floats:
        state = np.empty_like(rows, shape=(9, rows.shape[1]))
        state[:6], state[_TURN] = rows[:6], 0.0 * rows[:3]
        spread = rows[_SPREAD].reshape(9, 9, -1)
        least = self._noise.least_variance
        q = rows[_ATTITUDE]
        off = quaternion_product(_inverse(q), attitude)
        turned = 2.0 * off[1:] / off[0]
        for k in range(6):
            row = k if k < 3 else k + 3
            error = position[k] - state[k] if k < 3 else turned[k - 3]
            gain = (seen / (spread[row, row] + self._variances[k])) * spread[:, row]
            state = state + gain * error
            spread = spread - gain[:, None] * spread[row]
            for i in range(9):
                spread[i, i] = np.maximum(spread[i, i], least)
        small = state[_TURN]
        size = np.maximum(np.maximum(np.maximum(small[0], -small[0]), np.maximum(small[1], -small[1])),
                          np.maximum(small[2], -small[2]))  # fmt: skip
        after = np.empty_like(rows)
        after[:6] = state[:6]
        after[_ATTITUDE] = _rotated(q, np.where(np.less(self._noise.least_turn, size), small, 0.0 * small))
        after[_SPREAD] = spread.reshape(81, -1)
        return after


def _still(position: Floats, attitude: Floats) -> Floats:
    """Return what vehicles that hover sense."""
    sensed = np.zeros((SENSED, position.shape[1]))
    sensed[3], sensed[4:7], sensed[7:11], sensed[11] = GRAVITY, position, attitude, 1.0
    return sensed


def _linked(links: tuple[Floats, Floats, Floats, Floats, Floats], spread: Floats) -> Floats:
    """Return A P for the linearised step's blocks. Shape (9, 9, n)."""
    place, leaning, speed, tipped, turning = links
    after = np.empty_like(spread)
    p, d = spread[_SPEED], spread[_TURN]
    after[_PLACE] = spread[_PLACE] + _block(place, p) + _block(leaning, d)
    after[_SPEED] = _block(speed, p) + _block(tipped, d)
    after[_TURN] = _block(turning, d)
    return after


def _block(left: Floats, right: Floats) -> Floats:
    return left[:, 0, None] * right[0] + left[:, 1, None] * right[1] + left[:, 2, None] * right[2]


def _skew(v: Floats, diagonal: float) -> Floats:
    """Return `diagonal` I - [v x]."""
    block = np.empty_like(v, shape=(3, 3, v.shape[1]))
    same = 0.0 * v[0] + diagonal
    block[0, 0], block[0, 1], block[0, 2] = same, v[2], -v[1]
    block[1, 0], block[1, 1], block[1, 2] = -v[2], same, v[0]
    block[2, 0], block[2, 1], block[2, 2] = v[1], -v[0], same
    return block


def _half_turn(v: Floats) -> Floats:
    """Return how a turn's error is seen from axes that have turned by v, to second order in v / 2, as the firmware has it."""
    d = 0.5 * v
    block = _skew(d, 1.0)
    squares = d * d
    for i in range(3):
        for j in range(3):
            if i == j:
                block[i, i] = 1.0 - 0.5 * (squares[(i + 1) % 3] + squares[(i + 2) % 3])
            else:
                block[i, j] = block[i, j] + 0.5 * d[i] * d[j]
    return block


def _rotated(q: Floats, turn: Floats) -> Floats:
    """Return attitudes turned by small rotation vectors in body axes, at length one."""
    square = 0.25 * (turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2])
    little = np.empty_like(q)
    little[0] = 1.0 - square * (0.5 - square / 24.0)
    little[1:] = turn * (0.5 * (1.0 - square * (1.0 / 6.0 - square / 120.0)))
    product = quaternion_product(q, little)
    squares = product * product
    return product / np.sqrt(squares[0] + squares[1] + squares[2] + squares[3])


def _inverse(q: Floats) -> Floats:
    """Return the inverse of unit quaternions."""
    turned = -q
    turned[0] = q[0]
    return turned
