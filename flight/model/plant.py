"""Protocol of an airframe model: a value that is chosen by name, and the vehicles that it lets fly.

A new model is a module with a subclass of `AirframeModel` and one of `Plant`, and one line in `AIRFRAME_MODELS`; another package
names its own in the group `ltlplan.airframe_models` of its entry points (docs/extending.md).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from flight.model.airframe import Airframe
from flight.model.attitude import Floats, matrix
from verify.data.names.registry import Registry


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion of vehicles: the true one, or a controller's estimate. Vehicles along the last axis.

    Attributes:
        position: m. Shape (3, n).
        velocity: m/s. Shape (3, n).
        attitude: Quaternion w x y z. Shape (4, n).
        rates: Body rates, rad/s. Shape (3, n).
    """

    position: Floats
    velocity: Floats
    attitude: Floats
    rates: Floats

    @property
    def turn(self) -> Floats:
        """The attitude as a rotation matrix, body to world. Shape (3, 3, n)."""
        return matrix(self.attitude)


@dataclass(frozen=True, slots=True)
class Command:
    """Command of a controller to the autopilot, until the next one.

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


class Plant(ABC):
    """Vehicles in flight. Between two calls of `follow` come the clock's `SUBSTEPS` steps."""

    @property
    @abstractmethod
    def position(self) -> Floats:
        """Positions, m. Shape (3, n)."""

    @abstractmethod
    def motion(self) -> Motion:
        """Return how they really move."""

    @abstractmethod
    def felt(self) -> Floats:
        """Return the acceleration that they know of by themselves, m/s^2, for the filter behind motion capture. Shape (3, n)."""

    @abstractmethod
    def follow(self, command: Command) -> None:
        """Take a new command."""

    @abstractmethod
    def step(self, wind: Floats | float) -> None:
        """Fly for `STEP` seconds.

        Args:
            wind: Velocity of the air, m/s, world frame. Shape (3, n), or 0 for still air.
        """

    def fly(self, wind: Floats | float, count: int) -> Floats:
        """Take some steps and return where they are after each, m. Shape (count, 3, n).

        Args:
            wind: As `step` is told, for all of them.
            count: How many.
        """
        places = np.empty((count, *self.position.shape))
        for k in range(count):
            self.step(wind)
            places[k] = self.position
        return places

    @property
    @abstractmethod
    def thrust(self) -> Floats:
        """Collective thrust, N. Shape (n,)."""

    @property
    def rotors(self) -> Floats | None:
        """Each rotor's thrust, N; None where the model has no rotors. Shape (4, n)."""
        return None

    @property
    def charge(self) -> Floats:
        """Battery voltage over its voltage in hover at full charge; 1 where the model has no battery. Shape (n,)."""
        return np.ones(self.position.shape[1])


class AirframeModel(ABC):
    """Model of an airframe in simulation: a value without state, a frozen dataclass at best, from which flights begin."""

    @abstractmethod
    def begin(self, airframe: Airframe, flat: Floats) -> Plant:
        """Return vehicles that hover.

        Args:
            airframe: What flies.
            flat: x, y, z in m and heading in rad of each. Shape (4, n).
        """

    def known(self, airframe: Airframe) -> Airframe:
        """Return what a controller takes the airframe for: itself, without what this model leaves out."""
        return airframe


AIRFRAME_MODELS: Registry[AirframeModel] = Registry(
    what="an airframe model",
    group="ltlplan.airframe_models",
    built_in={"full": "flight.model.full:FULL", "paper": "flight.model.paper:PAPER"},
    kind=AirframeModel,
)
