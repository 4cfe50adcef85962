"""The laws of a vehicle that `mellinger` flies, about a level hover, in slopes: body and rotors, and the controller.

The four rotors' thrusts over that of the hover are 1 plus combinations: all alike, by their spin, by the side of y, by that of x.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Floats
from verify.data.airframe import AirframeTable
from verify.data.autopilot import MellingerGains
from verify.data.vehicle import GRAVITY, Vehicle
from verify.tracking.on_board.rotations import along, applied, crossed, estimated, flown, tilting, turned
from verify.tracking.on_board.slopes import Slopes, joined, narrower, root, stacked

FULL_SCALE = 65535.0
"""Counts of a motor at its greatest thrust."""
SIGNS = np.array([[1.0, 1.0, 1.0, 1.0], [1.0, -1.0, -1.0, 1.0], [1.0, 1.0, -1.0, -1.0], [1.0, -1.0, 1.0, -1.0]])
"""Of the rotors, from front left clockwise, in each combination: all, spin, side of y, side of x. Shape (4, 4)."""


_NONE = np.array(0.0)
"""Thrust below which none is; where a law is bounded for less there is none."""


def along4(a: Floats, b: Slopes | list[Slopes]) -> Slopes:
    """Return a . b of four components each."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]


@dataclass(frozen=True, eq=False, slots=True)
class Body:
    """Body and rotors.

    Attributes:
        vehicle: Its mass, arm, inertia and rotors.
        airframe: Its lag and drag.
    """

    vehicle: Vehicle
    airframe: AirframeTable

    @property
    def hover_speed(self) -> float:
        """Of a rotor, rad/s."""
        return math.sqrt(self.vehicle.mass * GRAVITY / 4.0 / self.airframe.thrust_coefficient)

    def speeds(self, thrusts: Slopes) -> Slopes:
        """Return combinations of the rotors' speeds, of combinations of their thrusts less those of the hover."""
        each = [1.0 + along4(signs, thrusts) for signs in SIGNS]
        roots = [root(one.at_least(_NONE)) for one in each]
        # the same for thrusts near 1, with what cancels left out: (1 + t)^(1/2) = 1 + t / 2 - t^2 / 8 + ...
        u, z, y, x = (thrusts[k] for k in range(4))
        squares = [u * u + z * z + y * y + x * x, 2.0 * (u * z + x * y), 2.0 * (u * y + x * z), 2.0 * (u * x + y * z)]
        rest = list[Slopes]()
        for one, speed in zip(each, roots, strict=True):
            twice = 1.0 + speed
            rest.append((one - 1.0) * (one - 1.0) * (0.5 / (twice * twice) - 0.125))
        near = [0.5 * thrusts[k] - 0.125 * squares[k] - along4(0.25 * SIGNS[:, k], rest) for k in range(4)]
        found = [along4(0.25 * SIGNS[:, k], roots) for k in range(4)]
        return stacked([narrower(found[k], near[k] + (1.0 if k == 0 else 0.0)) for k in range(4)])

    def motion(self, state: Slopes, asked: Slopes, air: Slopes, ratios: tuple[Slopes, Slopes]) -> Slopes:
        """Return the derivatives of velocity, attitude and rates, and of thrusts what they are beside a lag of thrusts. Shape (13,).

        The speeds s of the rotors lag behind those that are asked for, S; thrusts are their squares, so that they lag and lose (S - s)^2 over the lag.

        Args:
            state: Velocity, attitude, rates, combinations of the rotors' thrusts. Shape (13,).
            asked: Combinations that the rotors strive for. Shape (4,).
            air: Its velocity, m/s. Shape (3,).
            ratios: The nominal mass over the true one, and the true drag over the nominal one.
        """
        vehicle, frame, (light, dense) = self.vehicle, self.airframe, ratios
        velocity, attitude, rates, thrusts = state[0:3], state[3:6], state[6:9], state[9:13]
        turn, arm = turned(flown(attitude)), vehicle.arm / math.sqrt(2.0)
        speeds, speed = self.speeds(thrusts), self.hover_speed * 4.0
        every, sy, sx, sxy = (
            speed * speeds[0],
            (speed * arm) * speeds[2],
            (speed * arm) * speeds[3],
            (speed * arm * arm) * speeds[1],
        )
        sxx = (arm * arm) * every
        flow = applied(turn.T, velocity - air)
        side, down = frame.rotor_drag * dense, frame.inflow_drag * dense
        drag = stacked(
            [
                side * (rates[2] * sy - every * flow[0]),
                -(side * (rates[2] * sx + every * flow[1])),
                down * (rates[1] * sx - rates[0] * sy - every * flow[2]),
            ]
        )
        push = drag * (light / vehicle.mass)
        push = stacked([push[0], push[1], push[2] + GRAVITY * ((1.0 + thrusts[0]) * light)])
        moved = applied(turn, push)
        momentum, mixed = (frame.rotor_inertia * speed) * speeds[1], down * sxy
        slower = self.speeds(asked) - speeds
        u, z, y, x = (slower[k] for k in range(4))
        lost = [u * u + z * z + y * y + x * x, 2.0 * (u * z + x * y), 2.0 * (u * y + x * z), 2.0 * (u * x + y * z)]
        quick = (frame.rotor_inertia * speed / frame.rotor_lag) * z
        weight = vehicle.mass * GRAVITY
        torque = stacked(
            [
                (weight * arm) * thrusts[2] + (momentum + mixed) * rates[1] - down * (flow[2] * sy + sxx * rates[0]),
                (-weight * arm) * thrusts[3] - (momentum - mixed) * rates[0] + down * (flow[2] * sx - sxx * rates[1]),
                (weight * vehicle.torque_to_thrust) * thrusts[1] + quick
                - side * (flow[1] * sx - flow[0] * sy + 2.0 * (rates[2] * sxx)),
            ]
        )  # fmt: skip
        jx, jy, jz = vehicle.inertia
        gyration = stacked(
            [
                ((jz - jy) / jx) * (rates[1] * rates[2]),
                ((jx - jz) / jy) * (rates[2] * rates[0]),
                ((jy - jx) / jz) * (rates[0] * rates[1]),
            ]
        )
        faster = torque * np.array([1.0 / jx, 1.0 / jy, 1.0 / jz]) - gyration
        tilt, a, b, cosine = tilting(attitude), attitude[0], attitude[1], root(1.0 - 0.25 * (attitude[2] * attitude[2]))
        heading = rates[2] + (a * rates[1] - b * rates[0]) / (1.0 + tilt[2, 2])
        turning = stacked(
            [
                tilt[1, 1] * rates[0] - tilt[1, 0] * rates[1] + heading * b,
                tilt[0, 0] * rates[1] - tilt[0, 1] * rates[0] - heading * a,
                cosine * heading,
            ]
        )
        lag = stacked(lost) * (-1.0 / frame.rotor_lag)
        return joined([stacked([moved[0], moved[1], moved[2] - GRAVITY]), turning, faster, lag])


@dataclass(frozen=True, eq=False, slots=True)
class Law:
    """The controller.

    Attributes:
        vehicle: What it flies, whose mass it is told.
        gains: Of it.
    """

    vehicle: Vehicle
    gains: MellingerGains

    @property
    def settled(self) -> float:
        """Sum of vertical errors that a hover leaves, m s."""
        gains, weight = self.gains, self.vehicle.mass * GRAVITY
        count = self.vehicle.rotor_thrust_max / FULL_SCALE
        missing = weight / (4.0 * gains.thrust_to_pwm * count) - weight
        return missing / gains.integral[2] if gains.integral[2] else 0.0

    @property
    def count(self) -> float:
        """Share of the hover's thrust that a count of every rotor gives."""
        return self.vehicle.rotor_thrust_max / FULL_SCALE * 4.0 / (self.vehicle.mass * GRAVITY)

    @property
    def moments(self) -> Floats:
        """Limits of combinations of thrusts that are asked for, in which moments are clipped: none for all alike. Shape (4,)."""
        return np.array([np.inf, 1.0, 0.5, 0.5]) * (self.gains.moment_limit * self.count)

    @property
    def ceiling(self) -> float:
        """Greatest thrust of a rotor over that of the hover."""
        return self.vehicle.rotor_thrust_max / (0.25 * self.vehicle.mass * GRAVITY)

    def mixed(self, asked: Floats) -> Floats:
        """Return thrusts as they are mixed: moments are clipped, all are lowered alike where one is above its greatest, and none is below 0. Shape (..., 4)."""
        each = 1.0 + np.clip(asked, -self.moments, self.moments) @ SIGNS.T
        each -= np.maximum(each.max(-1, keepdims=True) - self.ceiling, 0.0)
        return asked + 0.25 * ((np.maximum(each, 0.0) - 1.0) - asked @ SIGNS.T) @ SIGNS

    def aimed(self, force: Slopes, attitude: Slopes) -> Slopes:
        """Return the combination of thrusts that lifts, and the error of attitude, (Rd'R - R'Rd) as a vector. Shape (4,).

        Args:
            force: That is asked for, less the weight and what the sum has settled at, N. Shape (3,).
            attitude: Shape (3,).
        """
        hover = self.vehicle.mass * GRAVITY + self.gains.integral[2] * self.settled
        force = stacked([force[0], force[1], force[2] + hover])
        z = force / root(along(force, force))
        level = root(z[2] * z[2] + z[1] * z[1])
        wy = stacked([0.0 * level, z[2] / level, -z[1] / level])
        wx, turn = crossed(wy, z), turned(estimated(attitude))
        ax, ay, az = turn[:, 0], turn[:, 1], turn[:, 2]
        lift = (self.gains.thrust_to_pwm * self.count) * along(force, az) - 1.0
        return stacked([lift, along(z, ay) - along(az, wy), along(wx, az) - along(ax, z), along(wy, ax) - along(ay, wx)])
