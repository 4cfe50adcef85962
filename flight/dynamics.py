"""Two models of a quadcopter, for any number of vehicles at once.

The papers' model (eqs. (1) to (3), with our thrust sign): r'' = -g e3 + (f/m) R e3 and eps' = Gamma(eps) omega, thrust
and body rates being the inputs. The full model adds the rotational dynamics (twelve states: r, r', attitude, body rates) and
the rotors: their lag, their limits, their drag in the air, their inertia, and a battery that sags.

States are component first, vehicles along the last axis. Rotors stand in an X, counted from front left
clockwise: (+,+), (+,-), (-,-), (-,+); the first and third push the body counter-clockwise.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flight.airframe import Airframe
from flight.attitude import Floats, cross, dot, euler_rate, matrix, norm, quaternion_rate, to_body, to_world, unit
from verify.data import GRAVITY

# Rows of the full model's state.
POSITION, VELOCITY, ATTITUDE, RATES, ROTORS = slice(0, 3), slice(3, 6), slice(6, 10), slice(10, 13), slice(13, 17)
STATES = 17

# Rows of the papers' model's state: r, r', (roll, pitch, yaw).
ANGLES = slice(6, 9)
PAPER_STATES = 9

SPIN = np.array([1.0, -1.0, 1.0, -1.0])
"""Sign of the yaw torque that each rotor gives the body."""


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
    """Return the papers' state after `dt` seconds of constant inputs (Runge-Kutta of order 4)."""
    return _runge_kutta(lambda s: paper_derivative(s, thrust, rates, mass), state, dt)


def hover_state(airframe: Airframe, position: Floats, yaw: Floats) -> Floats:
    """Return the full model's state in hover. Shapes (3, n) and (n,) to (17, n)."""
    state = np.zeros((STATES, position.shape[1]))
    state[POSITION] = position
    state[ATTITUDE] = np.stack([np.cos(yaw / 2), np.zeros_like(yaw), np.zeros_like(yaw), np.sin(yaw / 2)])
    state[ROTORS] = airframe.hover_speed
    return state


class FullModel:
    """The full model of one airframe: forces, torques and rotors, for any number of vehicles at once."""

    def __init__(self, airframe: Airframe) -> None:
        vehicle = airframe.vehicle
        self.airframe = airframe
        self._offset = vehicle.arm / np.sqrt(2.0)  # of each rotor along x and along y
        self._inertia = np.array(vehicle.inertia)[:, None]
        jx, jy, jz = vehicle.inertia
        self._gyration = np.array([jz - jy, jx - jz, jy - jx])[:, None]
        self._drag = np.array([airframe.rotor_drag, airframe.rotor_drag, airframe.inflow_drag])[:, None]
        self._body_drag = np.array(airframe.body_drag)[:, None] if any(airframe.body_drag) else None
        # Thrust to torque about x and y, and to yaw.
        self._arms = np.array([self._offset, -self._offset, vehicle.torque_to_thrust])[:, None]
        coefficient = airframe.thrust_coefficient
        self.slowest = float(np.sqrt(vehicle.rotor_thrust_min / coefficient))
        self.fastest = float(np.sqrt(vehicle.rotor_thrust_max / coefficient))

    def derivative(self, state: Floats, command: Floats, wind: Floats | float = 0.0) -> Floats:
        """Return the time derivative of the full state.

        Args:
            state: Shape (17, n).
            command: Rotor speeds that the motors strive for, rad/s. Shape (4, n).
            wind: Velocity of the air, m/s, world frame. Shape (3, n), or 0 for still air.
        """
        frame, mass = self.airframe, self.airframe.vehicle.mass
        turn, rates, speed = matrix(state[ATTITUDE]), state[RATES], state[ROTORS]
        acceleration = (command - speed) / frame.rotor_lag
        air = to_body(turn, state[VELOCITY] - wind)

        # Sums over the four rotors of speed and of squared speed, weighted by 1, y, x and xy signs.
        speeds, lifts = _rotor_sums(speed), _rotor_sums(speed * speed)
        total, by_y, by_x, by_xy = speeds
        sx, sy = self._offset * by_x, self._offset * by_y
        sxx, sxy = self._offset**2 * total, self._offset**2 * by_xy

        force = np.empty_like(air)
        force[0] = air[0] * total - rates[2] * sy
        force[1] = air[1] * total + rates[2] * sx
        force[2] = air[2] * total + rates[0] * sy - rates[1] * sx
        force *= -self._drag
        force[2] += frame.thrust_coefficient * lifts[0]
        if self._body_drag is not None:
            force -= self._body_drag * norm(air) * air

        torque = (frame.thrust_coefficient * self._arms) * lifts[1:]
        along, across = frame.inflow_drag, frame.rotor_drag
        torque[0] -= along * (air[2] * sy + rates[0] * sxx - rates[1] * sxy)
        torque[1] += along * (air[2] * sx + rates[0] * sxy - rates[1] * sxx)
        torque[2] -= across * (air[1] * sx - air[0] * sy + 2.0 * (rates[2] * sxx))
        if frame.rotor_inertia:
            # A rotor that pushes the body counter-clockwise spins clockwise itself: its momentum is -spin J Omega e3.
            momentum = frame.rotor_inertia * by_xy
            torque[0] += momentum * rates[1]
            torque[1] -= momentum * rates[0]
            torque[2] += frame.rotor_inertia * _rotor_sums(acceleration)[3]

        change = np.empty_like(state)
        change[POSITION] = state[VELOCITY]
        change[VELOCITY] = to_world(turn, force) / mass
        change[5] -= GRAVITY
        change[ATTITUDE] = quaternion_rate(state[ATTITUDE], rates)
        twist = np.stack([rates[1] * rates[2], rates[2] * rates[0], rates[0] * rates[1]])
        change[RATES] = (torque - self._gyration * twist) / self._inertia
        change[ROTORS] = acceleration
        return change

    def step(self, state: Floats, command: Floats, wind: Floats | float, dt: float) -> Floats:
        """Return the state after `dt` seconds of constant commands and wind (Runge-Kutta of order 4)."""
        after = _runge_kutta(lambda s: self.derivative(s, command, wind), state, dt)
        after[ATTITUDE] = unit(after[ATTITUDE])
        return after

    def commands(self, thrust: Floats, torque: Floats) -> Floats:
        """Return the four rotor thrusts in N that together give a thrust and a torque, within the rotors' limits.

        Where a rotor is at its limit, yaw torque is given up first: it moves the vehicle least.

        Args:
            thrust: N. Shape (n,).
            torque: N m about the body's axes. Shape (3, n).
        """
        vehicle = self.airframe.vehicle
        share = 0.25 * thrust
        pull = torque / (4.0 * self._arms)
        wanted = np.empty((4, *thrust.shape))
        # by_y: + - - +; by_x: + + - -; spin: + - + -
        wanted[0] = share + pull[0] + pull[1]
        wanted[1] = share - pull[0] + pull[1]
        wanted[2] = share - pull[0] - pull[1]
        wanted[3] = share + pull[0] - pull[1]
        low, high = vehicle.rotor_thrust_min, vehicle.rotor_thrust_max
        room = np.minimum(np.min(wanted, axis=0) - low, high - np.max(wanted, axis=0))
        room = np.maximum(room, 0.0)
        yaw = np.clip(pull[2], -room, room)
        wanted[0::2] += yaw
        wanted[1::2] -= yaw
        return np.clip(wanted, low, high)

    def energy(self, state: Floats) -> Floats:
        """Return kinetic (of the body) plus potential energy, J, above z = 0. Shape (17, n) to (n,)."""
        vehicle = self.airframe.vehicle
        spin = state[RATES] * self._inertia
        moving = 0.5 * vehicle.mass * dot(state[VELOCITY], state[VELOCITY]) + 0.5 * dot(state[RATES], spin)
        return moving + vehicle.weight * state[2]

    def angular_momentum(self, state: Floats) -> Floats:
        """Return the body's angular momentum in the world frame, kg m^2/s. Shape (17, n) to (3, n)."""
        return to_world(matrix(state[ATTITUDE]), state[RATES] * self._inertia)


def rotor_thrusts(airframe: Airframe, state: Floats) -> Floats:
    """Return each rotor's thrust in N. Shape (17, n) to (4, n)."""
    speed = state[ROTORS]
    return airframe.thrust_coefficient * (speed * speed)


def coriolis(inertia: Floats, rates: Floats) -> Floats:
    """Return omega x J omega, the torque that keeps a turning body turning. Shapes (3, 1) and (3, n) to (3, n)."""
    return cross(rates, inertia * rates)


def _rotor_sums(values: Floats) -> Floats:
    """Return sums over the rotors with weights 1, sign of y, sign of x, and their product. Shape (4, n)."""
    both, apart = values[:2] + values[2:], values[:2] - values[2:]
    sums = np.empty_like(values)
    sums[0] = both[0] + both[1]
    sums[1] = apart[0] - apart[1]
    sums[2] = apart[0] + apart[1]
    sums[3] = both[0] - both[1]
    return sums


def _runge_kutta(derivative: Callable[[Floats], Floats], state: Floats, dt: float) -> Floats:
    first = derivative(state)
    second = derivative(state + (0.5 * dt) * first)
    third = derivative(state + (0.5 * dt) * second)
    fourth = derivative(state + dt * third)
    second += third
    second *= 2.0
    second += first
    second += fourth
    second *= dt / 6.0
    second += state
    return second
