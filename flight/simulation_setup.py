"""A simulation before it happens, and its state at one entry of the log: what every loop that flies has in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, SupportsIndex

import numpy as np

from flight.conditions import CALM, Conditions
from flight.model.airframe import Airframe
from flight.model.attitude import Floats
from flight.model.timing import STEP
from verify.data import BadInput, Vehicle


def is_whole(number: object) -> bool:
    """Return whether something counts: a whole number, of whatever kind, and no truth value."""
    return isinstance(number, SupportsIndex) and not isinstance(number, bool)


def require_seed(seed: int) -> None:
    """Reject what is no seed.

    Args:
        seed: As a caller gave it.

    Raises:
        BadInput: It is no whole number, or below 0.
    """
    if not is_whole(seed) or seed < 0:
        raise BadInput(f"a seed is a whole number from 0 on, not {seed!r}.")


def not_simulated(robot: str, vehicle: Vehicle, when: str) -> BadInput:
    """Return what is said where a simulation comes to numbers that are none.

    Args:
        robot: Whose place is none.
        vehicle: What it flies.
        when: In which flight, or at what time.
    """
    return BadInput(
        f"{robot} is nowhere any more {when}: what its profile '{vehicle.name}' says, or what its controller asks for, cannot be "
        f"simulated in steps of {1000 * STEP:g} ms."
    )


class Guidance(Protocol):
    """Source of the robots' set-points: a plan that was sampled (`Reference`), or one that is made while they fly."""

    @property
    def robots(self) -> tuple[str, ...]:
        """Names."""
        ...

    @property
    def start(self) -> Floats:
        """Initial hovers: x, y, z in m and heading in rad. Shape (4, robots)."""
        ...

    @property
    def ticks(self) -> int:
        """Control instants that are flown at most."""
        ...

    def wanted(self, tick: int) -> Floats:
        """Return what they should do from a control instant on, asked once for each in order.

        Args:
            tick: Its index.

        Returns:
            x, y, z, heading and four derivatives, in m, rad and s. Shape (5, 4, robots).
        """
        ...

    def planned(self, step: int) -> Floats | None:
        """Return where they should be at a step of the dynamics, m; None where nobody planned that. Shape (3, robots)."""
        ...


def farthest(guidance: Guidance, step: int, flown: Floats) -> Floats:
    """Return the square of each vehicle's greatest distance from where it should be, m^2; 0 where nobody planned that. Shape (n,).

    Args:
        guidance: The plan, of some robots.
        step: Of the dynamics, before those that were flown.
        flown: Where all runs' robots are after each step, m. Shape (steps, 3, n).
    """
    places = [guidance.planned(step + k) for k in range(1, len(flown) + 1)]
    known = [k for k, place in enumerate(places) if place is not None]
    if not known:
        return np.zeros(flown.shape[-1])
    at = np.array([places[k] for k in known])[:, :, None]
    away = (flown[known].reshape(*at.shape[:2], -1, at.shape[-1]) - at).reshape(len(known), 3, -1)
    away *= away
    return np.max(away[:, 0] + away[:, 1] + away[:, 2], axis=0)


@dataclass(frozen=True, slots=True)
class Setup:
    """Everything about a simulation but its seeds.

    Attributes:
        airframes: What flies, of each robot of the guidance; one for all where they are alike.
        guidance: What they should fly.
        conditions: Wind, sensors, model and controller; of their airframe those above were made.
    """

    airframes: tuple[Airframe, ...]
    guidance: Guidance
    conditions: Conditions = CALM


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The state of all vehicles at one entry of the log. Vehicles along the last axis: run by run, robot by robot.

    Attributes:
        step: Index of the dynamics' step.
        position: m. Shape (3, n).
        velocity: m/s. Shape (3, n).
        attitude: Quaternion w x y z. Shape (4, n).
        rates: Body rates, rad/s. Shape (3, n).
        thrust: Collective, N. Shape (n,).
        rotors: N, or None where the model has none. Shape (4, n).
        measured: m, what motion capture saw; NaN where it lost the robot; None without one. Shape (3, n).
        estimated: m, what the controller took for the position at the last command. Shape (3, n).
        charge: Battery voltage over its voltage in hover at full charge. Shape (n,).
        peak: Largest distance from what was planned at any step so far, m. Shape (n,).
    """

    step: int
    position: Floats
    velocity: Floats
    attitude: Floats
    rates: Floats
    thrust: Floats
    rotors: Floats | None
    measured: Floats | None
    estimated: Floats
    charge: Floats
    peak: Floats
