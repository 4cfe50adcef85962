"""Protocol of an export target: the function that makes its files, its options, and what voids a certificate there.

A new target is a module with an `ExportTarget`, and one line in `EXPORT_TARGETS`; another package names its own in the group
`ltlplan.export_targets` of its entry points (docs/extending.md).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Protocol

from flight.control.profiles import PROFILES
from verify.data import BadInput, Mission, Trajectory, Vehicle
from verify.data.disturbance import StreamedSetpoints
from verify.data.errors import did_you_mean
from verify.data.names.registry import Registry

PROVED_RATE = 50.0
"""Set-points a second that `disturbance.setpoints` is about."""
NOTE = "README.txt"
"""The readable note of every export."""


@dataclass(frozen=True, slots=True)
class Request:
    """Input of a target.

    Attributes:
        mission: What the certificate is of.
        team: The certified trajectories, in the mission's order (cycles not repeated).
        laps: How often cycles are flown.
        margin: delta of the certificate, m.
        digest: The certificate's.
        options: What the caller passed for this target; only options that it has.
        braked: All laps of those that brake behind their last one, with the braking.
        clock_error: How far apart the robots' clocks may be by the certificate, s.
        whole: What every robot of the mission flies, those that are not written as well: finite, and in the mission's frame.
        warning: What files have to say of a flight that was not rehearsed; empty where it was. Scripts, YAML, JSON and the note get it without the
            target's doing.
    """

    mission: Mission
    team: Mapping[str, Trajectory]
    laps: int
    margin: float
    digest: str
    options: Mapping[str, Any]  # of any type that the target reads
    braked: Mapping[str, Trajectory] = field(default_factory=lambda: MappingProxyType({}))
    clock_error: float = 0.0
    whole: Mapping[str, Trajectory] = field(default_factory=lambda: MappingProxyType({}))
    warning: str = ""

    @property
    def flown(self) -> dict[str, Trajectory]:
        """The trajectories with their cycles repeated, and the braking behind them."""
        return {name: self.braked.get(name) or path.flattened(self.laps) for name, path in self.team.items()}


@dataclass(frozen=True, slots=True)
class Product:
    """Output of a target.

    Attributes:
        files: Contents by file name.
        notes: Sentences for the note.
        beyond: What comes before and after the flight and is not covered, a phrase each.
    """

    files: Mapping[str, bytes]
    notes: tuple[str, ...] = ()
    beyond: tuple[str, ...] = ("the climb to the start before time 0, and the landing after the end",)


class Sent(Protocol):
    """Bytes that were sent to one vehicle, or would have been."""

    @property
    def robot(self) -> str:
        """Its name."""
        ...

    @property
    def uri(self) -> str:
        """Its address."""
        ...

    @property
    def data(self) -> bytes:
        """The exact bytes."""
        ...


class Sender(Protocol):
    """Sends what a target wrote into a folder."""

    def __call__(
        self, folder: str | os.PathLike[str], uris: Mapping[str, str], *, dry_run: bool = False, part: int = 1
    ) -> tuple[Sent, ...]:
        """Send to each robot by its address, of a flight in parts one of them; with `dry_run` only return what would be sent.

        Who never writes parts need not take `part`: it is given for others than the first only.
        """
        ...


def _flies(_: Vehicle) -> str:
    return ""


@dataclass(frozen=True, slots=True)
class ExportTarget:
    """A kind of vehicle or tool that flights are written for.

    Attributes:
        name: As it is called in the note, and the folder of an export.
        make: From a certified team to the contents of files. It refuses with DoesNotFit what the target cannot hold, and with
            BadInput options that make no sense.
        options: What `flight.export` takes for this target: name to a sentence on it.
        voids: What voids the certificate in this target beyond what does so in all, a sentence each.
        prepare: Makes a team's trajectories such that the target can hold them, to be certified as they are then; it is told the
            trajectories and how often cycles are flown. None where any fit.
        send: Sends an export to vehicles; None where that is another tool's work.
        in_parts: Whether it flies flights in parts with pauses between them; others fly them whole and pause nowhere.
        join: Puts the piece in which a patrol's robot brakes behind its laps, as the target holds it; None where there is no room. None:
            as it is, any number of pieces.
        controllers: Names of the controllers that its vehicles run. Only a simulated flight by one of them opens an export. `profile`: the
            one that a vehicle's profile names, for formats that go with no vehicle in particular. Empty: none of them is modelled, so
            that an export is written with `force` or not at all.
        rate: Set-points a second that it writes where the option `rate` says nothing; None where it writes whole polynomials.
        orders: The highest derivative of a position in its set-points; None where it writes whole polynomials.
        cannot_fly: Of a vehicle's profile why no vehicle of the target flies as it was simulated, whatever is set on board; empty where one does.
        sent: What its set-points are off by as they are written; how old they are when they are followed is for others. None where that is not bounded.
    """

    name: str
    make: Callable[[Request], Product]
    options: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    voids: tuple[str, ...] = ()
    prepare: Callable[[Mapping[str, Trajectory], int], Mapping[str, Trajectory]] | None = None
    send: Sender | None = None
    in_parts: bool = False
    join: Callable[[str, Trajectory, Trajectory], Trajectory | None] | None = None
    controllers: tuple[str, ...] = ()
    rate: float | None = None
    orders: int | None = None
    sent: StreamedSetpoints | None = None
    cannot_fly: Callable[[Vehicle], str] = _flies

    def proved(self, request: Request) -> bool:
        """Return whether its set-points are those that tracking is proved on: whole polynomials, or a stream within what the mission states.

        Args:
            request: What is exported.
        """
        if self.rate is None:
            return True
        told = request.mission.disturbance and request.mission.disturbance.setpoints
        if told is None or self.sent is None or float(request.options.get("rate", self.rate)) != PROVED_RATE:
            return False
        return told.covers(self.sent.changed(age=told.age))

    def runs(self, controller: str) -> bool:
        """Return whether its vehicles run a controller.

        Args:
            controller: Its name.
        """
        return PROFILES in self.controllers or controller in self.controllers

    def require_options(self, options: Mapping[str, object]) -> None:
        """Reject options that the target does not have.

        Raises:
            BadInput: There is one.
        """
        for name in options:
            if name not in self.options:
                takes = ", ".join(self.options) or "none"
                raise BadInput(f"'{name}' is not an option of {self.name}.{did_you_mean(name, self.options)} Options: {takes}.")


EXPORT_TARGETS: Registry[ExportTarget] = Registry(
    what="an export format",
    group="ltlplan.export_targets",
    built_in={
        "crazyswarm2": "flight.exports.crazyflies.crazyswarm:CRAZYSWARM2",
        "crazyflie": "flight.exports.crazyflies.crazyflie:CRAZYFLIE",
        "crazyflie-compressed": "flight.exports.crazyflies.compressed:COMPRESSED",
        "px4": "flight.exports.px4:PX4",
        "ros2": "flight.exports.ros:ROS2",
    },
    kind=ExportTarget,
)
