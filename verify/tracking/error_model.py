"""The model of the tracking error: a robot, its disturbances and its plan, and bounds on the states of its loops."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.intervals import Interval
from verify.data.airframe import AirframeTable
from verify.data.disturbance import Disturbance, Unrest
from verify.data.vehicle import GRAVITY, Vehicle
from verify.tracking.flatness import FedForward, Jet, fed_forward
from verify.tracking.given import GivenSetpoints, given_setpoints
from verify.tracking.loops import LoopChoice, drag_of
from verify.tracking.plan_samples import PlanSamples
from verify.tracking.sampled_loop import TICK

NEAR = 0.05
"""m, most of an error that the geometric controller sums."""
H = 0.002
"""s of a step on board."""
ROUNDING = 1e-7
"""m/s^2 and rad/s: what floats leave open of the plan's derivatives at the commands."""

Inputs = dict[tuple[str, str, str], Floats]
"""(loop, input, cause) to a bound at each command; loops are `lateral`, `vertical` and `heading`."""


class NotProved(Exception):  # a verdict
    """A condition of the proof that is not met; the message says which."""


@dataclass(frozen=True, eq=False, slots=True)
class Cell:
    """A part of what the thrust may be, and what follows for torques.

    Attributes:
        thrust: Acceleration over commanded acceleration: least and most.
        torque: Angular acceleration over the commanded one: least and most.
        choice: Middles.
    """

    thrust: tuple[float, float]
    torque: tuple[float, float]
    choice: LoopChoice

    @property
    def spread(self) -> tuple[float, float]:
        """Greatest distances of thrust and torque from their middles."""
        pairs = ((self.thrust, self.choice.thrust), (self.torque, self.choice.torque))
        thrust, torque = (max(high - middle, middle - low) * (1.0 + 1e-12) for (low, high), middle in pairs)
        return thrust, torque


@dataclass(frozen=True, eq=False, slots=True)
class Bounds:
    """Bounds of all states at each command's steps. Each is shape (ticks,).

    Attributes:
        lateral: By output of the lateral loop.
        vertical: By output of the vertical loop.
        heading: By output of the loop of the heading.
    """

    lateral: Mapping[str, Floats]
    vertical: Mapping[str, Floats]
    heading: Mapping[str, Floats]


@dataclass(frozen=True, eq=False)
class ErrorModel:
    """One robot under disturbances.

    Attributes:
        vehicle: What flies.
        airframe: Its lag, drag and gains.
        disturbance: What may disturb it.
        plan: Its path as it is sampled.
        offset: m from where the path begins to the start that is stated.
    """

    vehicle: Vehicle
    airframe: AirframeTable
    disturbance: Disturbance
    plan: PlanSamples
    offset: float

    @property
    def drags(self) -> tuple[float, float]:
        """Damping that the controller counts on, 1/s."""
        return drag_of(self.vehicle, self.airframe)

    @property
    def rest(self) -> Unrest:
        """Bounds on how far from rest it may begin."""
        return self.disturbance.rest or Unrest()

    @property
    def unbalanced(self) -> tuple[float, float]:
        """Angular acceleration that rotors may give at the start, about x and y together and about z, rad/s^2."""
        vehicle, share = self.vehicle, self.rest.rotors * self.vehicle.mass * GRAVITY * (1.0 + 1e-9)
        jx, jy, jz = vehicle.inertia
        return share * vehicle.arm / np.sqrt(2.0) / min(jx, jy), share * vehicle.torque_to_thrust / jz

    @cached_property
    def given(self) -> GivenSetpoints:
        """Bounds on what set-points are off by."""
        return given_setpoints(self.plan, self.disturbance.setpoints, self.drags)

    def force(self, which: str = "at") -> tuple[Floats, Floats, Floats]:
        """Return the plan's force, with drag and gravity, and two derivatives, at the commands or between. Shape (ticks, 3) each.

        Args:
            which: `at` or `middle`.
        """
        flat: Floats = getattr(self.plan, which)
        across, along = self.drags
        damping = np.array([across, across, along])
        force = flat[:, 2] + damping * flat[:, 1]
        force[:, 2] += GRAVITY
        return force, flat[:, 3] + damping * flat[:, 2], flat[:, 4] + damping * flat[:, 3]

    def stepped(self, order: int, *, up: bool = False) -> Floats:
        """Return bounds of what a derivative of the plan's force, or its vertical part, jumps by between commands. Shape (ticks, 1)."""
        jumps = self.plan.rises if up else self.plan.jumps
        return (jumps[:, order + 2] + max(self.drags) * jumps[:, order + 1])[:, None]

    def reach(self, order: int) -> tuple[Floats, Floats]:
        """Return bounds of a derivative of the plan's force between commands, from gravity; across and along. Shape (ticks,) each."""
        across, along = self.drags
        plan = self.plan
        return (
            plan.across[:, order + 2] + across * plan.across[:, order + 1],
            plan.along[:, order + 2] + along * plan.along[:, order + 1],
        )


@dataclass(frozen=True, eq=False, slots=True)
class Fed:
    """Feed-forward for all feedback within bounds and those of the commands beside.

    Attributes:
        here: At the commands.
        alone: With the plan's force over the cell's thrust, to which feedback tends.
        given: As `alone`, with derivatives as set-points may give them.
    """

    here: FedForward
    alone: FedForward
    given: FedForward

    def moved(self, of: Callable[[FedForward], Jet], bounds: Bounds) -> Floats:
        """Bound how far a number is from what the plan alone makes of it.

        Args:
            of: Which.
            bounds: Of the feedback.
        """
        side, up = bounds.lateral["aim"], bounds.vertical["aim"]
        return along_slopes(of(self.here).slope, side, up) + self.strayed(of) + ROUNDING

    def strayed(self, of: Callable[[FedForward], Jet]) -> Floats:
        """Bound how far set-points move a number from what the plan alone makes of it.

        Args:
            of: Which.
        """
        return size_of(of(self.given).value - of(self.alone).value)


def feeds_alone(model: ErrorModel, share: float) -> tuple[FedForward, FedForward]:
    """Return what is fed forward for the plan's force over the share at the commands: the plan's, and as set-points may give it.

    Args:
        model: The robot.
        share: Acceleration over the acceleration that is commanded.
    """
    given, none = model.given, np.zeros((3, len(model.plan), 3))
    force, jerk, snap = model.force()
    wide = given.spread / np.array([share, 1.0, 1.0])[:, None, None]
    return (
        fed_forward(force / share, jerk, snap, none, sloped=False),
        fed_forward(force / share, given.jerk, given.snap, wide, sloped=False),
    )


def fed_of(model: ErrorModel, bounds: Bounds, alone: tuple[FedForward, FedForward], share: float) -> Fed:
    """Return what is fed forward.

    Args:
        model: The robot.
        bounds: Of all states.
        alone: As `feeds_alone` returns it.
        share: Acceleration over the acceleration that is commanded.

    Raises:
        NotProved: The commanded force may turn down.
    """
    reach = np.stack([bounds.lateral["aim"], bounds.lateral["aim"], bounds.vertical["aim"]], axis=1)
    force, given = model.force()[0], model.given
    side, up = model.reach(1)
    drift = abs(1.0 - 1.0 / share) * (TICK * np.stack([side, side, up], axis=1) + model.stepped(0))
    beside = reach.copy()
    beside[1:] = np.maximum(beside[1:], reach[:-1] + drift[:-1])
    if not np.all(beside < 0.4 * force[:, 2:] / share):
        raise NotProved("the commanded force may fall to the least thrust")
    with np.errstate(invalid="ignore"):  # NaN: nothing is known, and no condition is met
        boxes = np.stack([beside + given.spread[0] / share, given.spread[1], given.spread[2]])
        return Fed(fed_forward(force / share, given.jerk, given.snap, boxes), *alone)


class Before:
    """Intervals of the command before, those of a hover before the first."""

    def __call__(self, values: Interval) -> Interval:
        """Return the values one command before."""
        return Interval(shifted(values.low), shifted(values.high))


def shifted(values: Floats, first: float = 0.0) -> Floats:
    """Return the values of the commands before.

    Args:
        values: At the commands.
        first: Before the first of them.
    """
    return np.concatenate([[first], values[:-1]])


def size_of(values: Interval) -> Floats:
    """Return upper bounds of magnitudes."""
    return np.maximum(np.abs(values.low), np.abs(values.high))


def most_of(jet: Jet) -> Floats:
    """Return an upper bound of a number's magnitude."""
    return size_of(jet.value)


def along_slopes(slope: tuple[Interval, ...], side: Floats, up: Floats) -> Floats:
    """Bound a change by its slopes.

    Args:
        slope: By the components of the feedback.
        side: Of the feedback, horizontally, m/s^2.
        up: Of it, vertically.
    """
    return np.hypot(size_of(slope[0]), size_of(slope[1])) * side + size_of(slope[2]) * up
