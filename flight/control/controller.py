"""Protocol of a controller: a value that is chosen by name, and the loop that it begins for some vehicles.

A new controller is a module with a subclass of `Controller`, and one line in `CONTROLLERS`; another package names its own in the
group `ltlplan.controllers` of its entry points (docs/extending.md).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, Protocol

from flight.model.airframe import Airframe
from flight.model.attitude import Floats
from flight.model.plant import Command, Motion
from verify.data.names.registry import Registry

NEAR = 0.05
"""m, most of an error that is summed: large ones are for the other gains, and would only wind the sum up."""


class ControlLoop(Protocol):
    """A controller at work, 50 times a second, with what it remembers."""

    def command(self, flat: Floats, now: Motion) -> Command:
        """Return the command for the next 20 ms.

        Args:
            flat: Planned x, y, z, heading and their first four derivatives, in m, rad and s. Shape (5, 4, n).
            now: What is known of the vehicles.
        """
        ...


class Controller(ABC):
    """Controller that follows a plan: a value without state, a frozen dataclass at best, from which loops begin.

    Attributes:
        setpoints: How many set-points a second simulation gives it.
        orders: The highest derivative of a planned position that it takes.
    """

    setpoints: ClassVar[float] = 50.0
    orders: ClassVar[int] = 4

    @abstractmethod
    def begin(self, airframe: Airframe, flat: Floats) -> ControlLoop:
        """Return a loop for vehicles that hover.

        All arithmetic is to be element by element along the last axis, so that a run does not depend on those beside it.

        Args:
            airframe: What the controller takes the vehicles for, gains included.
            flat: x, y, z in m and heading in rad of each at time 0. Shape (4, n).
        """


CONTROLLERS: Registry[Controller] = Registry(
    what="a controller",
    group="ltlplan.controllers",
    built_in={
        "geometric": "flight.control.geometric:GEOMETRIC",
        "paper": "flight.control.paper:PAPER",
        "mellinger": "flight.control.mellinger:MELLINGER",
        "pid": "flight.control.pid:PID",
        "lee": "flight.control.lee:LEE",
        "px4": "flight.control.px4:PX4",
        "profile": "flight.onboard_simulation.commanded:PROFILE",
    },
    kind=Controller,
)
