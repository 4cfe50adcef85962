"""From a flat output to the whole state: thrust, attitude, body rates and angular acceleration.

With F = r'' + g e3 (mass-normalised thrust) the body's z axis is F/|F|. The body's x axis is at right angles to
y_C = (-sin yaw, cos yaw, 0), which is Z-Y-X Euler. Jerk gives the body rates, snap the angular acceleration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flight.model.attitude import Floats, cross, dot, norm
from verify.data import GRAVITY


@dataclass(frozen=True, slots=True)
class FeedForward:
    """Inputs by which a vehicle without drag follows a flat output exactly. Vehicles along the last axis.

    Attributes:
        thrust: Mass-normalised thrust |F|, m/s^2. Shape (n,).
        thrust_rate: Its derivative, m/s^3. Shape (n,).
        turn: Rotation matrix, body to world. Shape (3, 3, n).
        rates: Body rates, rad/s. Shape (3, n).
        rates_change: Angular acceleration in the body frame, rad/s^2. Shape (3, n).
    """

    thrust: Floats
    thrust_rate: Floats
    turn: Floats
    rates: Floats
    rates_change: Floats


def lifted(acceleration: Floats) -> Floats:
    """Return F = a + g e3: the mass-normalised force that the rotors must give. Shape (3, n)."""
    force = np.array(acceleration, dtype=np.float64)
    force[2] += GRAVITY
    return force


def feed_forward(force: Floats, jerk: Floats, snap: Floats, yaw: Floats, yaw_rate: Floats, yaw_change: Floats) -> FeedForward:
    """Return the state that gives mass-normalised `force` with derivatives `jerk` and `snap`, at this heading.

    Args:
        force: r'' + g e3 in m/s^2, away from zero. Shape (3, n).
        jerk: Its derivative, m/s^3. Shape (3, n).
        snap: Its second derivative, m/s^4. Shape (3, n).
        yaw: Heading in rad. Shape (n,).
        yaw_rate: Its derivative, rad/s. Shape (n,).
        yaw_change: Its second derivative, rad/s^2. Shape (n,).
    """
    thrust = norm(force)
    z = force / thrust
    cos, sin, zero = np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)
    x_c, y_c = np.stack([cos, sin, zero]), np.stack([-sin, cos, zero])
    x = cross(y_c, z)
    x = x / norm(x)
    y = cross(z, x)

    thrust_rate = dot(jerk, z)
    z_rate = (jerk - thrust_rate * z) / thrust
    wx, wy = -dot(z_rate, y), dot(z_rate, x)
    # x stays at right angles to y_C; differentiating x . y_C = 0 gives the rate about z.
    share, lean, level = dot(x, x_c), dot(z, y_c), dot(y, y_c)
    wz = (yaw_rate * share + wy * lean) / level

    thrust_change = dot(snap, z) + dot(jerk, z_rate)
    z_change = (snap - thrust_change * z - 2.0 * thrust_rate * z_rate) / thrust
    ax, ay = -dot(z_change, y) + wy * wz, dot(z_change, x) - wx * wz
    share_rate = wz * dot(y, x_c) - wy * dot(z, x_c)
    lean_rate = dot(z_rate, y_c) - yaw_rate * dot(z, x_c)
    level_rate = wx * lean - wz * dot(x, y_c) - yaw_rate * dot(y, x_c)
    az = (yaw_change * share + yaw_rate * share_rate + ay * lean + wy * lean_rate - wz * level_rate) / level
    return FeedForward(thrust, thrust_rate, np.stack([x, y, z], axis=1), np.stack([wx, wy, wz]), np.stack([ax, ay, az]))
