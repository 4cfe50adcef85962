"""The loop on board that every controller shares: from its commands to rotor speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flight.model.attitude import Floats, error_vector, quaternion_rate, unit
from flight.model.dynamics import QuadcopterDynamics, coriolis
from flight.model.plant import Command


@dataclass(frozen=True, slots=True)
class Held:
    """Commands that an autopilot holds to between two updates. Vehicles along the last axis.

    Attributes:
        attitude: Commanded, now, as a quaternion; None where only rates are commanded. Shape (4, n).
        rates: Commanded body rates, now, rad/s. Shape (3, n).
        rates_change: Their derivative, rad/s^2. Shape (3, n).
        thrust: Commanded, now, N. Shape (n,).
        thrust_rate: Its derivative, N/s. Shape (n,).
        rotors: Speeds by its model of the rotors' lag, rad/s. Shape (4, n).
    """

    attitude: Floats | None
    rates: Floats
    rates_change: Floats
    thrust: Floats
    thrust_rate: Floats
    rotors: Floats

    @classmethod
    def of(cls, command: Command, rotors: Floats) -> Held:
        """Take a new command."""
        return cls(command.attitude, command.rates, command.rates_change, command.thrust, command.thrust_rate, rotors)


class Autopilot:
    """The loop on board, at the rate of the dynamics: from a command to rotor speeds.

    It knows attitude and rates from its own sensors, and the rotors' speeds from a model of their lag, which it quickens by
    a lead. Between commands it lets the commanded attitude turn and the thrust change as the command says.
    """

    def __init__(self, model: QuadcopterDynamics) -> None:
        frame = model.airframe
        gains = frame.gains
        self._model, self._frame = model, frame
        self._inertia = np.array(frame.vehicle.inertia)[:, None]
        self._stiffness = np.array([gains.attitude[0], gains.attitude[0], gains.attitude[1]])[:, None]
        self._damping = np.array([gains.rate[0], gains.rate[0], gains.rate[1]])[:, None]
        self._lead = frame.rotor_lag / gains.quickened_lag

    def rotor_commands(
        self, held: Held, attitude: Floats, rates: Floats, ceiling: Floats | float, dt: float
    ) -> tuple[Floats, Held]:
        """Return rotor speeds in rad/s for the next `dt` seconds, shape (4, n), and what is held to after them.

        Args:
            held: What it holds to.
            attitude: Quaternion w x y z. Shape (4, n).
            rates: Body rates, rad/s. Shape (3, n).
            ceiling: Share of the rotors' greatest speed that the battery leaves. Shape (n,), or one number.
            dt: s.
        """
        wanted, turned = held.rates_change - self._damping * (rates - held.rates), held.attitude
        if turned is not None:
            wanted = wanted - self._stiffness * error_vector(turned, attitude)
            turned = unit(turned + dt * quaternion_rate(turned, held.rates))
        torque = self._inertia * wanted + coriolis(self._inertia, rates)
        thrusts = self._model.commands(held.thrust, torque)

        speeds = np.sqrt(thrusts / self._frame.thrust_coefficient)
        lead = held.rotors + self._lead * (speeds - held.rotors)
        asked = np.minimum(np.maximum(lead, self._model.slowest), self._model.fastest * ceiling)
        rotors = asked + math.exp(-dt / self._frame.rotor_lag) * (held.rotors - asked)
        faster, stronger = held.rates + dt * held.rates_change, held.thrust + dt * held.thrust_rate
        return asked, Held(turned, faster, held.rates_change, stronger, held.thrust_rate, rotors)

    def thrust(self, held: Held) -> Floats:
        """Return the collective thrust that its rotor model gives, N. Shape (n,)."""
        squares = held.rotors * held.rotors
        return self._frame.thrust_coefficient * (squares[0] + squares[1] + squares[2] + squares[3])
