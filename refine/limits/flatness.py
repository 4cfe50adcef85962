"""From derivatives of the path and yaw to thrust, attitude, rates and rotor thrusts (differential flatness), sampled.

Conventions: r'' = -g e3 + (f/m) R e3, R = Rz(yaw) Ry(pitch) Rx(roll), so the body's x axis lies in the plane of
(cos yaw, sin yaw, 0) and the world's z. The functions take arrays of samples and prove nothing between them.

The controllers have a flatness map of their own (`flight.control.flatness`): that one is called at every step of a closed loop with
thrust away from zero, this one on whole flights with thrust anywhere, and the two were derived apart. A test holds them to each
other; made one, the last bits of flights that are already certified would change.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from verify.data import GRAVITY

if TYPE_CHECKING:
    from refine.limits.limits import Rotors

Floats = NDArray[np.float64]
_Parts = tuple[Floats, Floats, Floats]
"""The components of vectors at samples."""


@dataclass(frozen=True, eq=False)
class FlatSamples:
    """The vehicle's motion at the samples; each array begins with the samples' shape.

    Attributes:
        thrust: Collective thrust over mass, m/s^2.
        tilt: rad.
        axes: Body axes x, y, z, each by its components in the world frame.
        rates: Body rates about x, y and z, rad/s.
        accelerations: Their derivatives, rad/s^2.
    """

    thrust: Floats
    tilt: Floats
    axes: tuple[_Parts, _Parts, _Parts]
    rates: _Parts
    accelerations: _Parts

    def rotor_thrusts(self, rotors: Rotors) -> Floats:
        """Return the thrust of each rotor in N: front left, rear left, rear right, front right. Shape (..., 4).

        Front left and rear right turn clockwise seen from above, so that they push the body's yaw to the left (+z).
        """
        inertia, (roll, pitch, turn) = rotors.inertia, self.rates
        spin = roll * inertia[0], pitch * inertia[1], turn * inertia[2]
        gyroscopic = pitch * spin[2] - turn * spin[1], turn * spin[0] - roll * spin[2], roll * spin[1] - pitch * spin[0]
        torque = np.stack([a * i + g for a, i, g in zip(self.accelerations, inertia, gyroscopic, strict=True)], axis=-1)
        side = rotors.arm * np.sqrt(0.5)
        share = torque / (4 * np.array([side, side, rotors.torque_to_thrust]))
        signs = np.array([[1, -1, 1], [1, 1, -1], [-1, 1, 1], [-1, -1, -1]])
        return rotors.mass * self.thrust[..., None] / 4 + share @ signs.T


def flat_samples(
    acceleration: Floats, jerk: Floats, snap: Floats, yaw: Floats, yaw_rate: Floats, yaw_acceleration: Floats
) -> FlatSamples:
    """Return attitude and rates at samples.

    Args:
        acceleration: m/s^2. Shape (..., 3).
        jerk: m/s^3. Shape (..., 3).
        snap: m/s^4. Shape (..., 3).
        yaw: rad. Shape (...).
        yaw_rate: rad/s. Shape (...).
        yaw_acceleration: rad/s^2. Shape (...).
    """
    force = _parts(acceleration + np.array([0.0, 0.0, GRAVITY]))
    jerk_parts, snap_parts = _parts(jerk), _parts(snap)
    thrust = np.sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2)
    safe = np.maximum(thrust, 1e-9)
    z = _each(lambda f: f / safe, force)
    thrust_1 = _dot(z, jerk_parts)
    z_1 = _each(lambda j, z: (j - thrust_1 * z) / safe, jerk_parts, z)
    thrust_2 = _dot(z_1, jerk_parts) + _dot(z, snap_parts)
    z_2 = _each(lambda s, z, z_1: (s - thrust_2 * z - 2 * thrust_1 * z_1) / safe, snap_parts, z, z_1)
    cos, sin = np.cos(yaw), np.sin(yaw)  # x_C = (cos, sin, 0), y_C = (-sin, cos, 0); the derivative of x_C is yaw' y_C
    x = cos * z[2], sin * z[2], -sin * z[1] - cos * z[0]  # y_C x z, not yet of length one
    length = np.maximum(np.sqrt(x[0] ** 2 + x[1] ** 2 + x[2] ** 2), 1e-12)
    x = _each(lambda x: x / length, x)
    y = z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]

    def along(axis: _Parts) -> Floats:
        return axis[0] * cos + axis[1] * sin

    def across(axis: _Parts) -> Floats:
        return axis[1] * cos - axis[0] * sin

    roll, pitch = -_dot(y, z_1), _dot(x, z_1)
    # x stays normal to y_C: 0 = d/dt (x . y_C) gives the rate about z.
    top = yaw_rate * along(x) + pitch * across(z)
    below = across(y)
    below = np.where(np.abs(below) < 1e-12, 1e-12, below)
    turn = top / below
    x_1 = _each(lambda y, z: turn * y - pitch * z, y, z)
    y_1 = _each(lambda z, x: roll * z - turn * x, z, x)
    roll_1 = -_dot(y_1, z_1) - _dot(y, z_2)
    pitch_1 = _dot(x_1, z_1) + _dot(x, z_2)
    top_1 = (
        yaw_acceleration * along(x)
        + yaw_rate * (along(x_1) + yaw_rate * across(x))
        + pitch_1 * across(z)
        + pitch * (across(z_1) - yaw_rate * along(z))
    )
    below_1 = across(y_1) - yaw_rate * along(y)
    turn_1 = (top_1 - turn * below_1) / below
    return FlatSamples(
        thrust=thrust,
        tilt=np.arctan2(np.sqrt(force[0] ** 2 + force[1] ** 2), force[2]),
        axes=(x, y, z),
        rates=(roll, pitch, turn),
        accelerations=(roll_1, pitch_1, turn_1),
    )


def _parts(vectors: Floats) -> _Parts:
    """Return the three components of vectors, each in one stretch of memory: arithmetic on these is several times sooner."""
    x, y, z = np.ascontiguousarray(np.moveaxis(vectors, -1, 0))
    return x, y, z


def _each(rule: Callable[..., Floats], *vectors: _Parts) -> _Parts:
    """Return what a rule makes of each component."""
    x, y, z = (rule(*parts) for parts in zip(*vectors, strict=True))
    return x, y, z


def _dot(a: _Parts, b: _Parts) -> Floats:
    return a[0] * b[0] + a[2] * b[2] + a[1] * b[1]  # in the order that certified flights' last bits go by
