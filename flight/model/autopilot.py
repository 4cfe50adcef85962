"""The loop on board that every controller shares: from its commands to rotor speeds."""

from __future__ import annotations

import math

import numpy as np

from flight.model.attitude import Floats, error_vector, quaternion_rate, unit
from flight.model.dynamics import QuadcopterDynamics, coriolis
from flight.model.plant import Command


class Autopilot:
    """The loop on board, at the rate of the dynamics: from a command to rotor speeds.

    It knows attitude and rates from its own sensors, and the rotors' speeds from a model of their lag, which it quickens by
    a lead. Between commands it lets the commanded attitude turn and the thrust change as the command says.
    """

    def __init__(self, model: QuadcopterDynamics, vehicles: int) -> None:
        frame = model.airframe
        gains = frame.gains
        self._model, self._frame = model, frame
        self._inertia = np.array(frame.vehicle.inertia)[:, None]
        self._stiffness = np.array([gains.attitude[0], gains.attitude[0], gains.attitude[1]])[:, None]
        self._damping = np.array([gains.rate[0], gains.rate[0], gains.rate[1]])[:, None]
        self._lead = frame.rotor_lag / gains.quickened_lag
        self._rotors = np.full((4, vehicles), frame.hover_speed)
        self._command: Command | None = None
        self._attitude: Floats | None = None

    def follow(self, command: Command) -> None:
        """Take a new command."""
        self._command, self._attitude = command, command.attitude
        self._rates, self._thrust = command.rates, command.thrust

    def rotor_commands(self, attitude: Floats, rates: Floats, ceiling: Floats | float, dt: float) -> Floats:
        """Return rotor speeds in rad/s for the next `dt` seconds. Shapes (4, n), (3, n), (n,) to (4, n).

        Args:
            attitude: Quaternion w x y z. Shape (4, n).
            rates: Body rates, rad/s. Shape (3, n).
            ceiling: Share of the rotors' greatest speed that the battery leaves. Shape (n,), or one number.
            dt: s.

        Returns:
            Shape (4, n).
        """
        command = self._command
        assert command is not None, "follow() comes before rotor_commands()"
        wanted = command.rates_change - self._damping * (rates - self._rates)
        if self._attitude is not None:
            wanted = wanted - self._stiffness * error_vector(self._attitude, attitude)
            self._attitude = unit(self._attitude + dt * quaternion_rate(self._attitude, self._rates))
        torque = self._inertia * wanted + coriolis(self._inertia, rates)
        thrusts = self._model.commands(self._thrust, torque)
        self._rates = self._rates + dt * command.rates_change
        self._thrust = self._thrust + dt * command.thrust_rate

        speeds = np.sqrt(thrusts / self._frame.thrust_coefficient)
        lead = self._rotors + self._lead * (speeds - self._rotors)
        asked = np.minimum(np.maximum(lead, self._model.slowest), self._model.fastest * ceiling)
        self._rotors = asked + math.exp(-dt / self._frame.rotor_lag) * (self._rotors - asked)
        return asked

    @property
    def thrust(self) -> Floats:
        """Collective thrust that its rotor model gives, N. Shape (n,)."""
        squares = self._rotors * self._rotors
        return self._frame.thrust_coefficient * (squares[0] + squares[1] + squares[2] + squares[3])
