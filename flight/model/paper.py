"""The papers' model, eqs. (1) to (3) with our thrust sign: r'' = -g e3 + (f/m) R e3 and eps' = Gamma(eps) omega.

Thrust and body rates are the inputs and act at once; wind and battery do not enter it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flight.model.airframe import Airframe
from flight.model.attitude import Floats, error_vector, euler_rate, from_euler, matrix, quaternion_rate, to_world, unit
from flight.model.dynamics import POSITION, VELOCITY, runge_kutta
from flight.model.plant import AirframeModel, Command, Motion, Plant
from flight.model.timing import STEP
from verify.data import GRAVITY

# Rows of the state: r, r', (roll, pitch, yaw).
ANGLES = slice(6, 9)
PAPER_STATES = 9


@dataclass(frozen=True, slots=True)
class PaperModel(AirframeModel):
    """The papers' model."""

    def begin(self, airframe: Airframe, flat: Floats) -> Plant:
        """Return vehicles that hover; arguments as said there."""
        return _PaperPlant(airframe, flat)

    def known(self, airframe: Airframe) -> Airframe:
        """Return the airframe without drag, which this model does not have."""
        return airframe.model_copy(update={"rotor_drag": 0.0, "inflow_drag": 0.0})


PAPER = PaperModel()


def paper_derivative(state: Floats, thrust: Floats, rates: Floats, mass: float) -> Floats:
    """Return the time derivative of the papers' state: eqs. (2) and (3).

    Args:
        state: r in m, r' in m/s, roll, pitch, yaw in rad. Shape (9, n).
        thrust: f_z in N, along the body's z axis. Shape (n,).
        rates: Body rates in rad/s. Shape (3, n).
        mass: kg.
    """
    roll, pitch, yaw = state[ANGLES]
    cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    cy, sy = np.cos(yaw), np.sin(yaw)
    lift = thrust / mass
    change = np.empty_like(state)
    change[POSITION] = state[VELOCITY]
    change[3] = lift * (cr * sp * cy + sr * sy)
    change[4] = lift * (cr * sp * sy - sr * cy)
    change[5] = lift * (cr * cp) - GRAVITY
    change[ANGLES] = euler_rate(state[ANGLES], rates)
    return change


def paper_step(state: Floats, thrust: Floats, rates: Floats, mass: float, dt: float) -> Floats:
    """Return the papers' state after `dt` seconds of constant inputs (Runge-Kutta of order 4).

    Args:
        state: r in m, r' in m/s, roll, pitch, yaw in rad. Shape (9, n).
        thrust: N, along the body's z axis. Shape (n,).
        rates: Body rates in rad/s. Shape (3, n).
        mass: kg.
        dt: s.
    """
    after = np.empty_like(state)
    runge_kutta(lambda s, _: paper_derivative(s, thrust, rates, mass), state, dt, after)
    return after


class _PaperPlant(Plant):
    """The papers' model with the attitude loop on board."""

    def __init__(self, airframe: Airframe, flat: Floats) -> None:
        n = flat.shape[-1]
        self._airframe, self._mass = airframe, airframe.vehicle.mass
        self._state = np.zeros((PAPER_STATES, n))
        self._state[POSITION] = flat[:3]
        self._state[8] = flat[3]
        self._thrust, self._rates = np.full(n, airframe.vehicle.weight), np.zeros((3, n))
        self._command: Command | None = None
        self._attitude: Floats | None = None
        self._wanted_rates = self._rates

    @property
    def position(self) -> Floats:
        return self._state[POSITION]

    @property
    def thrust(self) -> Floats:
        return self._thrust

    def motion(self) -> Motion:
        return Motion(self._state[POSITION], self._state[VELOCITY], from_euler(self._state[ANGLES]), self._rates)

    def felt(self) -> Floats:
        lift = np.stack([np.zeros_like(self._thrust), np.zeros_like(self._thrust), self._thrust / self._mass])
        acceleration = to_world(matrix(from_euler(self._state[ANGLES])), lift)
        acceleration[2] -= GRAVITY
        return acceleration

    def follow(self, command: Command) -> None:
        self._command, self._thrust, self._rates = command, command.thrust, command.rates
        self._attitude = command.attitude
        self._wanted_rates = command.rates

    def step(self, wind: Floats | float) -> None:  # noqa: ARG002  # there is no air in this model
        command = self._command
        assert command is not None, "follow() comes before step()"
        if self._attitude is not None:  # the autopilot's attitude loop, without inertia: rates follow at once
            off = error_vector(self._attitude, from_euler(self._state[ANGLES]))
            self._rates = self._wanted_rates - self._airframe.gains.angle * off
            self._attitude = unit(self._attitude + STEP * quaternion_rate(self._attitude, self._wanted_rates))
            self._wanted_rates = self._wanted_rates + STEP * command.rates_change
        self._state = paper_step(self._state, self._thrust, self._rates, self._mass, STEP)
        if self._attitude is not None:
            self._thrust = self._thrust + STEP * command.thrust_rate
