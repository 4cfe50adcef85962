"""Rotations of many vehicles at once, component first.

Every array here has its components along the first axis and the vehicles behind it: a vector is (3, n), a unit
quaternion is (4, n) in the order w x y z, a rotation matrix is (3, 3, n). Only element-wise arithmetic is used, so one
vehicle's numbers never depend on how many fly beside it. Attitude is Z-Y-X Euler as in the papers' eq. (1).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def matrix(q: Floats) -> Floats:
    """Return the rotation matrices (body to world) of unit quaternions. Shape (4, n) to (3, 3, n)."""
    pairs = q[:, None] * q[None, :]
    turned = np.empty_like(q, shape=(3, 3, *q.shape[1:]))
    turned[0, 1] = pairs[1, 2] - pairs[0, 3]
    turned[0, 2] = pairs[1, 3] + pairs[0, 2]
    turned[1, 0] = pairs[1, 2] + pairs[0, 3]
    turned[1, 2] = pairs[2, 3] - pairs[0, 1]
    turned[2, 0] = pairs[1, 3] - pairs[0, 2]
    turned[2, 1] = pairs[2, 3] + pairs[0, 1]
    turned[0, 0] = 0.5 - (pairs[2, 2] + pairs[3, 3])
    turned[1, 1] = 0.5 - (pairs[1, 1] + pairs[3, 3])
    turned[2, 2] = 0.5 - (pairs[1, 1] + pairs[2, 2])
    turned *= 2.0
    return turned


def to_world(turn: Floats, vector: Floats) -> Floats:
    """Return R v. Shapes (3, 3, n) and (3, n) to (3, n)."""
    return turn[:, 0] * vector[0] + turn[:, 1] * vector[1] + turn[:, 2] * vector[2]


def to_body(turn: Floats, vector: Floats) -> Floats:
    """Return R' v. Shapes (3, 3, n) and (3, n) to (3, n)."""
    return turn[0] * vector[0] + turn[1] * vector[1] + turn[2] * vector[2]


def cross(a: Floats, b: Floats) -> Floats:
    """Return a x b. Shapes (3, n)."""
    p = a[:, None] * b[None, :]
    result = np.empty_like(p, shape=(3, *p.shape[2:]))
    np.subtract(p[1, 2], p[2, 1], out=result[0])
    np.subtract(p[2, 0], p[0, 2], out=result[1])
    np.subtract(p[0, 1], p[1, 0], out=result[2])
    return result


def dot(a: Floats, b: Floats) -> Floats:
    """Return a . b. Shapes (3, n) to (n,)."""
    p = a * b
    return p[0] + p[1] + p[2]


def norm(a: Floats) -> Floats:
    """Return |a|. Shape (3, n) to (n,)."""
    return np.sqrt(dot(a, a))


def quaternion_product(a: Floats, b: Floats) -> Floats:
    """Return the product of quaternions. Shapes (4, n)."""
    product = np.empty_like(a)
    product[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    product[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    product[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    product[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
    return product


def quaternion_rate(q: Floats, omega: Floats) -> Floats:
    """Return dq/dt for body rates in rad/s. Shapes (4, n) and (3, n) to (4, n)."""
    half = 0.5 * omega
    rate = np.empty_like(q)
    rate[0] = -dot(q[1:], half)
    rate[1:] = q[0] * half + cross(q[1:], half)
    return rate


def unit(q: Floats) -> Floats:
    """Return q at length one. Shape (4, n)."""
    squares = q * q
    return q / np.sqrt(squares[0] + squares[1] + squares[2] + squares[3])


def error_vector(wanted: Floats, actual: Floats) -> Floats:
    """Return the rotation from `wanted` to `actual` as twice the vector part of its quaternion, the short way round.

    For small angles it is the rotation vector in rad. Shapes (4, n) to (3, n).
    """
    w, v = wanted[0], wanted[1:]
    scalar = w * actual[0] + dot(v, actual[1:])
    vector = w * actual[1:] - actual[0] * v - cross(v, actual[1:])
    return np.where(scalar < 0.0, -2.0, 2.0) * vector


def from_matrix(turn: Floats) -> Floats:
    """Return unit quaternions of rotation matrices, w >= 0. Shape (3, 3, n) to (4, n).

    All four of Shepperd's forms are computed and the best conditioned is taken, vehicle by vehicle.
    """
    t = turn
    trace = t[0, 0] + t[1, 1] + t[2, 2]
    rows = np.empty((4, 4, *trace.shape))
    rows[0, 0] = 1.0 + trace
    for i in range(3):
        rows[i + 1, i + 1] = 1.0 - trace + 2.0 * t[i, i]
    rows[0, 1:] = rows[1:, 0] = t[2, 1] - t[1, 2], t[0, 2] - t[2, 0], t[1, 0] - t[0, 1]
    rows[1, 2:] = rows[2:, 1] = t[0, 1] + t[1, 0], t[0, 2] + t[2, 0]
    rows[2, 3] = rows[3, 2] = t[1, 2] + t[2, 1]
    best = np.argmax(rows[np.arange(4), np.arange(4)], axis=0)
    chosen = rows[best, :, np.arange(len(best))].T
    q = unit(chosen)
    return np.where(q[0] < 0.0, -q, q)


def euler(q: Floats) -> Floats:
    """Return roll, pitch, yaw in rad (Z-Y-X). Shape (4, n) to (3, n)."""
    w, x, y, z = q
    sine = np.clip(2.0 * (w * y - x * z), -1.0, 1.0)
    return np.stack(
        [
            np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
            np.arcsin(sine),
            np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
        ]
    )


def from_euler(angles: Floats) -> Floats:
    """Return the unit quaternions of roll, pitch, yaw in rad (Z-Y-X). Shape (3, n) to (4, n)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(0.5 * angles), np.sin(0.5 * angles)
    return np.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


def euler_rate(angles: Floats, omega: Floats) -> Floats:
    """Return d(roll, pitch, yaw)/dt for body rates: the papers' eq. (3). Shapes (3, n).

    It is singular at a pitch of 90 degrees, as Euler angles are.
    """
    sr, cr = np.sin(angles[0]), np.cos(angles[0])
    cp = np.cos(angles[1])
    swing = sr * omega[1] + cr * omega[2]
    return np.stack([omega[0] + swing * np.sin(angles[1]) / cp, cr * omega[1] - sr * omega[2], swing / cp])


def euler_rate_inverse(angles: Floats, rates: Floats) -> Floats:
    """Return the body rates that give d(roll, pitch, yaw)/dt: Gamma(eps)^-1. Shapes (3, n)."""
    sr, cr = np.sin(angles[0]), np.cos(angles[0])
    sp, cp = np.sin(angles[1]), np.cos(angles[1])
    return np.stack([rates[0] - sp * rates[2], cr * rates[1] + sr * cp * rates[2], -sr * rates[1] + cr * cp * rates[2]])


def wrapped(angle: Floats) -> Floats:
    """Return an angle in rad brought into [-pi, pi)."""
    return np.mod(angle + np.pi, 2.0 * np.pi) - np.pi
