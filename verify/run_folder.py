"""A certificate proved again from its folder alone: mission.yaml, plan.json, one CSV a robot, certificate.json.

Nothing in certificate.json is believed. It says what was proved of which files; all claims are checked anew from those
files, and whatever differs is rejected with the name of the file that was changed. The kernel checks the proof beside it, where there is one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from verify.certificate import Certificate
from verify.certificate_file import difference, read_certificate
from verify.certification import judge
from verify.checked_claims import rechecked
from verify.data.errors import BadInput, NotCertified
from verify.data.files.mission_file import load_mission_file
from verify.data.files.trajectory_csv import load_csv
from verify.data.mission import Mission
from verify.data.plan import PLAN_FILE, Plan, load_plan
from verify.data.trajectory import Trajectory
from verify.exported_parts import require_parts
from verify.motion.continuity import JUMPS
from verify.motion.planned_words import false_statement
from verify.proofs.proof_folder import ProofVerdict

MISSION_FILE = "mission.yaml"
CERTIFICATE_FILE = "certificate.json"


def recheck(folder: str | Path) -> Certificate:
    """Prove a folder's certificate again, from the files alone.

    Args:
        folder: Holds mission.yaml, plan.json, <robot>.csv and certificate.json.

    Returns:
        The certificate as it was proved now; each claim's `proof` says whether the kernel checked it, too.

    Raises:
        NotCertified: A file was changed since (the message names it), or a claim is not proved any more.
        BadInput: A file is missing, unreadable or of a later format.
    """
    return proved_run(folder).certificate


@dataclass(frozen=True, eq=False)
class ProvedRun:
    """A folder's flight, its certificate proved again.

    Attributes:
        certificate: As it was proved now.
        plan: What was planned.
        team: The trajectories that were certified.
        proof: What the kernel says of the proof beside it; None where there is none.
    """

    certificate: Certificate
    plan: Plan
    team: dict[str, Trajectory]
    proof: ProofVerdict | None = None


def proved_run(folder: str | Path) -> ProvedRun:
    """Prove a folder's certificate again, and return it with what it covers.

    Raises:
        NotCertified: As `recheck`.
        BadInput: As `recheck`.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise BadInput(f"{folder} is no folder; name one that `ltlplan run` or `ltlplan certify` wrote.")
    written = read_certificate(folder / CERTIFICATE_FILE)
    mission = mission_of(folder)
    if mission.digest() != written["mission"]:
        raise NotCertified(f"{folder / MISSION_FILE} was changed: it is not the mission that was certified.")
    plan = load_plan(folder / PLAN_FILE, mission)
    if plan.digest() != written["plan"]:
        raise NotCertified(f"{folder / PLAN_FILE} was changed: it is not the plan that was certified.")
    team = _certified_team(folder, mission, written["trajectories"])
    require_parts(folder, team)
    certificate = judge(plan, team, margin=written["margin"], clock_error=written["clock_error"])
    if not certificate.holds:
        refused = [claim for claim in certificate.claims if claim.outcome != "holds"]
        listed = " ".join(claim.sentence for claim in refused[:5])
        raise NotCertified(
            f"{folder}: the claim is not proved at margin {certificate.margin:g} m. {listed}",
            [c.witness for c in refused if c.witness],
        )
    fault = false_statement(plan, certificate.timelines)
    if fault:
        raise NotCertified(f"{folder / PLAN_FILE} was changed, or was never true: {fault}")
    certificate, proof = rechecked(folder, plan, certificate)
    differing = difference(written, certificate.to_dict())
    if differing:
        raise NotCertified(f"{folder / CERTIFICATE_FILE} was changed: {differing}")
    return ProvedRun(certificate, plan, team, proof)


def mission_of(folder: Path) -> Mission:
    """Read the mission of a run's folder.

    Raises:
        BadInput: The folder holds none, or it is unreadable.
    """
    if not (folder / MISSION_FILE).exists():
        raise BadInput(f"{folder} has no {MISSION_FILE}; name a folder that `ltlplan run` or `ltlplan certify` wrote.")
    return load_mission_file(folder / MISSION_FILE, installed=False, alone=True)


def read_folder(folder: str | Path) -> tuple[Plan, dict[str, Trajectory]]:
    """Read a folder's plan (with its mission) and trajectories.

    Where the mission has a cycle its start is found as the first piece at which the last laps begin to repeat and that the path's
    end joins smoothly; of a team, all robots at the same time. Where the folder has a certificate of a flight in parts, they are cut
    as it says.

    Raises:
        BadInput: A file is missing or unreadable, or no cycle can be found.
    """
    folder = Path(folder)
    mission = mission_of(folder)
    plan = load_plan(folder / PLAN_FILE, mission)
    team = {name: load_csv(_csv(folder, name)) for name in mission.agents}
    if (cut := _as_cut(folder, mission, team)) is not None:
        return plan, cut
    if mission.spec.trace == "infinite":
        team = _with_found_cycles(folder, mission, team)
    return plan, team


def _as_cut(folder: Path, mission: Mission, flown: Mapping[str, Trajectory]) -> dict[str, Trajectory] | None:
    """Return flights in the parts that a certificate in their folder names, which the checker is to prove; None where it names none for them."""
    if not (folder / CERTIFICATE_FILE).exists():
        return None
    written = read_certificate(folder / CERTIFICATE_FILE, earlier=True)["trajectories"]
    if set(written) != set(flown) or not any(entry.get("cuts") for entry in written.values()):
        return None
    found: dict[str, Trajectory] = {}
    for name, path in flown.items():
        entry = written[name]
        once = path if entry["cycle"] is None else _with_cycle(path, entry["cycle"], mission.spec.repeat)
        cut = _with_cuts(once, entry.get("cuts", []))
        if cut is None:
            return None
        found[name] = cut
    return found


def _with_found_cycles(folder: Path, mission: Mission, flown: Mapping[str, Trajectory]) -> dict[str, Trajectory]:
    """Return flights with their laps; those of a team begin at the first time at which all robots' laps can."""
    laps = mission.spec.repeat
    found = {name: list(_possible_cycles(path, laps)) for name, path in flown.items()}
    begins = {
        name: {sum(map(Fraction, path.durations[: path.cycle].tolist()), Fraction(0)): path for path in paths}
        for name, paths in found.items()
    }
    for name, times in begins.items():
        if not times:
            raise BadInput(
                f"{_csv(folder, name)}: no piece was found at which a cycle of {laps} laps begins; the mission's trace is infinite."
            )
    common = set[Fraction].intersection(*(set(times) for times in begins.values()))
    if not common:
        raise BadInput(
            f"{folder}: no time was found at which the laps of all robots begin; the laps of a team begin and end together."
        )
    return {name: times[min(common)] for name, times in begins.items()}


def _csv(folder: Path, robot: str) -> Path:
    return folder / f"{robot}.csv"


def _certified_team(folder: Path, mission: Mission, written: Mapping[str, Any]) -> dict[str, Trajectory]:
    if set(written) != set(mission.agents):
        raise NotCertified(
            f"{folder / CERTIFICATE_FILE} was changed: it covers {', '.join(sorted(written)) or 'no robot'}, "
            f"the mission has {', '.join(mission.agents)}."
        )
    team: dict[str, Trajectory] = {}
    for name in mission.agents:
        entry = written[name]
        flown: Trajectory | None = load_csv(_csv(folder, name))
        if entry["cycle"] is not None:
            flown = _with_cycle(flown, entry["cycle"], mission.spec.repeat)
        flown = _with_cuts(flown, entry.get("cuts", []))
        if flown is None or flown.digest() != entry["digest"]:  # of every piece that the file holds
            raise NotCertified(f"{_csv(folder, name)} was changed: it is not the trajectory that was certified.")
        team[name] = flown
    return team


def _with_cycle(flown: Trajectory, cycle: int, laps: int) -> Trajectory | None:
    """Return prefix and one lap of a flight that repeats its last pieces, or None where it does not."""
    length, rest = divmod(len(flown) - cycle, laps)
    if rest or length < 1:
        return None
    for lap in range(1, laps):
        first, other = slice(cycle, cycle + length), slice(cycle + lap * length, cycle + (lap + 1) * length)
        same = np.array_equal(flown.durations[first], flown.durations[other])
        if not same or not np.array_equal(flown.coefficients[first], flown.coefficients[other]):
            return None
    end = cycle + length
    return Trajectory(flown.durations[:end], flown.coefficients[:end], cycle=cycle)


def _with_cuts(flown: Trajectory | None, cuts: list[int]) -> Trajectory | None:
    """Return a flight in parts; None where it cannot be cut so."""
    if flown is None or not cuts:
        return flown
    try:
        return Trajectory(flown.durations, flown.coefficients, cycle=flown.cycle, cuts=cuts)
    except BadInput:
        return None


def _possible_cycles(flown: Trajectory, laps: int) -> Iterator[Trajectory]:
    """Yield prefix and one lap for each piece at which laps may begin."""
    for cycle in range(len(flown)):
        found = _with_cycle(flown, cycle, laps)
        if found is None:
            continue
        start = np.stack([found.evaluate(found.knots[cycle], order)[:3] for order in range(4)])
        ends = np.stack([_end_value(found, order) for order in range(4)])
        if np.all(np.abs(ends - start) <= np.array(JUMPS)[:, None]):
            yield found


def _end_value(trajectory: Trajectory, order: int) -> np.ndarray:
    powers = trajectory.durations[-1] ** np.arange(trajectory.derivative_coefficients(order).shape[-1])
    return (trajectory.derivative_coefficients(order)[-1, :3] * powers).sum(-1)
