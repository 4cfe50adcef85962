"""A certificate proved again from its folder alone: mission.yaml, plan.json, one CSV a robot, certificate.json.

Nothing in certificate.json is believed. It says what was proved of which files; all claims are judged anew from those
files, and whatever differs is refused with the name of the file that was changed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from verify.certificate import CERTIFICATE_FORMAT, Certificate, payload_digest
from verify.certification import judge
from verify.data.errors import BadInput, NotCertified
from verify.data.files.mission_file import load_mission_file
from verify.data.files.trajectory_csv import load_csv
from verify.data.mission import Mission
from verify.data.plan import PLAN_FILE, Plan, load_plan
from verify.data.storage.reading import parse_json, read_bytes
from verify.data.trajectory import Trajectory
from verify.exported_parts import require_parts
from verify.motion.continuity import JUMPS
from verify.motion.planned_words import false_statement

MISSION_FILE = "mission.yaml"
CERTIFICATE_FILE = "certificate.json"

MAX_BYTES = 20_000_000

_AGREE = 1e-6
"""Bounds proved on another machine may differ by so much of their size: sums are rounded in another order there."""


def recheck(folder: str | Path) -> Certificate:
    """Prove a folder's certificate again, from the files alone.

    Args:
        folder: Holds mission.yaml, plan.json, <robot>.csv and certificate.json.

    Returns:
        The certificate as it was proved now.

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
    """

    certificate: Certificate
    plan: Plan
    team: dict[str, Trajectory]


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
    mission = load_mission_file(folder / MISSION_FILE, installed=False, alone=True)
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
    difference = _difference(written, certificate.to_dict())
    if difference:
        raise NotCertified(f"{folder / CERTIFICATE_FILE} was changed: {difference}")
    return ProvedRun(certificate, plan, team)


def read_folder(folder: str | Path) -> tuple[Plan, dict[str, Trajectory]]:
    """Read a folder's plan (with its mission) and trajectories.

    Where the mission has a cycle its start is found as the first piece at which the last laps begin to repeat and that the path's
    end joins smoothly; of a team, all robots at the same time. Where the folder has a certificate of a flight in parts, they are cut
    as it says.

    Raises:
        BadInput: A file is missing or unreadable, or no cycle can be found.
    """
    folder = Path(folder)
    mission = load_mission_file(folder / MISSION_FILE, installed=False, alone=True)
    plan = load_plan(folder / PLAN_FILE, mission)
    team = {name: load_csv(_csv(folder, name)) for name in mission.agents}
    if (cut := _as_cut(folder, mission, team)) is not None:
        return plan, cut
    if mission.spec.trace == "infinite":
        team = _with_found_cycles(folder, mission, team)
    return plan, team


def _as_cut(folder: Path, mission: Mission, flown: Mapping[str, Trajectory]) -> dict[str, Trajectory] | None:
    """Return flights in the parts that a certificate in their folder names, which the judge is to prove; None where it names none for them."""
    if not (folder / CERTIFICATE_FILE).exists():
        return None
    written = read_certificate(folder / CERTIFICATE_FILE)["trajectories"]
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


def read_certificate(path: Path) -> dict[str, Any]:  # of any type: JSON nests
    """Read certificate.json as plain data of the right shape; `recheck` proves what it says.

    Raises:
        BadInput: The file is unreadable, no certificate, or one of another format.
    """
    if not path.exists():
        raise BadInput(f"{path.parent} has no {path.name}; name a folder that `ltlplan run` or `ltlplan certify` wrote.")
    data = read_bytes(path, most=MAX_BYTES, what="certificate")
    return certificate_from_json(data, str(path))


def certificate_from_json(data: str | bytes, source: str = "certificate.json") -> dict[str, Any]:  # of any type: JSON nests
    """Read certificate.json as plain data; `recheck` proves what it says.

    Raises:
        BadInput: It is no certificate, or one of another format.
    """
    value = parse_json(data, source)
    if not isinstance(value, dict):
        raise BadInput(f"{source} is no certificate: it must be an object.")
    number = value.get("format")
    if isinstance(number, int) and not isinstance(number, bool) and number > CERTIFICATE_FORMAT:
        raise BadInput(
            f"{source} has format {number}, which is later than this version's {CERTIFICATE_FORMAT}; update ltlplan."
        )
    if number != CERTIFICATE_FORMAT or isinstance(number, bool):
        raise BadInput(f'{source} must have "format": {CERTIFICATE_FORMAT}, not {number!r}.')
    for key, test, wanted in _SHAPE:
        if key not in value:
            raise BadInput(f"{source} lacks '{key}'; it is incomplete.")
        if not test(value[key]):
            raise BadInput(f"{source}: '{key}' must be {wanted}.")
    if "soft" in value and not _is_list_of_objects(value["soft"]):
        raise BadInput(f"{source}: 'soft' must be a list of objects.")
    unknown = sorted(set(value) - {key for key, _, _ in _SHAPE} - {"format", "soft"})
    if unknown:
        raise BadInput(f"{source} has an unknown key '{unknown[0][:40]}'.")
    return value


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value <= 1e300


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _are_trajectories(value: Any) -> bool:
    return isinstance(value, dict) and all(
        isinstance(entry, dict)
        and {"digest", "cycle"} <= set(entry) <= {"digest", "cycle", "cuts"}
        and _is_text(entry["digest"])
        and (entry["cycle"] is None or _is_index(entry["cycle"]))
        and ("cuts" not in entry or (isinstance(entry["cuts"], list) and all(map(_is_index, entry["cuts"]))))
        for entry in value.values()
    )


def _is_index(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _is_list_of_objects(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(item, dict) for item in value)


def _are_actions(value: Any) -> bool:
    return _is_list_of_objects(value) and all(
        set(item) == {"robot", "visit", "time", "source", "target"}
        and all(_is_text(item[key]) for key in ("robot", "source", "target"))
        and _is_number(item["time"])
        and _is_number(item["visit"])
        for item in value
    )


def _are_versions(value: Any) -> bool:
    return isinstance(value, dict) and all(map(_is_text, value.values()))


_SHAPE = (
    ("mission", _is_text, "a digest"),
    ("plan", _is_text, "a digest"),
    ("trajectories", _are_trajectories, "an object of digest, cycle and cuts for each robot"),
    ("margin", _is_number, "a number, at least 0"),
    ("largest_margin", lambda v: v is None or _is_number(v), "a number, at least 0, or null"),
    ("clock_error", _is_number, "a number, at least 0"),
    ("duration", _is_number, "a number, at least 0"),
    ("claims", _is_list_of_objects, "a list of objects"),
    ("actions", _are_actions, "a list of objects with robot, visit, time, source and target"),
    ("versions", _are_versions, "an object of texts"),
    ("digest", _is_text, "a digest"),
)


def _difference(written: Mapping[str, Any], proved: Mapping[str, Any]) -> str:
    """Say where certificate.json differs from what was proved now; versions may."""
    for key in ("duration", "largest_margin", "actions"):
        if not _agree(written[key], proved[key]):
            return f"its '{key}' is not what the files give."
    for what, name in (("claims", "name"), ("soft", "formula")):
        ours, theirs = proved.get(what, []), written.get(what, [])
        if len(theirs) != len(ours):
            return f"it lists {len(theirs)} {'claims' if what == 'claims' else 'soft parts'}; the files give {len(ours)}."
        for index, (old, new) in enumerate(zip(theirs, ours, strict=True)):
            where = f"{'claim' if what == 'claims' else 'soft part'} {index} ({new[name]})"
            if fault := _differing(old, new):
                return f"{where}: {fault}"
    body = {key: value for key, value in written.items() if key != "digest"}
    if payload_digest(body) != written["digest"]:
        return "its digest does not belong to its contents."
    return ""


def _differing(old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    """Say in what a claim as it is written differs from the one that is proved."""
    for key in sorted(set(old) | set(new)):
        if key == "sentence" and isinstance(old.get(key), str) and not _same_sentence(old[key], new[key]):
            return f"its sentence is not the one that is proved: {new[key]}"
        if key == "sentence":
            continue
        if key not in old or key not in new or not _agree(old[key], new[key]):
            return f"its '{key}' is not what the files give."
    return ""


_NUMBER = re.compile(r"\d+(?:\.(\d+))?(?:e([+-]\d+))?")


def _same_sentence(old: str, new: str) -> bool:
    """Tell whether two sentences are the same, last places of their numbers aside: on other machines they round otherwise."""
    if old == new:
        return True
    if len(old) > 10 * len(new) + 1000 or _NUMBER.sub("0", old) != _NUMBER.sub("0", new):
        return False
    for a, b in zip(_NUMBER.finditer(old), _NUMBER.finditer(new), strict=True):
        if a.group() == b.group():
            continue
        if a.group(1) is None or b.group(1) is None or len(a.group()) > 40:  # whole numbers count and name
            return False
        place = 10.0 ** (int(b.group(2) or 0) - min(len(a.group(1)), len(b.group(1))))
        if abs(float(a.group()) - float(b.group())) > 1.01 * place:
            return False
    return True


def _agree(a: Any, b: Any) -> bool:
    if isinstance(a, bool) or isinstance(b, bool) or not isinstance(a, int | float) or not isinstance(b, int | float):
        if isinstance(a, list) and isinstance(b, list):
            return len(a) == len(b) and all(map(_agree, a, b))
        if isinstance(a, dict) and isinstance(b, dict):
            return a.keys() == b.keys() and all(_agree(a[key], b[key]) for key in a)
        return type(a) is type(b) and a == b
    return abs(a) <= 1e300 and abs(b) <= 1e300 and math.isclose(a, b, rel_tol=_AGREE, abs_tol=_AGREE)
