"""Measures of how much a motion exceeds its limits at samples, with their gradients, for optimisers that descend.

Each measure is a smooth value that is at most 0 where its limit is kept, of the order of one. Rotor thrusts count as they are
without a torque about the body's z: inertia times z x z'' is then the torque, and its norm bounds both shares of each rotor.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from refine.limits.limits import Limits, Rotors
from verify.data import GRAVITY

Floats = NDArray[np.float64]
Motion = tuple[Floats, Floats, Floats, Floats]
"""Velocity, acceleration, jerk and snap at samples, in SI units. Shapes (pieces, samples, 3)."""

_Slope = Callable[[Floats], list[tuple[int, Floats]]]
"""From the weights of a measure at samples to its derivatives by parts of the motion, by their index."""

_G = np.array([0.0, 0.0, GRAVITY])


class Penalty:
    """The weighted sum of squared excesses of a motion, and its gradient.

    Args:
        limits: What is kept; the rate of yaw is left out.
        speeds: Greatest speed of each piece, m/s; inf for none. Shape (pieces,).
        accelerations: Greatest acceleration of each piece, m/s^2; inf for none. Shape (pieces,).
    """

    def __init__(self, limits: Limits, speeds: Floats, accelerations: Floats) -> None:
        self._limits = limits
        self._speed = _inverse_squares(np.minimum(speeds, limits.speed))
        self._acceleration = _inverse_squares(np.minimum(accelerations, limits.acceleration))

    def __call__(self, motion: Motion, weights: Floats) -> tuple[Floats, Motion]:
        """Return each piece's sum of squared excesses, and the derivatives of all of them by the motion, both weighted.

        Args:
            motion: At the samples.
            weights: Of the samples. Shape (pieces, samples).
        """
        total = np.zeros(len(weights))
        slopes = tuple(np.zeros_like(each) for each in motion)
        for values, slope in self._measures(motion):
            over = np.maximum(values, 0.0)
            if over.any():
                total += np.sum(weights * over**2, axis=1)
                for index, part in slope(2.0 * weights * over):
                    slopes[index][...] += part
        return total, (slopes[0], slopes[1], slopes[2], slopes[3])

    def _measures(self, motion: Motion) -> Iterator[tuple[Floats, _Slope]]:
        """Yield each limit's measure, and the function from weights to what they make of its derivatives by the motion."""
        limits, (velocity, acceleration, jerk, snap) = self._limits, motion
        if self._speed.any():
            yield _square(velocity) * self._speed - 1.0, lambda w: [(0, 2.0 * velocity * (w * self._speed)[..., None])]
        if self._acceleration.any():
            scale = self._acceleration
            yield _square(acceleration) * scale - 1.0, lambda w: [(1, 2.0 * acceleration * (w * scale)[..., None])]
        force = acceleration + _G
        square = _square(force)
        if math.isfinite(limits.thrust_max):
            most = limits.thrust_max**-2
            yield square * most - 1.0, lambda w: [(1, 2.0 * most * force * w[..., None])]
        if limits.thrust_min > 0.0:
            unit = GRAVITY**-2
            yield (limits.thrust_min**2 - square) * unit, lambda w: [(1, -2.0 * unit * force * w[..., None])]
        if math.isfinite(limits.tilt):
            yield _tilt(force, square, math.cos(limits.tilt))
        across = _cross(jerk, force)
        if math.isfinite(limits.body_rate):
            yield _body_rate(force, jerk, across, square, limits.body_rate)
        if limits.rotors is not None:
            yield from _rotor_thrusts(force, jerk, snap, across, square, limits.rotors)


def _tilt(force: Floats, square: Floats, least: float) -> tuple[Floats, _Slope]:
    """Return by how much the cosine of the tilt is below its least one."""
    size = np.sqrt(square + 1e-12)
    cosine = force[..., 2] / size

    def slope(weights: Floats) -> list[tuple[int, Floats]]:
        part = force * (weights * cosine / (square + 1e-12))[..., None]
        part[..., 2] -= weights / size
        return [(1, part)]

    return least - cosine, slope


def _body_rate(force: Floats, jerk: Floats, across: Floats, square: Floats, most: float) -> tuple[Floats, _Slope]:
    """Return by how much |j x f|^2 / |f|^4, the squared norm of roll and pitch rate, exceeds its limit."""
    scale = 1.0 / (most**2 * square**2 + 1e-12)
    share = _square(across) * scale

    def slope(weights: Floats) -> list[tuple[int, Floats]]:
        by_across = 2.0 * across * (weights * scale)[..., None]
        by_force = _cross(by_across, jerk) - force * (4.0 * weights * share * scale * most**2 * square)[..., None]
        return [(1, by_force), (2, _cross(force, by_across))]

    return share - 1.0, slope


def _rotor_thrusts(
    force: Floats, jerk: Floats, snap: Floats, across: Floats, square: Floats, rotors: Rotors
) -> Iterator[tuple[Floats, _Slope]]:
    """Yield by how much rotors exceed their greatest thrust, and by how much they fall below their least one."""
    size = np.sqrt(square + 1e-9)
    most, least = rotors.most / rotors.mass, rotors.least / rotors.mass
    arm = rotors.inertia[0] / (2.0 * rotors.arm * rotors.mass)
    swung, along = _cross(force, snap), _dot(force, jerk)
    turning = swung / square[..., None] + across * (2.0 * along / square**2)[..., None]  # z x z''; across is -(f x j)
    root = np.sqrt(_square(turning) + 1.0)

    def slope(weights: Floats, sign: float) -> list[tuple[int, Floats]]:
        by_turning = turning * (weights * arm / (most * root))[..., None]
        by_swung = by_turning / square[..., None]
        pulled = _dot(by_turning, across)
        by_square = -_dot(by_turning, swung) / square**2 - 4.0 * along * pulled / square**3
        by_along = (2.0 * pulled / square**2)[..., None]
        by_across = by_turning * (2.0 * along / square**2)[..., None]
        by_force = _cross(snap, by_swung) + _cross(by_across, jerk) + by_along * jerk
        by_force += force * (2.0 * by_square + sign * weights / (4.0 * most * size))[..., None]
        return [(1, by_force), (2, _cross(force, by_across) + by_along * force), (3, _cross(by_swung, force))]

    yield (size / 4.0 + arm * root) / most - 1.0, lambda w: slope(w, 1.0)
    yield (least - size / 4.0 + arm * root) / most, lambda w: slope(w, -1.0)


def _inverse_squares(limits: Floats) -> Floats:
    """Return 1 / limit^2 of each piece, 0 where there is none. Shape (pieces, 1)."""
    return (np.where(np.isfinite(limits), limits, np.inf) ** -2.0)[:, None]


def _square(values: Floats) -> Floats:
    return np.einsum("...i,...i->...", values, values)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("...i,...i->...", a, b)


def _cross(a: Floats, b: Floats) -> Floats:
    """Return the cross product, several times sooner than numpy's for small arrays."""
    found = np.empty_like(a)
    found[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    found[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    found[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return found
