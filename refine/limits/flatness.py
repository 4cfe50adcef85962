"""From derivatives of the path and yaw to thrust, attitude, rates and rotor thrusts (differential flatness), sampled.

Conventions: r'' = -g e3 + (f/m) R e3, R = Rz(yaw) Ry(pitch) Rx(roll), so the body's x axis lies in the plane of
(cos yaw, sin yaw, 0) and the world's z. The functions take arrays of samples and prove nothing between them.

The controllers have a flatness map of their own (`flight.control.flatness`): that one is called at every step of a closed loop with
thrust away from zero, this one on whole flights with thrust anywhere, and the two were derived apart. A test holds them to each
other; made one, the last bits of flights that are already certified would change.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from verify.data import GRAVITY

if TYPE_CHECKING:
    from refine.limits.limits import Rotors

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FlatSamples:
    """The vehicle's motion at the samples; each array begins with the samples' shape.

    Attributes:
        thrust: Collective thrust over mass, m/s^2.
        tilt: rad.
        axes: Body axes x, y, z in the world frame. Shape (..., 3, 3), `axes[..., i, :]` is axis i.
        rates: Body rates, rad/s. Shape (..., 3).
        accelerations: Their derivatives, rad/s^2. Shape (..., 3).
    """

    thrust: Floats
    tilt: Floats
    axes: Floats
    rates: Floats
    accelerations: Floats

    def rotor_thrusts(self, rotors: Rotors) -> Floats:
        """Return the thrust of each rotor in N: front left, rear left, rear right, front right. Shape (..., 4).

        Front left and rear right turn clockwise seen from above, so that they push the body's yaw to the left (+z).
        """
        inertia = np.array(rotors.inertia)
        spin = self.rates * inertia
        torque = self.accelerations * inertia + np.cross(self.rates, spin)
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
    force = acceleration + np.array([0.0, 0.0, GRAVITY])
    thrust = np.linalg.norm(force, axis=-1)
    safe = np.maximum(thrust, 1e-9)
    z = force / safe[..., None]
    thrust_1 = _dot(z, jerk)
    z_1 = (jerk - thrust_1[..., None] * z) / safe[..., None]
    thrust_2 = _dot(z_1, jerk) + _dot(z, snap)
    z_2 = (snap - thrust_2[..., None] * z - 2 * thrust_1[..., None] * z_1) / safe[..., None]
    zero = np.zeros_like(yaw)
    along = np.stack([np.cos(yaw), np.sin(yaw), zero], axis=-1)  # x_C; its derivative is yaw' y_C
    across = np.stack([-np.sin(yaw), np.cos(yaw), zero], axis=-1)  # y_C
    x = np.cross(across, z)
    x = x / np.maximum(np.linalg.norm(x, axis=-1), 1e-12)[..., None]
    y = np.cross(z, x)
    roll, pitch = -_dot(y, z_1), _dot(x, z_1)
    # x stays normal to y_C: 0 = d/dt (x . y_C) gives the rate about z.
    top = yaw_rate * _dot(x, along) + pitch * _dot(z, across)
    below = _dot(y, across)
    below = np.where(np.abs(below) < 1e-12, 1e-12, below)
    turn = top / below
    x_1 = turn[..., None] * y - pitch[..., None] * z
    y_1 = roll[..., None] * z - turn[..., None] * x
    roll_1 = -_dot(y_1, z_1) - _dot(y, z_2)
    pitch_1 = _dot(x_1, z_1) + _dot(x, z_2)
    top_1 = (
        yaw_acceleration * _dot(x, along)
        + yaw_rate * (_dot(x_1, along) + yaw_rate * _dot(x, across))
        + pitch_1 * _dot(z, across)
        + pitch * (_dot(z_1, across) - yaw_rate * _dot(z, along))
    )
    below_1 = _dot(y_1, across) - yaw_rate * _dot(y, along)
    turn_1 = (top_1 - turn * below_1) / below
    return FlatSamples(
        thrust=thrust,
        tilt=np.arctan2(np.linalg.norm(force[..., :2], axis=-1), force[..., 2]),
        axes=np.stack([x, y, z], axis=-2),
        rates=np.stack([roll, pitch, turn], axis=-1),
        accelerations=np.stack([roll_1, pitch_1, turn_1], axis=-1),
    )


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("...i,...i->...", a, b)
