"""The door of all exports: is it certified, does it fit, and then write it whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from flight.certified import certified_mission
from flight.exports.notes import readme
from verify.data import BadInput, Mission, NotCertified, Trajectory, check_trajectories
from verify.data.errors import did_you_mean
from verify.data.storage.folders import write_files

NOTE = "README.txt"


@dataclass(frozen=True, slots=True)
class Request:
    """What a format's module works from.

    Attributes:
        mission: What the certificate is of.
        team: The certified trajectories, in the mission's order (cycles not repeated).
        laps: How often cycles are flown.
        margin: delta of the certificate, m.
        digest: The certificate's.
        options: What the caller passed for this format.
    """

    mission: Mission
    team: Mapping[str, Trajectory]
    laps: int
    margin: float
    digest: str
    options: Mapping[str, Any]

    @property
    def flown(self) -> dict[str, Trajectory]:
        """The trajectories with their cycles repeated."""
        return {name: path.flattened(self.laps) for name, path in self.team.items()}


@dataclass(frozen=True, slots=True)
class Product:
    """What a format's module makes: contents by file name, and sentences for the note."""

    files: Mapping[str, bytes]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Exported:
    """What was written.

    Attributes:
        format: Name of the format.
        folder: Where.
        files: All files, the note last.
        digest: The certificate's digest, which the files carry.
        notes: Sentences for a person that belong to this export.
    """

    format: str
    folder: Path
    files: tuple[Path, ...]
    digest: str
    notes: tuple[str, ...]


_MODULES: dict[str, tuple[str, str, tuple[str, ...]]] = {
    # format: module, function, options that it takes
    "crazyswarm2": ("crazyswarm", "product", ("uris",)),
    "crazyflie": ("crazyflie", "product", ("trajectory_ids", "offset")),
    "crazyflie-compressed": ("compressed", "product", ("trajectory_ids", "offset")),
    "px4": ("px4", "product", ("rate", "origin")),
    "ros2": ("ros", "product", ("rate",)),
}


def formats() -> tuple[str, ...]:
    """Return the names of all formats."""
    return tuple(_MODULES)


def export(
    team: Mapping[str, Trajectory],
    cert: Any,
    out: str | os.PathLike[str],
    format: str = "crazyswarm2",  # noqa: A002  # the name that users type
    *,
    vehicle: str | None = None,
    **options: Any,
) -> Exported:
    """Write a certified team's trajectories for real vehicles.

    Args:
        team: The trajectories that were certified.
        cert: Their certificate.
        out: Folder to write into; it is made where it does not exist.
        format: `crazyswarm2`, `crazyflie`, `crazyflie-compressed`, `px4` or `ros2`.
        vehicle: Name of the airframe that will fly, where it is to be checked against the certificate's.
        options: `uris` (crazyswarm2: robot to radio address), `trajectory_ids` and `offset` (crazyflie: robot to id,
            bytes), `rate` (px4, ros2: points a second), `origin` (px4: m, the local frame's origin in ours).

    Raises:
        NotCertified: There is no certificate, it does not cover exactly these trajectories, or a claim of it fails.
        DoesNotFit: The vehicle or its format cannot hold the flight.
        BadInput: There is no such format or option, or the folder cannot be written, is somebody else's, or holds a file of
            the user's that would be overwritten.
    """
    product = make_product(team, cert, format, vehicle=vehicle, **options)
    written = write_files(out, product.files)
    note = Path(out) / NOTE
    files = (*(path for path in written if path != note), note)
    return Exported(format, Path(out), files, cert.digest(), product.notes)


def make_product(
    team: Mapping[str, Trajectory],
    cert: Any,
    format: str,  # noqa: A002  # the name that users type
    *,
    vehicle: str | None = None,
    **options: Any,
) -> Product:
    """Return what `export` would write, its note included; arguments and errors are those of `export`."""
    if format not in _MODULES:
        raise BadInput(f"'{format}' is not an export format.{did_you_mean(format, _MODULES)} Formats: {', '.join(_MODULES)}.")
    module, function, known = _MODULES[format]
    for name in options:
        if name not in known:
            takes = ", ".join(known) or "none"
            raise BadInput(f"'{name}' is not an option of {format}.{did_you_mean(name, known)} Options: {takes}.")
    team = check_trajectories(team)
    mission = require_certified(team, cert, vehicle)
    ordered = {name: team[name] for name in mission.agents}
    request = Request(mission, ordered, mission.spec.repeat, float(cert.margin), cert.digest(), options)
    make: Callable[[Request], Product] = getattr(import_module(f"flight.exports.{module}"), function)
    product = make(request)
    return Product({**product.files, NOTE: readme(request, format, product.notes).encode()}, product.notes)


def require_certified(team: Mapping[str, Trajectory], cert: Any, vehicle: str | None = None) -> Mission:
    """Return the certificate's mission; refuse a team that it does not cover, bit for bit, or another airframe.

    Raises:
        NotCertified: As said.
        BadInput: It is no certificate, or one whose values make no sense.
    """
    if cert is None:
        raise NotCertified("there is no certificate; only certified flights are exported (`verify.certify` makes one).")
    mission = certified_mission(cert)
    failing = [claim for claim in cert.claims if claim.verdict != "holds"]
    if failing:
        raise NotCertified(f"the certificate has a claim that does not hold, {failing[0].name}: {failing[0].sentence}")
    if not cert.covers(team):
        raise NotCertified("the certificate does not cover these trajectories: they differ from what was certified.")
    if vehicle is not None and vehicle != mission.vehicle.name:
        raise NotCertified(f"the certificate is for the airframe '{mission.vehicle.name}', not '{vehicle}'.")
    return mission
