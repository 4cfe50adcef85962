"""Two controllers at 50 Hz, and the autopilot that carries their commands out on board.

`PaperController` is the papers' one: a chain of integrators (4) driven by (5) gives a smooth reference, differential flatness
its thrust and body rates mu_ff, and a PID loop the correction mu_fb; the command is thrust and body rates.
`GeometricController` asks for a thrust vector from position, velocity and summed error, and takes body rates and angular
accelerations from jerk and snap, with the rotors' drag at the planned speed compensated; it commands thrust, attitude,
rates and their change, which the autopilot follows between commands.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg import expm

from flight.control.flatness import flat_state, lifted
from flight.model.airframe import Airframe
from flight.model.attitude import (
    Floats,
    dot,
    error_vector,
    euler,
    euler_rate,
    euler_rate_inverse,
    from_matrix,
    quaternion_rate,
    unit,
    wrapped,
)
from flight.model.dynamics import FullModel, coriolis

ControllerName = Literal["geometric", "paper"]

CONTROL_STEP = 0.02
"""s between two commands: 50 Hz, as in the 2022 paper's experiment."""

NEAR = 0.05
"""m, most of an error that is summed: large ones are for the other gains, and would only wind the sum up."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """What a controller knows of the vehicles. Shapes (3, n), (3, n), (4, n), (3, 3, n), (3, n)."""

    position: Floats
    velocity: Floats
    attitude: Floats
    turn: Floats
    rates: Floats


@dataclass(frozen=True, slots=True)
class Command:
    """What a controller asks of the autopilot until the next command.

    Attributes:
        thrust: N, now. Shape (n,).
        thrust_rate: N/s. Shape (n,).
        rates: Body rates, rad/s, now. Shape (3, n).
        rates_change: Their derivative, rad/s^2. Shape (3, n).
        attitude: Attitude to hold now, turning with `rates`; None where only rates are commanded. Shape (4, n).
    """

    thrust: Floats
    thrust_rate: Floats
    rates: Floats
    rates_change: Floats
    attitude: Floats | None


class GeometricController:
    """Thrust vector from the position loop, attitude on SO(3), feed-forward from jerk and snap."""

    def __init__(self, airframe: Airframe, vehicles: int, *, compensate_drag: bool = True) -> None:
        gains, vehicle = airframe.gains, airframe.vehicle
        self._mass = vehicle.mass
        self._position, self._velocity, self._integral = (
            np.array([pair[0], pair[0], pair[1]])[:, None] for pair in (gains.position, gains.velocity, gains.integral)
        )
        self._limit = gains.integral_limit
        self._most, self._least = vehicle.thrust_max, vehicle.thrust_min
        hover = 4.0 * airframe.hover_speed / vehicle.mass if compensate_drag else 0.0
        self._damping = hover * np.array([airframe.rotor_drag, airframe.rotor_drag, airframe.inflow_drag])[:, None]
        self._summed = np.zeros((3, vehicles))

    def command(self, flat: Floats, now: Estimate) -> Command:
        """Return the command for the next 20 ms.

        Args:
            flat: Planned x, y, z, yaw and four derivatives. Shape (5, 4, n).
            now: What is known of the vehicles.
        """
        position, velocity, acceleration, jerk, snap = flat[:, :3]
        off, drift = position - now.position, velocity - now.velocity
        grown = self._summed + CONTROL_STEP * self._integral * np.clip(off, -NEAR, NEAR)
        self._summed = np.clip(grown, -self._limit, self._limit)
        feedback = self._position * off + self._velocity * drift + self._summed
        force = lifted(acceleration + self._damping * velocity) + feedback
        force[2] = np.maximum(force[2], self._least / self._mass)  # stay upright, whatever the error
        wanted = flat_state(
            force, jerk + self._damping * acceleration, snap + self._damping * jerk, flat[0, 3], flat[1, 3], flat[2, 3]
        )
        thrust = np.clip(self._mass * dot(force, now.turn[:, 2]), self._least, self._most)
        return Command(thrust, self._mass * wanted.thrust_rate, wanted.rates, wanted.rates_change, from_matrix(wanted.turn))


class PaperController:
    """The papers' controller: eqs. (4) and (5), flatness feed-forward, PID feedback on thrust and body rates.

    The 2019 paper's feedback has one K_p, K_d and K_q for all terms and writes y_d - y before x_d - x with no
    regard to the heading; here each term has a gain of its own and the position error is turned into the heading frame,
    with the signs that make it stable (thrust up, z up). The chain is stepped exactly with u held, and K
    places its poles in discrete time.
    """

    def __init__(self, airframe: Airframe, vehicles: int, start: Floats) -> None:
        gains = airframe.gains
        self._mass, self._gains = airframe.vehicle.mass, gains
        self._most, self._least = airframe.vehicle.thrust_max, airframe.vehicle.thrust_min
        self._step, self._push, self._k = _chain(gains.chain)
        self._chain = np.zeros((4, 3, vehicles))
        self._chain[0] = start
        self._summed = np.zeros((3, vehicles))

    def command(self, flat: Floats, now: Estimate) -> Command:
        """Return the command for the next 20 ms; arguments as in `GeometricController.command`."""
        chain, gains = self._chain, self._gains
        off_chain = chain - flat[:4, :3]
        k = self._k
        u = -(k[0] * off_chain[0] + k[1] * off_chain[1] + k[2] * off_chain[2] + k[3] * off_chain[3])  # eq. (5)
        wanted = flat_state(lifted(chain[2]), chain[3], u, flat[0, 3], flat[1, 3], flat[2, 3])
        a, b = self._step, self._push
        self._chain = np.stack(
            [a[i, 0] * chain[0] + a[i, 1] * chain[1] + a[i, 2] * chain[2] + a[i, 3] * chain[3] + b[i] * u for i in range(4)]
        )

        off, drift = chain[0] - now.position, chain[1] - now.velocity
        integral = np.array([gains.integral[0], gains.integral[0], gains.integral[1]])[:, None]
        limit = gains.integral_limit
        self._summed = np.clip(self._summed + CONTROL_STEP * integral * np.clip(off, -NEAR, NEAR), -limit, limit)
        horizontal = gains.position[0] * off + gains.velocity[0] * drift + self._summed
        vertical = gains.position[1] * off[2] + gains.velocity[1] * drift[2] + self._summed[2]

        angles, planned = euler(now.attitude), euler(from_matrix(wanted.turn))
        cos, sin = np.cos(angles[2]), np.sin(angles[2])
        lift = wanted.thrust
        lean = np.stack(  # small angles that give the horizontal correction: K_q's term, turned into the heading
            [
                np.clip((sin * horizontal[0] - cos * horizontal[1]) / lift, -0.5, 0.5),
                np.clip((cos * horizontal[0] + sin * horizontal[1]) / lift, -0.5, 0.5),
                np.zeros_like(lift),
            ]
        )
        rates_of_angles = euler_rate(planned, wanted.rates)
        correction = gains.angle * wrapped(planned + lean - angles)
        rates = euler_rate_inverse(angles, rates_of_angles + correction)
        thrust = self._mass * (lift + vertical * now.turn[2, 2])
        zero = np.zeros_like(rates)
        return Command(np.clip(thrust, self._least, self._most), np.zeros_like(thrust), rates, zero, None)


class Autopilot:
    """The loop on board, at the rate of the dynamics: from a command to rotor speeds.

    It knows attitude and rates from its own sensors, and the rotors' speeds from a model of their lag, which it quickens by
    a lead. Between commands it lets the commanded attitude turn and the thrust change as the command says.
    """

    def __init__(self, model: FullModel, vehicles: int) -> None:
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
        """Return rotor speeds in rad/s for the next `dt` seconds. Shapes (4, n), (3, n), (n,) to (4, n)."""
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


def _chain(pole: float) -> tuple[Floats, Floats, Floats]:
    """Return the chain of integrators (4) over one control step, and K of (5) with all poles at -`pole`.

    Ackermann's formula on the discretised chain.
    """
    continuous = np.zeros((5, 5))
    continuous[np.arange(4), np.arange(1, 5)] = 1.0
    exact = np.asarray(expm(continuous * CONTROL_STEP), dtype=np.float64)
    step, push = exact[:4, :4], exact[:4, 4]
    reach = np.stack([np.linalg.matrix_power(step, k) @ push for k in range(4)], axis=1)
    wanted = np.linalg.matrix_power(step - np.exp(-pole * CONTROL_STEP) * np.eye(4), 4)
    return step, push, np.asarray(np.linalg.solve(reach.T, np.array([0.0, 0.0, 0.0, 1.0])) @ wanted, dtype=np.float64)
