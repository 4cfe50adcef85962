"""The door of all exports: is it certified, does it fit, and then write it whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flight.certificate_checks import certified_mission
from flight.exports.braking import AtMost, braked, ends_in_flight
from flight.exports.flown import WARNING, require_flight, warned
from flight.exports.notes import readme
from flight.exports.target import EXPORT_TARGETS, NOTE, ExportTarget, Product, Request
from flight.frames import team_in_laboratory
from flight.logs.log import FlightLog
from flight.model.airframe import airframes_of
from flight.storage.folders import write_files
from verify.certificate import Certificate
from verify.checked_claims import proof_sentences
from verify.data import BadInput, DoesNotFit, Mission, NotCertified, Trajectory, check_trajectories
from verify.data.events import unknown
from verify.data.names.former_names import former_arguments


@dataclass(frozen=True, slots=True)
class Exported:
    """Files that were written.

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


def formats() -> tuple[str, ...]:
    """Return the names of all formats, those of other packages too."""
    return EXPORT_TARGETS.names()


# as many parameters as `ltlplan export` has options, each by its keyword
@former_arguments(anyway="force")
def export(
    team: Mapping[str, Trajectory],
    cert: Certificate,
    out: str | os.PathLike[str],
    format: ExportTarget | str = "crazyswarm2",  # noqa: A002  # the name that users type
    *,
    vehicle: str | None = None,
    robots: Collection[str] | None = None,
    flight: FlightLog | None = None,
    force: bool = False,
    beside: Mapping[str, bytes] | None = None,
    **options: Any,  # of any type that the target reads
) -> Exported:
    """Write a certified team's trajectories for real vehicles.

    Args:
        team: The trajectories that were certified.
        cert: Their certificate.
        out: Folder to write into; it is made where it does not exist.
        format: A target, or a name of one: `crazyswarm2`, `crazyflie`, `crazyflie-compressed`, `px4`, `ros2`, or another package's.
        vehicle: Name of the airframe that will fly, where it is to be checked against the certificate's.
        robots: Names of those that are written, where others of the team fly from another export; None for all.
        flight: A simulated flight under this certificate, which must have stayed in its tube by the profiles' controllers
            (`flight.fly` with `conditions=flight.conditions_of(mission)`); the target's vehicles must run these.
        force: Write without such a flight, with a warning in every file that has room for words.
        beside: More files to write there, such as a proof, by their names.
        options: As the target's `options` say: `uris` (crazyswarm2: robot to radio address), `trajectory_ids` and `offset`
            (crazyflie: robot to id, bytes), `rate` (px4, ros2: points a second), `origin` (px4: m, the local frame's origin in ours).

    Returns:
        What was written.

    Raises:
        NotCertified: There is no certificate, it does not cover exactly these trajectories, a claim of it fails, or there is no flight,
            or it left its tube, was another's or by a controller that the target's vehicles do not run.
        DoesNotFit: The vehicle or its format cannot hold the flight.
        MissingEngine: A package that the target needs is not installed.
        BadInput: There is no such format or option, or the folder cannot be written, is somebody else's, or holds a file of
            the user's that would be overwritten.
    """
    target = EXPORT_TARGETS.resolve(format)
    product = make_product(team, cert, target, vehicle=vehicle, robots=robots, force=force, **options)
    if not force:
        require_flight(flight, cert, certified_mission(cert), robots or team, target, options)
    written = write_files(out, {**product.files, **(beside or {})})
    note = Path(out) / NOTE
    files = (*(path for path in written if path != note), note)
    return Exported(target.name, Path(out), files, cert.digest(), product.notes)


def make_product(
    team: Mapping[str, Trajectory],
    cert: Certificate,
    format: ExportTarget | str,  # noqa: A002  # the name that users type
    *,
    vehicle: str | None = None,
    robots: Collection[str] | None = None,
    force: bool = False,
    **options: Any,  # of any type that the target reads
) -> Product:
    """Return what `export` would write, its note included; whether it was flown in simulation is not asked here.

    Args:
        team: The trajectories that were certified.
        cert: Their certificate.
        format: A target, or a name of one.
        vehicle: Name of the airframe that will fly, where it is to be checked against the certificate's.
        robots: Names of those that are written, where others of the team fly from another export; None for all.
        force: Whether every file that has room for words warns that no flight stayed in its tube.
        options: As the target's `options` say.

    Raises:
        NotCertified: There is no certificate, it does not cover exactly these trajectories, or a claim of it fails.
        DoesNotFit: The vehicle or its format cannot hold the flight.
        MissingEngine: A package that the target needs is not installed.
        BadInput: There is no such format or option.
    """
    target = EXPORT_TARGETS.resolve(format)
    target.require_options(options)
    team = check_trajectories(team)
    mission = require_certified(team, cert)
    if robots is not None:
        for name in robots:
            if name not in mission.agents:
                raise BadInput(unknown(name, "robot of the mission", mission.agents))
        if not robots:
            raise BadInput("robots is empty; leave it out to write all.")
    ordered = {name: team[name] for name in mission.agents if robots is None or name in robots}
    for name in ordered if vehicle is not None else ():
        if (own := mission.vehicle_of(name).name) != vehicle:
            who = "" if mission.of_one_kind else f" of {name}"
            raise NotCertified(f"the certificate is for the airframe '{own}'{who}, not '{vehicle}'.")
    if any(path.cuts for path in team.values()) and len(ordered) < len(team):
        _require_common_pauses(target, mission, ordered)
    ends, said = _brakings(mission.model_copy(update={"margin": float(cert.margin)}), ordered, target)
    whole = {name: ends.get(name) or team[name].flattened(mission.spec.repeat) for name in mission.agents}
    ordered, placed = team_in_laboratory(mission, ordered)
    ends, _ = team_in_laboratory(mission, ends)
    apart = float(getattr(cert, "clock_error", 0.0))
    request = Request(
        mission,
        ordered,
        mission.spec.repeat,
        float(cert.margin),
        cert.digest(),
        options,
        ends,
        apart,
        whole,
        WARNING if force else "",
    )
    product = target.make(request)
    doubts = dict.fromkeys(doubt for airframe in airframes_of(mission, ordered) if (doubt := airframe.doubt))
    guessed = (doubt[:1].upper() + doubt[1:] for doubt in doubts)
    proof = f"Proof: {'; '.join(proof_sentences(cert.claims, getattr(cert, 'kernel', None)))}."
    notes = (*([WARNING] if force else []), *([placed] if placed else []), *product.notes, *said, *guessed, proof)
    files = {**product.files, NOTE: readme(request, target, notes, product.beyond).encode()}
    return Product(warned(files) if force else files, notes, product.beyond)


def names_of(
    team: Mapping[str, Trajectory],
    mission: Mission,
    format: ExportTarget | str,  # noqa: A002  # the name that users type
    *,
    robots: Collection[str] | None = None,
    **options: Any,  # of any type that the target reads
) -> tuple[str, ...]:
    """Return the names of the files that an export of a team would have, whether it is certified or not.

    Args:
        team: Its trajectories.
        mission: Who flies, and where.
        format: A target, or a name of one.
        robots: Names of those that are written; None for all.
        options: As the target's `options` say.

    Raises:
        DoesNotFit: The vehicle or its format cannot hold the flight.
        MissingEngine: A package that the target needs is not installed.
        BadInput: There is no such format or option.
    """
    target = EXPORT_TARGETS.resolve(format)
    target.require_options(options)
    written = {name: team[name] for name in mission.agents if robots is None or name in robots}
    if not written:
        raise BadInput("robots names no robot of the mission; leave it out to write all.")
    whole = {name: team[name].flattened(mission.spec.repeat) for name in mission.agents}
    request = Request(mission, written, mission.spec.repeat, float(mission.margin), "", options, whole=whole)
    return (*target.make(request).files, NOTE)


def _require_common_pauses(target: ExportTarget, mission: Mission, written: Mapping[str, Trajectory]) -> None:
    """Reject to write some robots of a flight in parts for a target that would not pause when the others do.

    Raises:
        DoesNotFit: As said.
    """
    if not target.in_parts:
        others = ", ".join(name for name in mission.agents if name not in written)
        raise DoesNotFit(
            f"The flight is in parts, between which the whole team pauses, and {target.name} flies {', '.join(written)} without pauses while {others} "
            "are flown otherwise. Write all robots for it, or give the vehicles of the others memory for the whole flight (`pieces`)."
        )


def _brakings(
    mission: Mission, team: Mapping[str, Trajectory], target: ExportTarget
) -> tuple[dict[str, Trajectory], tuple[str, ...]]:
    """Return the laps of a patrol with a proved braking behind them, if it ends in flight, and what a person is told of it."""
    ends: dict[str, Trajectory] = {}
    said: list[str] = []
    for name, path in team.items():
        if len(mission.agents) > 1 or not ends_in_flight(path):
            continue
        join = target.join or AtMost(None)
        if isinstance(join, AtMost) and join.pieces is not None:
            join = AtMost(min(join.pieces, mission.limits_of(name).pieces or join.pieces))
        found = braked(mission, name, path, join)
        if found is None:
            speed = float(np.linalg.norm(path.evaluate(path.duration, 1)[:3]))
            said.append(
                f"{name} ends its last lap at {speed:.2f} m/s: no braking behind it was proved that fits, so take control of it there."
            )
            continue
        ends[name] = found.flown
        place = ", ".join(f"{x:.3f}" for x in found.flown.evaluate(found.flown.duration)[:3])
        later = f", {found.more} pieces of another lap later" if found.more else ""
        said.append(
            f"Behind its last lap{later} {name} brakes from {found.since:.3f} s on and rests at ({place}) m at {found.flown.duration:.3f} s: proved "
            "within the margin, like the laps, and it shows nothing that another lap does not begin with."
        )
    return ends, tuple(said)


def require_certified(team: Mapping[str, Trajectory], cert: Certificate | None) -> Mission:
    """Return the certificate's mission; refuse a team that it does not cover, bit for bit.

    Args:
        team: One trajectory a robot.
        cert: What `verify.certify` returned.

    Raises:
        NotCertified: As said.
        BadInput: It is no certificate, or one whose values make no sense.
    """
    if cert is None:
        raise NotCertified("there is no certificate; only certified flights are exported (`verify.certify` makes one).")
    mission = certified_mission(cert)
    failing = [claim for claim in cert.claims if claim.outcome != "holds"]
    if failing:
        raise NotCertified(f"the certificate has a claim that does not hold, {failing[0].name}: {failing[0].sentence}")
    if not cert.covers(team):
        raise NotCertified("the certificate does not cover these trajectories: they differ from what was certified.")
    return mission
