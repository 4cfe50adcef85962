"""Response of a team to its monitor's alarm: carry on, hold, or land."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from flight.model.attitude import Floats
from verify.data import Mission

Reaction = Literal["carry_on", "hold", "land"]

LANDING_HEIGHT = 0.05
"""m above the floor of the workspace's frame, where a landing ends."""
LANDING_SPEED = 0.3
"""m/s, mean."""
LANDING_TIME = 15.0
"""s that a simulation goes on at most beyond the plan for a landing."""
_SMOOTH_STEP = [polyder([0, 0, 0, 0, 35, -84, 70, -20], order) for order in range(5)]
"""A step of degree 7 and its derivatives, by ascending powers."""


class Stop:
    """A smooth stop of every robot from its planned motion at one instant, and a descent where it is to land.

    Velocity and the heading's rate go to zero as polynomials of degree 5 that keep them and their two derivatives at the beginning.
    """

    def __init__(self, flat: Floats, begin: float, mission: Mission, reaction: Reaction) -> None:
        """Plan the stop.

        Args:
            flat: Planned x, y, z, yaw and four derivatives at `begin`. Shape (5, 4, robots).
            begin: s.
            mission: Its limits say how fast a robot brakes.
            reaction: `hold` or `land`.
        """
        self._begin, self._start = begin, flat
        speed = float(np.max(np.sqrt(np.sum(flat[1, :3] ** 2, axis=0))))
        self._length = t = braking_time(speed, min(mission.limits_of(robot).acceleration for robot in mission.agents))
        self._velocity = braking(flat, t)
        self._stopped = flat[0] + sum(self._velocity[k] * t ** (k + 1) / (k + 1) for k in range(6))
        self._drop = self._stopped[2] - LANDING_HEIGHT if reaction == "land" else np.zeros(flat.shape[-1])
        self._descent = max(float(np.max(self._drop)) / LANDING_SPEED, 1.0) if reaction == "land" else 0.0

    @property
    def end(self) -> float:
        """Time at which all robots stand still, s."""
        return self._begin + self._length + self._descent

    def flat(self, time: float) -> Floats:
        """Return the flat reference at a time after the stop began. Shape (5, 4, robots)."""
        result = np.zeros_like(self._start)
        t = time - self._begin
        if t < self._length:
            result[0] = self._start[0] + sum(self._velocity[k] * t ** (k + 1) / (k + 1) for k in range(6))
            coefficients = self._velocity
            for order in range(1, 5):
                result[order] = sum(coefficients[k] * t**k for k in range(len(coefficients)))
                coefficients = np.stack([k * coefficients[k] for k in range(1, len(coefficients))])
            return result
        result[0] = self._stopped
        if self._descent:
            step = smooth_step((t - self._length) / self._descent)
            for order in range(5):
                result[order, 2] -= self._drop * step[order] / self._descent**order
        return result


def braking_time(speed: float, acceleration: float) -> float:
    """Return s that braking to a hover takes.

    Args:
        speed: m/s.
        acceleration: m/s^2.
    """
    return max(0.8, 4.0 * speed / acceleration)


def braking_length(mission: Mission) -> float:
    """Return s that braking to a hover takes in a live flight, from any speed and for every robot: what the certificate of aborts is of.

    Args:
        mission: Who flies, within which limits.
    """
    limits = [mission.limits_of(robot) for robot in mission.agents]
    return max(braking_time(limit.speed, limit.acceleration) for limit in limits)


def braking(flat: Floats, length: float) -> Floats:
    """Return the powers of rates that keep velocity, acceleration and jerk of a motion, heading included, and are zero after some seconds.

    Args:
        flat: x, y, z, yaw and their derivatives. Shape (5, 4, ...).
        length: s.

    Returns:
        m/s and rad/s and so on, ascending powers. Shape (6, 4, ...).
    """
    t = length
    velocity, acceleration, jerk = flat[1], flat[2], flat[3]
    # Powers 3 to 5 that bring velocity, acceleration and jerk to zero at the end.
    ends = np.array([[t**3, t**4, t**5], [3 * t**2, 4 * t**3, 5 * t**4], [6 * t, 12 * t**2, 20 * t**3]])
    left = -np.stack([velocity + t * acceleration + 0.5 * t * t * jerk, acceleration + t * jerk, jerk])
    high = np.asarray(np.linalg.solve(ends, left.reshape(3, -1)), dtype=np.float64).reshape(3, *velocity.shape)
    return np.concatenate([np.stack([velocity, acceleration, 0.5 * jerk]), high])


def smooth_step(share: float) -> tuple[float, ...]:
    """Return a step of degree 7 from rest to rest at a share of its way, 0 to 1, and its four derivatives by that share."""
    return tuple(float(polyval(min(max(share, 0.0), 1.0), shape)) for shape in _SMOOTH_STEP)
