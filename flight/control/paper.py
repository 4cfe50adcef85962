"""The papers' controller: eqs. (4) and (5), flatness feed-forward, PID feedback on thrust and body rates.

A chain of integrators (4) driven by (5) gives a smooth reference, differential flatness its thrust and body rates mu_ff, and a PID
loop the correction mu_fb; the command is thrust and body rates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from flight.control.controller import NEAR, Controller, ControlLoop
from flight.control.flatness import feed_forward, lifted
from flight.model.airframe import Airframe
from flight.model.attitude import Floats, euler, euler_rate, euler_rate_inverse, from_matrix, wrapped
from flight.model.plant import Command, Motion
from flight.model.timing import CONTROL_STEP


@dataclass(frozen=True, slots=True)
class PaperController(Controller):
    """The papers' controller: eqs. (4) and (5), flatness feed-forward, PID feedback on thrust and body rates.

    The 2019 paper's feedback has one K_p, K_d and K_q for all terms and writes y_d - y before x_d - x with no
    regard to the heading; here each term has a gain of its own and the position error is turned into the heading frame,
    with the signs that make it stable (thrust up, z up). The chain is stepped exactly with u held, and K
    places its poles in discrete time.
    """

    def begin(self, airframe: Airframe, flat: Floats) -> ControlLoop:
        """Return a loop for vehicles that hover; arguments as said there."""
        return _PaperLoop(airframe, flat.shape[-1], flat[:3])


PAPER = PaperController()


class _PaperLoop:
    def __init__(self, airframe: Airframe, vehicles: int, start: Floats) -> None:
        gains = airframe.gains
        self._mass, self._gains = airframe.vehicle.mass, gains
        self._most, self._least = airframe.vehicle.thrust_max, airframe.vehicle.thrust_min
        self._step, self._push, self._k = discrete_chain(gains.chain)
        self._chain = np.zeros((4, 3, vehicles))
        self._chain[0] = start
        self._summed = np.zeros((3, vehicles))

    def command(self, flat: Floats, now: Motion) -> Command:
        chain, gains = self._chain, self._gains
        off_chain = chain - flat[:4, :3]
        k = self._k
        u = -(k[0] * off_chain[0] + k[1] * off_chain[1] + k[2] * off_chain[2] + k[3] * off_chain[3])  # eq. (5)
        wanted = feed_forward(lifted(chain[2]), chain[3], u, flat[0, 3], flat[1, 3], flat[2, 3])
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


def discrete_chain(pole: float) -> tuple[Floats, Floats, Floats]:
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
