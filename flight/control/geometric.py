"""The geometric controller: position to a thrust vector, attitude on SO(3), with the plan's derivatives fed forward.

It asks for a thrust vector from position, velocity and summed error, and takes body rates and angular accelerations from jerk and
snap, with the rotors' drag at the planned speed compensated; it commands thrust, attitude, rates and their change, which the
autopilot follows between commands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flight.control.controller import NEAR, Controller, ControlLoop
from flight.control.flatness import feed_forward, lifted
from flight.model.airframe import Airframe
from flight.model.attitude import Floats, dot, from_matrix
from flight.model.plant import Command, Motion
from flight.model.timing import CONTROL_STEP


@dataclass(frozen=True, slots=True)
class GeometricController(Controller):
    """Thrust vector from the position loop, attitude on SO(3), feed-forward from jerk and snap."""

    def begin(self, airframe: Airframe, flat: Floats) -> ControlLoop:
        """Return a loop for vehicles that hover; arguments as said there."""
        return _GeometricLoop(airframe, flat.shape[-1])


GEOMETRIC = GeometricController()


class _GeometricLoop:
    def __init__(self, airframe: Airframe, vehicles: int) -> None:
        gains, vehicle = airframe.gains, airframe.vehicle
        self._mass = vehicle.mass
        self._position, self._velocity, self._integral = (
            np.array([pair[0], pair[0], pair[1]])[:, None] for pair in (gains.position, gains.velocity, gains.integral)
        )
        self._limit = gains.integral_limit
        self._most, self._least = vehicle.thrust_max, vehicle.thrust_min
        hover = 4.0 * airframe.hover_speed / vehicle.mass
        self._damping = hover * np.array([airframe.rotor_drag, airframe.rotor_drag, airframe.inflow_drag])[:, None]
        self._summed = np.zeros((3, vehicles))

    def command(self, flat: Floats, now: Motion) -> Command:
        position, velocity, acceleration, jerk, snap = flat[:, :3]
        off, drift = position - now.position, velocity - now.velocity
        grown = self._summed + CONTROL_STEP * self._integral * np.clip(off, -NEAR, NEAR)
        self._summed = np.clip(grown, -self._limit, self._limit)
        feedback = self._position * off + self._velocity * drift + self._summed
        force = lifted(acceleration + self._damping * velocity) + feedback
        force[2] = np.maximum(force[2], self._least / self._mass)  # stay upright, whatever the error
        wanted = feed_forward(
            force, jerk + self._damping * acceleration, snap + self._damping * jerk, flat[0, 3], flat[1, 3], flat[2, 3]
        )
        thrust = np.clip(self._mass * dot(force, now.turn[:, 2]), self._least, self._most)
        return Command(thrust, self._mass * wanted.thrust_rate, wanted.rates, wanted.rates_change, from_matrix(wanted.turn))
