"""Controllers as common firmware has them: asked 500 times a second on board, with set-points and estimates 100 times a second.

What they share is here: the commander that turns pieces of polynomials into set-points, the laws of a controller, and the mixer from
thrust and moments to rotors. Laws work row by row on arrays whose last axis counts vehicles, so that few vehicles are flown by
compiled arithmetic and many as arrays, with the same numbers.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar, NoReturn, Protocol, runtime_checkable

import numpy as np

from flight.control.controller import Controller
from flight.model.airframe import Airframe
from flight.model.attitude import Floats
from flight.model.numbers import is_number
from verify.data import GRAVITY, BadInput

FULL_SCALE = 65535.0
"""Counts of a motor at its greatest thrust."""

# Rows of a set-point.
POSITION, VELOCITY, ACCELERATION, JERK, RATES = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12), slice(12, 15)
COSINE, SINE, HEADING = 15, 16, 17
SETPOINT = 18
# Rows of what is known of a vehicle on board: position and velocity as in a set-point, then attitude and gyroscopes.
ATTITUDE, GYRO = slice(6, 10), slice(10, 13)
KNOWN = 13


@dataclass(frozen=True, slots=True)
class Moment:
    """Inputs of the control laws on board. Vehicles along the last axis.

    Attributes:
        setpoint: What the commander asks for. Shape (SETPOINT, n).
        known: Shape (KNOWN, n).
        ceiling: Share of the rotors' greatest speed that the battery leaves. Shape (n,).
    """

    setpoint: Floats
    known: Floats
    ceiling: Floats


class Laws(Protocol):
    """A controller at work on board of some vehicles. Its memory are rows of an array, which it does not keep itself."""

    @property
    def traceable(self) -> bool:
        """True if `thrusts` is made of sums, products, quotients, roots and extremes alone, so that it can be compiled."""
        ...

    def at_first(self, setpoint: Floats) -> Floats:
        """Return the memory of vehicles that have hovered for long, so that sums of errors have settled. Shape (memory, n).

        It is the hover of the vehicle that the controller takes it for: in still air, of the mass that it is told, fully charged. What
        differs from that is new to it when the flight begins.

        Args:
            setpoint: Where they do. Shape (SETPOINT, n).
        """
        ...

    def thrusts(self, now: Moment, memory: Floats) -> tuple[Floats, Floats]:
        """Do what is done 500 times a second.

        Args:
            now: What is known.
            memory: Shape (memory, n).

        Returns:
            Each rotor's thrust in N, and the new memory. Shapes (4, n) and (memory, n).
        """
        ...


@runtime_checkable
class AimingLaws(Laws, Protocol):
    """Laws with a slower loop around the fast one."""

    def aim(self, flat: Floats | None, now: Moment, memory: Floats) -> Floats:
        """Do what is done 100 times a second; return the new memory.

        Args:
            flat: The plan now, as for `ControlLoop.command`, every other time; None in between.
            now: What is known.
            memory: Shape (memory, n).
        """
        ...


class OnBoardController(Controller):
    """A controller whose loop runs on board, faster than commands from the ground are sent."""

    setpoints: ClassVar[float] = 100.0
    orders: ClassVar[int] = 3

    def begin(self, airframe: Airframe, flat: Floats) -> NoReturn:
        """Reject to command from the ground.

        Args:
            airframe: What it would fly.
            flat: Where it would begin.

        Raises:
            BadInput: Always.
        """
        vehicles = f"{flat.shape[-1]} of '{airframe.vehicle.name}'"
        raise BadInput(f"this controller runs on board and moves rotors; it sends no commands from the ground ({vehicles}).")

    @abstractmethod
    def laws(self, airframe: Airframe) -> Laws:
        """Return its laws for one airframe.

        Args:
            airframe: What the controller takes the vehicles for.
        """


@dataclass(frozen=True, slots=True)
class ToldItsMass(OnBoardController):
    """A controller whose thrust is a force, so that it is told what it carries.

    Attributes:
        mass: kg that it is told; None for the vehicle's.

    Raises:
        BadInput: The mass is none.
    """

    mass: float | None = None

    def __post_init__(self) -> None:
        if self.mass is not None and not (is_number(self.mass) and 0.0 < self.mass < 1000.0):
            raise BadInput(f"a controller's mass is above 0 in kg, and below 1000, such as 0.029, not {self.mass!r}.")

    def laws(self, airframe: Airframe) -> Laws:
        """Return its laws for one airframe; argument as said there."""
        return self.laws_at(airframe, airframe.vehicle.mass if self.mass is None else self.mass)

    @abstractmethod
    def laws_at(self, airframe: Airframe, mass: float) -> Laws:
        """Return its laws for one airframe and the mass that they are told.

        Args:
            airframe: What the controller takes the vehicles for.
            mass: kg.
        """


def setpoint_of(flat: Floats, ahead: float) -> Floats:
    """Return what the high-level commander asks for some time after an instant of the plan.

    Position, velocity, acceleration and jerk of the polynomial, heading, and the body rates that these need without drag: as the
    firmware has it, the rate about z is the heading's times the share of the body's z axis that points up.

    Args:
        flat: x, y, z, heading and their first four derivatives. Shape (5, 4, n).
        ahead: s.

    Returns:
        Shape (SETPOINT, n).
    """
    a, b, c = ahead, ahead * ahead / 2.0, ahead**3 / 6.0
    position = flat[0] + a * flat[1] + b * flat[2] + c * flat[3] + (ahead**4 / 24.0) * flat[4]
    velocity = flat[1] + a * flat[2] + b * flat[3] + c * flat[4]
    acceleration, jerk = flat[2] + a * flat[3] + b * flat[4], flat[3] + a * flat[4]
    setpoint = np.empty((SETPOINT, flat.shape[-1]))
    setpoint[POSITION], setpoint[VELOCITY], setpoint[ACCELERATION], setpoint[JERK] = (
        part[:3] for part in (position, velocity, acceleration, jerk)
    )
    setpoint[COSINE], setpoint[SINE], setpoint[HEADING] = np.cos(position[3]), np.sin(position[3]), position[3]
    force = acceleration[:3].copy()
    force[2] += GRAVITY
    axes, thrust = axes_towards(force, setpoint[COSINE], setpoint[SINE])
    turning = turning_of(jerk[:3], axes, thrust)
    setpoint[12], setpoint[13], setpoint[14] = turning[0], turning[1], axes[2, 2] * velocity[3]
    return setpoint


def axes_towards(force: Floats, cosine: Floats, sine: Floats) -> tuple[Floats, Floats]:
    """Return the attitude that pushes along a force, at a heading, and the force's length.

    Args:
        force: Away from zero. Shape (3, n).
        cosine: Of the heading. Shape (n,).
        sine: Of the heading. Shape (n,).

    Returns:
        The body's x, y and z axes, shape (axis, component, n), and |force|, shape (n,).
    """
    axes = np.empty_like(force, shape=(3, 3, force.shape[1]))
    length = np.sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2])
    z = force / length
    # y = z x (cos, sin, 0), at length one
    across = np.sqrt(z[2] * z[2] + (z[0] * sine - z[1] * cosine) * (z[0] * sine - z[1] * cosine))
    y0, y1, y2 = -z[2] * sine / across, z[2] * cosine / across, (z[0] * sine - z[1] * cosine) / across
    axes[2] = z
    axes[1, 0], axes[1, 1], axes[1, 2] = y0, y1, y2
    axes[0, 0] = y1 * z[2] - y2 * z[1]
    axes[0, 1] = y2 * z[0] - y0 * z[2]
    axes[0, 2] = y0 * z[1] - y1 * z[0]
    return axes, length


def turning_of(jerk: Floats, axes: Floats, thrust: Floats) -> Floats:
    """Return the rates about the body's x and y, rad/s, that turn a thrust as a jerk asks. Shape (2, n).

    Args:
        jerk: m/s^3. Shape (3, n).
        axes: As from `axes_towards`.
        thrust: Mass-normalised, m/s^2. Shape (n,).
    """
    turning = np.empty_like(jerk, shape=(2, jerk.shape[1]))
    along = along_axis(axes[2], jerk)
    bent = jerk - along * axes[2]
    turning[0] = -along_axis(axes[1], bent) / thrust
    turning[1] = along_axis(axes[0], bent) / thrust
    return turning


def along_axis(axis: Floats, vector: Floats) -> Floats:
    """Return the scalar product. Shapes (3, n) to (n,)."""
    return axis[0] * vector[0] + axis[1] * vector[1] + axis[2] * vector[2]


def body_axes(q: Floats) -> Floats:
    """Return the body's x, y and z axes of unit quaternions, row by row. Shapes (4, n) to (axis, component, n)."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    axes = np.empty_like(q, shape=(3, 3, q.shape[1]))
    axes[0, 0] = 1.0 - 2.0 * (y * y + z * z)
    axes[0, 1] = 2.0 * (x * y + w * z)
    axes[0, 2] = 2.0 * (x * z - w * y)
    axes[1, 0] = 2.0 * (x * y - w * z)
    axes[1, 1] = 1.0 - 2.0 * (x * x + z * z)
    axes[1, 2] = 2.0 * (y * z + w * x)
    axes[2, 0] = 2.0 * (x * z + w * y)
    axes[2, 1] = 2.0 * (y * z - w * x)
    axes[2, 2] = 1.0 - 2.0 * (x * x + y * y)
    return axes


def attitude_error(wanted: Floats, actual: Floats) -> Floats:
    """Return (Rd'R - R'Rd) as a vector: twice the sine of the angle between, along the axis of the turn. Shape (3, n).

    Args:
        wanted: As from `axes_towards`.
        actual: As from `body_axes`.
    """
    error = np.empty_like(wanted, shape=(3, wanted.shape[2]))
    error[0] = along_axis(wanted[2], actual[1]) - along_axis(actual[2], wanted[1])
    error[1] = along_axis(wanted[0], actual[2]) - along_axis(actual[0], wanted[2])
    error[2] = along_axis(wanted[1], actual[0]) - along_axis(actual[1], wanted[0])
    return error


def limited(value: Floats, limit: Floats | float) -> Floats:
    """Return a value kept within plus and minus a limit."""
    return np.maximum(np.minimum(value, limit), -limit)


def mixed(share: Floats, pull: Floats, ceiling: Floats) -> Floats:
    """Return the rotors' thrusts as the firmware mixes them. Shape (4, n).

    Where one is above its greatest all are lowered alike, so that moments are kept before thrust; none pulls down.

    Args:
        share: What each gives of the thrust. Shape (n,).
        pull: What moments about x, y (against the rotors in front) and z add to or take from each. Shape (3, n).
        ceiling: Greatest thrust of one. Shape (n,).
    """
    thrusts = np.empty_like(pull, shape=(4, pull.shape[1]))
    thrusts[0] = share + pull[0] + pull[1] + pull[2]
    thrusts[1] = share - pull[0] + pull[1] - pull[2]
    thrusts[2] = share - pull[0] - pull[1] + pull[2]
    thrusts[3] = share + pull[0] - pull[1] - pull[2]
    greatest = np.maximum(np.maximum(thrusts[0], thrusts[1]), np.maximum(thrusts[2], thrusts[3]))
    return np.maximum(thrusts - np.maximum(greatest - ceiling, 0.0), 0.0)


def settled_sum(missing: float, gain: float, limit: float = math.inf) -> float:
    """Return the sum of errors that gives what a hover needs beyond the other terms.

    Args:
        missing: What they lack, in the sum's units times those of its gain.
        gain: Of the sum; where it is 0 nothing settles.
        limit: Most of the sum.
    """
    return min(max(missing / gain, -limit), limit) if gain else 0.0


def column(values: tuple[float, float, float]) -> Floats:
    """Return three gains as a column. Shape (3, 1)."""
    return np.array(values, dtype=np.float64)[:, None]
