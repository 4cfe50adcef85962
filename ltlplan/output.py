"""Files of a run, a flight, a campaign or a rehearsal, and their names.

`flight.storage.folders` puts it there whole or not at all.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flight.storage.folders import PROOF, put_files, write_folder
from verify.checked_claims import PROOF_FOLDER
from verify.data import Mission, Plan, Trajectory, mission_to_yaml
from verify.data.files.trajectory_csv import write_csv
from verify.data.progress import Progress, part_of, silent
from verify.proofs.proof_folder import PROOF_FILES

if TYPE_CHECKING:
    from flight import Campaign, ExportTarget, FlightLog, Rehearsal
    from ltlplan.result import Result

PLAN_FILES = ("mission.yaml", "plan.json")
CAMPAIGN_FILES = (*PLAN_FILES, "campaign.json", "campaign.html")
REHEARSAL_FILES = (*PLAN_FILES, "rehearsal.json", "rehearsal.html")
LOG_FILES = (*PLAN_FILES, "flight.csv")
_EXPORT = "crazyswarm2"


def run_files(mission: Mission) -> tuple[str, ...]:
    """Return what `write_run` writes for a mission, so that its folder can be looked at before minutes of work."""
    import flight
    from flight.exports.crazyflies.crazyswarm import file_names

    tables = tuple(f"{name}.csv" for name in mission.agents)
    robots = flight.crazyswarm2_robots(mission)
    beside = (f"{PROOF_FOLDER}/{name}" for name in (*PROOF_FILES, *tables))
    exported = tuple(f"{_EXPORT}/{name}" for name in (*file_names(robots), *beside)) if robots else ()
    return (*LOG_FILES, *tables, PROOF, *PROOF_FILES, "report.html", *exported)


def write_run(result: Result, target: Path) -> Result:
    """Write everything that a run makes, and return it with its files and with what the kernel says of its proof.

    Files: `mission.yaml` (resolved), `plan.json`, `<robot>.csv`, `certificate.json`, `statement.json`, `proof.json`, `check.pyz`,
    `flight.csv`, `report.html`, a folder `crazyswarm2` ready for that system, and the manifest. `crazyswarm2` is of a mixed team's Crazyflies;
    it is left out where their memory does not hold the flight or its parts, where crazyswarm2 does not fly by their profiles' controller, and
    where something does not hold, the simulated flight in its tube for instance.
    """
    import flight
    from flight.logs.large_logs import run_csv
    from ltlplan.report.run_page import report_html
    from ltlplan.report.summary import shortfall
    from verify.checked_claims import checked_certificate

    proved = checked_certificate(result.plan, result.team, result.certificate)
    result = replace(result, certificate=proved.certificate, proof=proved.verdict)

    def write(folder: Path) -> None:
        write_plan_files(result.plan, folder)
        write_trajectories(result.plan, result.team, folder)
        robots = () if shortfall(result) else flight.crazyswarm2_robots(result.mission)
        if robots and not any(_too_long(result.mission, name, result.team[name]) for name in robots):
            flight.export(
                result.team, result.certificate, folder / _EXPORT, format="crazyswarm2", robots=robots, flight=result.log,
                beside=_beside(proved.files, result.plan, result.team),
            )  # fmt: skip
        (folder / PROOF).write_text(result.certificate.to_json(), encoding="utf-8")
        put_files(proved.files, folder)
        (folder / "flight.csv").write_text(run_csv(result.log), encoding="utf-8")
        (folder / "report.html").write_text(report_html(result), encoding="utf-8")

    return replace(result, files=write_folder(target, write))


def _beside(proof: Mapping[str, bytes], plan: Plan, team: Mapping[str, Trajectory]) -> dict[str, bytes]:
    """Return the files of a proof with the trajectories that it is of, by their names in an export."""
    texts = {name: text.encode() for name, text in trajectory_files(plan, team).items()}
    return {f"{PROOF_FOLDER}/{name}": content for name, content in {**proof, **texts}.items()}


def _too_long(mission: Mission, name: str, path: Trajectory) -> bool:
    """Return whether a robot's memory, by the mission or as Crazyflies have it, cannot hold a flight or one of its parts."""
    from flight.exports.crazyflies.fits import held_at_once

    uploaded = (end - begin for begin, end in path.parts) if path.cuts else (len(path.flattened(mission.spec.repeat)),)
    return max(uploaded) > held_at_once(mission, name)


def write_flight(plan: Plan, log: FlightLog, folder: Path) -> None:
    """Write `LOG_FILES`: what was planned, and one flight of it.

    Args:
        plan: What was flown.
        log: The flight.
        folder: Where; it exists.
    """
    from flight.logs.large_logs import run_csv

    write_plan_files(plan, folder)
    (folder / "flight.csv").write_text(run_csv(log), encoding="utf-8")


def write_campaign(plan: Plan, found: Campaign, folder: Path) -> None:
    """Write `CAMPAIGN_FILES`: what was planned, and what many flights of it showed, as data and as a page.

    Args:
        plan: What was flown.
        found: The findings.
        folder: Where; it exists.
    """
    from ltlplan.report.campaign import campaign_html

    write_plan_files(plan, folder)
    (folder / "campaign.json").write_text(json.dumps(found.to_dict(), indent=1) + "\n", encoding="utf-8")
    (folder / "campaign.html").write_text(campaign_html(found), encoding="utf-8")


def write_rehearsal(plan: Plan, found: Rehearsal, folder: Path) -> None:
    """Write `REHEARSAL_FILES`: what was planned, and who stayed in the tube, as data and as a page.

    Args:
        plan: What was flown.
        found: The findings.
        folder: Where; it exists.
    """
    from ltlplan.report.rehearsal import rehearsal_html

    write_plan_files(plan, folder)
    (folder / "rehearsal.json").write_text(json.dumps(found.to_dict(), indent=1) + "\n", encoding="utf-8")
    (folder / "rehearsal.html").write_text(rehearsal_html(found), encoding="utf-8")


def write_plan_files(plan: Plan, folder: Path) -> None:
    """Write `mission.yaml` and `plan.json`."""
    write_texts(plan_files(plan), folder)


def plan_files(plan: Plan) -> dict[str, str]:
    """Return what `write_plan_files` writes, by file name."""
    return {"mission.yaml": mission_to_yaml(plan.mission), "plan.json": plan.to_json()}


def write_trajectories(plan: Plan, team: Mapping[str, Trajectory], folder: Path) -> None:
    """Write `<robot>.csv` for each robot.

    Args:
        plan: Its mission's `repeat` says how often a cycle is written.
        team: A trajectory for each robot.
        folder: Where; it exists.
    """
    write_texts(trajectory_files(plan, team), folder)


def trajectory_files(plan: Plan, team: Mapping[str, Trajectory]) -> dict[str, str]:
    """Return what `write_trajectories` writes, by file name."""
    return {f"{name}.csv": write_csv(trajectory, plan.mission.spec.repeat) for name, trajectory in team.items()}


def write_texts(texts: Mapping[str, str], folder: Path) -> None:
    """Write files.

    Args:
        texts: By name.
        folder: Where; it exists.
    """
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")


@dataclass(frozen=True, slots=True)
class Export:
    """Export of a certified folder's flight for a vehicle.

    Attributes:
        files: Contents by file name.
        digest: The certificate's that they carry.
        notes: Sentences for a person that belong to this export.
    """

    files: Mapping[str, bytes]
    digest: str
    notes: tuple[str, ...]


# eight parameters: what is written, each choice by its keyword, and who is told
def make_export(
    folder: str | os.PathLike[str],
    format: ExportTarget | str,  # noqa: A002  # the name that users type
    *,
    vehicle: str | None = None,
    robots: Collection[str] | None = None,
    options: Mapping[str, Any] | None = None,  # of any type that the target reads
    force: bool = False,
    named: Callable[[Collection[str]], object] | None = None,
    progress: Progress | None = None,
) -> Export:
    """Make a certified folder's flight ready for a vehicle, after proving its certificate again and flying it in simulation.

    It is flown as `ltlplan run` flies, by whom the vehicles' profiles name, and must stay in its tube. The target's vehicles must run these
    controllers.

    Where a format rounds, the path is fitted to it and certified as it is then; the new plan's files and certificate go with it.

    Args:
        folder: What `ltlplan run` wrote.
        format: A target, or a name of one.
        vehicle: Name of the airframe that will fly, where it is to be compared with the certificate's.
        robots: Names of those that are written, where others of the team fly from another export; None for all.
        options: As the target's `options` say.
        force: Fly nothing, and write with a warning in every file that has room for words.
        named: Receives the names of all files before anything is proved, where they are known by then, and again before the flight is flown;
            what it raises ends the work.
        progress: Receives a sentence and the share done, 0 to 1.

    Raises:
        LtlplanError: As `flight.export` and `verify.recheck`.
    """
    from flight.conditions import conditions_of
    from flight.exports.flown import require_controllers, require_flight
    from flight.exports.target import EXPORT_TARGETS
    from flight.exports.writer import make_product
    from flight.flights import fly
    from verify import certify, recheck
    from verify.checked_claims import checked_certificate
    from verify.run_folder import read_folder

    say, target = progress or silent, EXPORT_TARGETS.resolve(format)
    if named is not None and (names := _names_of(Path(folder), target, robots, options or {})):
        named(names)
    say("proving the folder's certificate again", 0.0)
    certificate = recheck(Path(folder))
    plan, given = read_folder(Path(folder))
    if not force:
        require_controllers(target, plan.mission, robots or given, options or {})
    if target.prepare is not None:
        say("fitting the paths to the format", 0.4)
    team = _prepared(target, given, plan.mission.spec.repeat, robots)
    anew = team != given
    if anew:
        say("proving the paths as they are written", 0.6)
        certificate = certify(plan, team, margin=certificate.margin, clock_error=certificate.clock_error)
    say("writing files", 0.7)
    proved = checked_certificate(plan, team, certificate)
    certificate = proved.certificate
    product = make_product(team, certificate, target, vehicle=vehicle, robots=robots, force=force, **(options or {}))
    files = {**product.files, **_beside(proved.files, plan, team)}
    if anew:
        texts = {**_plan_texts(plan, team), PROOF: certificate.to_json()}
        files |= {name: text.encode() for name, text in texts.items()}
    if named is not None:
        named(files)
    if not force:
        conditions = conditions_of(plan.mission)
        log = fly(plan, team, certificate, seed=plan.seed, conditions=conditions, progress=part_of(say, 0.75, 1.0))
        require_flight(log, certificate, plan.mission, robots or team, target, options or {})
    return Export(files, certificate.digest(), product.notes)


def _plan_texts(plan: Plan, team: Mapping[str, Trajectory]) -> dict[str, str]:
    """Return the files of a plan that is certified anew, but for the certificate."""
    return {**plan_files(plan), **trajectory_files(plan, team)}


def _prepared(
    target: ExportTarget, given: Mapping[str, Trajectory], laps: int, robots: Collection[str] | None
) -> dict[str, Trajectory]:
    """Return a team as a target can hold it."""
    if target.prepare is None:
        return dict(given)
    prepared = target.prepare({name: path for name, path in given.items() if robots is None or name in robots}, laps)
    team = {**given, **prepared}
    if any(given[name].cuts and not path.cuts for name, path in prepared.items()):  # who is not written pauses for nobody then
        team = {name: Trajectory(p.durations, p.coefficients, cycle=p.cycle) for name, p in team.items()}
    return team


def _names_of(folder: Path, target: ExportTarget, robots: Collection[str] | None, options: Mapping[str, Any]) -> frozenset[str]:
    """Return the names of the files that an export would have, as far as that is known before anything is proved; else none.

    Whatever is wrong with the folder or the flight is said later, by who proves and writes them.
    """
    from flight.exports.writer import names_of
    from verify.data import LtlplanError
    from verify.run_folder import read_folder

    try:
        plan, given = read_folder(folder)
        team = _prepared(target, given, plan.mission.spec.repeat, robots)
        names = names_of(team, plan.mission, target, robots=robots, **options)
    except LtlplanError:
        return frozenset()
    names = {*names, *(f"{PROOF_FOLDER}/{name}" for name in (*PROOF_FILES, *trajectory_files(plan, team)))}
    return frozenset(names) if team == given else frozenset(names) | {*_plan_texts(plan, team), PROOF}
