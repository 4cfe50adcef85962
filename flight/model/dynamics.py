"""The dynamics of a quadcopter with its rotors, for any number of vehicles at once.

Twelve states of the body (r, r', attitude, body rates), and the rotors: their lag, their limits, their drag in the air, their
inertia. `full.py` puts autopilot and battery to it; `paper.py` is the papers' shorter model.

States are component first, vehicles along the last axis. Rotors stand in an X, counted from front left
clockwise: (+,+), (+,-), (-,-), (-,+); the first and third push the body counter-clockwise.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from flight.model.airframe import Airframe
from flight.model.attitude import Floats, cross, dot, matrix, norm, quaternion_rate, to_body, to_world, unit
from verify.data import GRAVITY

# Rows of the state.
POSITION, VELOCITY, ATTITUDE, RATES, ROTORS = slice(0, 3), slice(3, 6), slice(6, 10), slice(10, 13), slice(13, 17)
STATES = 17


def hover_state(airframe: Airframe, position: Floats, yaw: Floats) -> Floats:
    """Return the state in hover. Shapes (3, n) and (n,) to (17, n).

    Args:
        airframe: What hovers.
        position: m. Shape (3, n).
        yaw: Heading in rad. Shape (n,).

    Returns:
        Shape (17, n).
    """
    state = np.zeros((STATES, position.shape[1]))
    state[POSITION] = position
    state[ATTITUDE] = np.stack([np.cos(yaw / 2), np.zeros_like(yaw), np.zeros_like(yaw), np.sin(yaw / 2)])
    state[ROTORS] = airframe.hover_speed
    return state


class QuadcopterDynamics:
    """The dynamics of one airframe: forces, torques and rotors, for any number of vehicles at once.

    Between two steps commands and wind are constant, so the rotors' speeds are known in closed form and the body is
    integrated by Runge-Kutta of order 4. The rotors' drag acts at their hubs; the part of it that the hubs'
    distance from the centre makes (torques of a few percent of the damping) is held over a step.
    """

    def __init__(self, airframe: Airframe, mass: Floats | None = None) -> None:
        """Take what the vehicles are.

        Args:
            airframe: Of all of them.
            mass: What each weighs, kg, where that is not the airframe's. Shape (n,).
        """
        vehicle = airframe.vehicle
        self.airframe, self._mass = airframe, vehicle.mass if mass is None else mass
        self._offset = vehicle.arm / math.sqrt(2.0)  # of each rotor along x and along y
        self._inertia = np.array(vehicle.inertia)[:, None]
        jx, jy, jz = vehicle.inertia
        self._gyration = np.array([(jz - jy) / jx, (jx - jz) / jy, (jy - jx) / jz])[:, None]
        # Thrust to torque about x and y, and to yaw.
        self._arms = np.array([self._offset, -self._offset, vehicle.torque_to_thrust])[:, None]
        self._shares = 0.25 / self._arms
        self._to_change = airframe.thrust_coefficient * self._arms / self._inertia
        coefficient = airframe.thrust_coefficient
        self.slowest = float(np.sqrt(vehicle.rotor_thrust_min / coefficient))
        self.fastest = float(np.sqrt(vehicle.rotor_thrust_max / coefficient))

    def step(self, state: Floats, command: Floats, wind: Floats | float, dt: float) -> Floats:
        """Return the state after `dt` seconds of constant commands and wind.

        Args:
            state: Shape (17, n).
            command: Rotor speeds that the motors strive for, rad/s. Shape (4, n).
            wind: Velocity of the air, m/s, world frame. Shape (3, n), or 0 for still air.
            dt: s.
        """
        frame, mass = self.airframe, self._mass
        still = state[ROTORS] - command
        half = math.exp(-0.5 * dt / frame.rotor_lag)
        speeds = np.empty_like(state, shape=(4, 3, state.shape[1]))  # at the start, the middle and the end of the step
        speeds[:, 0] = state[ROTORS]
        speeds[:, 1] = command + half * still
        speeds[:, 2] = command + (half * half) * still
        sums, lifts = _rotor_sums(speeds), _rotor_sums(speeds * speeds)
        middle = state.copy()
        middle[RATES] += (0.5 * dt) * (self._to_change * lifts[1:, 0])
        middle[ATTITUDE] += (0.5 * dt) * quaternion_rate(state[ATTITUDE], state[RATES])
        hub_force, hub_change = self._at_hubs(middle, sums[:, 1], -(half / frame.rotor_lag) * still, wind)
        lift = (frame.thrust_coefficient / mass) * lifts[0]
        across = (frame.rotor_drag / mass) * sums[0]
        along = ((frame.inflow_drag - frame.rotor_drag) / mass) * sums[0]
        spin = self._to_change[:, None] * lifts[1:] + hub_change[:, None]
        side, front = (drag / mass for drag in frame.body_drag)

        def derivative(body: Floats, when: int) -> Floats:
            q, rates = body[ATTITUDE], body[RATES]
            change = np.empty_like(body)
            up = change[POSITION]  # borrowed until the end: the body's z axis
            np.multiply(q[1], q[3], out=up[0])
            up[0] += q[0] * q[2]
            np.multiply(q[2], q[3], out=up[1])
            up[1] -= q[0] * q[1]
            np.subtract(0.5, q[1] * q[1], out=up[2])
            up[2] -= q[2] * q[2]
            up *= 2.0
            air = body[VELOCITY] - wind
            axial = dot(up, air)
            pull = along[when] * axial
            linear = across[when]
            if any(frame.body_drag):
                speed = norm(air)
                linear = linear + side * speed
                pull = pull + (front - side) * speed * axial
            acceleration = change[VELOCITY]
            np.multiply(up, lift[when] - pull, out=acceleration)
            air *= linear
            acceleration -= air
            acceleration += hub_force
            change[POSITION] = body[VELOCITY]
            products = q[:, None] * (0.5 * rates)
            turn = change[ATTITUDE]
            np.add(products[1, 0], products[2, 1], out=turn[0])
            turn[0] += products[3, 2]
            np.negative(turn[0], out=turn[0])
            np.subtract(products[2, 2], products[3, 1], out=turn[1])
            np.subtract(products[3, 0], products[1, 2], out=turn[2])
            np.subtract(products[1, 1], products[2, 0], out=turn[3])
            turn[1:] += products[0]
            twist = change[RATES]
            np.multiply(rates[1], rates[2], out=twist[0])
            np.multiply(rates[2], rates[0], out=twist[1])
            np.multiply(rates[0], rates[1], out=twist[2])
            twist *= self._gyration
            np.subtract(spin[:, when], twist, out=twist)
            return change

        after = np.empty_like(state)
        runge_kutta(derivative, state[:13], dt, after[:13])
        after[ATTITUDE] = unit(after[ATTITUDE])
        after[ROTORS] = speeds[:, 2]
        return after

    def _at_hubs(self, state: Floats, sums: Floats, speeding: Floats, wind: Floats | float) -> tuple[Floats, Floats]:
        """Return what drag at the hubs and the rotors' own momentum add, and gravity.

        Args:
            state: At the start of the step.
            sums: Sums over the rotors of their speeds in its middle: all, by sign of y, of x, of both.
            speeding: Their rates of change then, rad/s^2. Shape (4, n).
            wind: As in `step`.

        Returns:
            Acceleration in the world frame, m/s^2, and angular acceleration in the body's, rad/s^2. Shapes (3, n).
        """
        frame, rates = self.airframe, state[RATES]
        turn = matrix(state[ATTITUDE])
        air = to_body(turn, state[VELOCITY] - wind)
        total, sy, sx, sxy = sums[0], self._offset * sums[1], self._offset * sums[2], self._offset**2 * sums[3]
        sxx = self._offset**2 * total
        across, along = frame.rotor_drag, frame.inflow_drag
        force, torque = np.empty_like(air), np.empty_like(air)
        np.multiply(across * rates[2], sy, out=force[0])
        np.multiply(-across * rates[2], sx, out=force[1])
        np.multiply(along, rates[1] * sx - rates[0] * sy, out=force[2])
        momentum = frame.rotor_inertia * sums[3]  # a rotor that pushes the body one way spins the other way itself
        mixed, turned = along * sxy, along * sxx
        np.subtract((momentum + mixed) * rates[1], along * air[2] * sy + turned * rates[0], out=torque[0])
        np.subtract(along * air[2] * sx - turned * rates[1], (momentum - mixed) * rates[0], out=torque[1])
        speeding_up = (speeding[0] - speeding[1]) + (speeding[2] - speeding[3])
        dragged = air[1] * sx - air[0] * sy + 2.0 * (rates[2] * sxx)
        np.subtract(frame.rotor_inertia * speeding_up, across * dragged, out=torque[2])
        acceleration = to_world(turn, force) / self._mass
        acceleration[2] -= GRAVITY
        return acceleration, torque / self._inertia

    def commands(self, thrust: Floats, torque: Floats) -> Floats:
        """Return the four rotor thrusts in N that together give a thrust and a torque, within the rotors' limits.

        Where a rotor is at its limit, yaw torque is given up first: it moves the vehicle least.

        Args:
            thrust: N. Shape (n,).
            torque: N m about the body's axes. Shape (3, n).
        """
        vehicle = self.airframe.vehicle
        pull = torque * self._shares
        share = 0.25 * thrust
        lifted, lowered = share + pull[0], share - pull[0]
        wanted = np.empty_like(thrust, shape=(4, *thrust.shape))
        # by_y: + - - +; by_x: + + - -; spin: + - + -
        np.add(lifted, pull[1], out=wanted[0])
        np.add(lowered, pull[1], out=wanted[1])
        np.subtract(lowered, pull[1], out=wanted[2])
        np.subtract(lifted, pull[1], out=wanted[3])
        low, high = vehicle.rotor_thrust_min, vehicle.rotor_thrust_max
        least = np.minimum(np.minimum(wanted[0], wanted[1]), np.minimum(wanted[2], wanted[3]))
        most = 2.0 * share - least  # without yaw, opposite rotors are even about their share
        room = np.maximum(np.minimum(least - low, high - most), 0.0)
        yaw = np.maximum(np.minimum(pull[2], room), -room)
        wanted[0::2] += yaw
        wanted[1::2] -= yaw
        return np.minimum(np.maximum(wanted, low), high)


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


def runge_kutta(derivative: Callable[[Floats, int], Floats], state: Floats, dt: float, out: Floats) -> None:
    """Write the state after `dt` into `out`; `derivative` is told the state and 0, 1 or 2: start, middle, end.

    Args:
        derivative: Told a state and 0, 1 or 2: start, middle, end of the step.
        state: Shape (states, n).
        dt: s.
        out: Written to; of the shape of `state`.
    """
    first = derivative(state, 0)
    second = derivative(state + (0.5 * dt) * first, 1)
    third = derivative(state + (0.5 * dt) * second, 1)
    fourth = derivative(state + dt * third, 2)
    second += third
    second *= 2.0
    second += first
    second += fourth
    second *= dt / 6.0
    np.add(state, second, out=out)
