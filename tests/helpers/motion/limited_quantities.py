"""What limits bound, by dense samples: attitude by angles, rates by differences of it, rotors by solving for them."""

from __future__ import annotations

import math

import numpy as np

from verify.data.vehicle import GRAVITY

LIMITS = (
    "speed",
    "acceleration",
    "thrust_max",
    "thrust_min",
    "tilt",
    "body_rate",
    "yaw_rate",
    "rotor_thrust_max",
    "rotor_thrust_min",
)
"""What is limited in each mission, as its claims call it after `limits.`."""


def rotation(trajectory, times):
    """Rz(yaw) Ry(pitch) Rx(roll) from thrust direction and yaw, by angles: not the judge's formulas. Shape (n, 3, 3)."""
    force = trajectory.evaluate(times, 2)[:, :3] + np.array([0, 0, GRAVITY])
    yaw = trajectory.evaluate(times, 0)[:, 3]
    cos, sin = np.cos(yaw), np.sin(yaw)
    p, q, w = cos * force[:, 0] + sin * force[:, 1], cos * force[:, 1] - sin * force[:, 0], force[:, 2]
    pitch = np.arctan2(p, w)
    roll = np.arcsin(-q / np.linalg.norm(force, axis=1))
    zero, one = np.zeros_like(yaw), np.ones_like(yaw)
    rz = np.stack([cos, -sin, zero, sin, cos, zero, zero, zero, one], -1).reshape(-1, 3, 3)
    cp, sp, cr, sr = np.cos(pitch), np.sin(pitch), np.cos(roll), np.sin(roll)
    ry = np.stack([cp, zero, sp, zero, one, zero, -sp, zero, cp], -1).reshape(-1, 3, 3)
    rx = np.stack([one, zero, zero, zero, cr, -sr, zero, sr, cr], -1).reshape(-1, 3, 3)
    return rz @ ry @ rx


def sampled(trajectory, vehicle, count=400, step=1e-4):
    """All quantities at inner samples, rates by central differences of the attitude."""
    times = np.concatenate(
        [np.linspace(k + 3 * step, e - 3 * step, count) for k, e in zip(trajectory.knots, trajectory.knots[1:], strict=False)]
    )

    def rates(at):
        turn = (
            np.swapaxes(rotation(trajectory, at), 1, 2)
            @ (rotation(trajectory, at + step) - rotation(trajectory, at - step))
            / (2 * step)
        )
        return np.stack([turn[:, 2, 1], turn[:, 0, 2], turn[:, 1, 0]], -1)

    omega = rates(times)
    change = (rates(times + step) - rates(times - step)) / (2 * step)
    inertia = np.array(vehicle.inertia)
    torque = inertia * change + np.cross(omega, inertia * omega)
    acceleration = trajectory.evaluate(times, 2)[:, :3]
    force = acceleration + np.array([0, 0, GRAVITY])
    thrust = vehicle.mass * np.linalg.norm(force, axis=1)
    arm = vehicle.arm / math.sqrt(2)
    corners = np.array([[1, 1], [-1, 1], [1, -1], [-1, -1]])
    # solve for the four rotors: thrust, roll torque (y F), pitch torque (-x F), yaw torque (signed by x y)
    mixing = np.stack([np.ones(4), arm * corners[:, 1], -arm * corners[:, 0], vehicle.torque_to_thrust * corners.prod(1)])
    rotors = np.linalg.solve(mixing, np.column_stack([thrust, torque]).T)
    return {
        "speed": np.linalg.norm(trajectory.evaluate(times, 1)[:, :3], axis=1),
        "acceleration": np.linalg.norm(acceleration, axis=1),
        "thrust_max": thrust,
        "thrust_min": thrust,
        "tilt": np.arccos(force[:, 2] / np.linalg.norm(force, axis=1)),
        "body_rate": np.linalg.norm(omega[:, :2], axis=1),
        "yaw_rate": np.abs(omega[:, 2]),
        "rotor_thrust_max": rotors.max(0),
        "rotor_thrust_min": rotors.min(0),
    }
