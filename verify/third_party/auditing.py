"""The door: what others planned, checked for all times, with the tightest instants of what holds and every breach of what does not.

From 0 until the last flight ends every drone is checked, at rest on its first position before its own flight begins and on its last one
after it has ended: take-off and landing are part of what is checked, and so is standing on the ground. Where a show's paths begin or end in the
air, the columns from and to the ground are checked in place of those rests.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Any

from verify.arithmetic.balls import Floats
from verify.certificate import claim_data, payload_digest, versions
from verify.claims.claim import Claim, claim_of
from verify.data.errors import BadInput
from verify.data.mission import Mission, check_mission
from verify.data.progress import Progress, silent
from verify.kernel.statement import Refused
from verify.third_party.audit_proof import prove_audit, require_statable
from verify.third_party.audit_requirements import Asked, AuditLimits, require_agents, resolve
from verify.third_party.column_claims import column_claims, columns_lowest, unknown_claims
from verify.third_party.columns import covered_rows, judge_columns
from verify.third_party.distances import Closest, Separation, judge_distances
from verify.third_party.extremes import Extreme, rate_extremes, wall_extremes
from verify.third_party.fleet import Fleet
from verify.third_party.fleet_claims import extreme_claims, joint_claims, separation_claims, yaw_claims
from verify.third_party.importers import read_fleet
from verify.third_party.instants import TIGHTEST, Instant
from verify.third_party.joints import Joints, jumps
from verify.third_party.letters import check_words, word_claims
from verify.third_party.near_pieces import near_pieces
from verify.third_party.shows.fence_claims import fence_claims
from verify.third_party.windows import windows_of
from verify.third_party.yaw import yaw_extremes

AUDIT_FORMAT = 1


@dataclass(frozen=True, eq=False)
class Audit:
    """Verdict on others' flights; true only where every claim is proved.

    Attributes:
        source: Names the files.
        digest: SHA-256 of the flights' numbers.
        drones: How many.
        pieces: Of all drones together, rests included.
        duration: Until the last flight ends, in s.
        asked: The limits.
        claims: One of each kind for all drones where it holds, or one for each drone or pair that breaks it.
        tightest: For each kind of claim the instants nearest to the limit, nearest first.
        versions: Of the software that checked.
        notes: What is not checked or not asked of what the files hold, in sentences.
        fleet: The flights, for pictures; no part of what is written.
        kernel: Version of the kernel that checked the claims whose `proof` is "checked"; None where no proof was written.
        files: The proof, by file name; no part of what is written as JSON.
    """

    source: str
    digest: str
    drones: int
    pieces: int
    duration: float
    asked: Mapping[str, object]
    claims: tuple[Claim, ...]
    tightest: Mapping[str, tuple[Instant, ...]]
    versions: Mapping[str, str]
    notes: tuple[str, ...]
    fleet: Fleet
    kernel: int | None = None
    files: Mapping[str, bytes] = field(default_factory=dict[str, bytes], repr=False)

    @property
    def holds(self) -> bool:
        """True if every claim is proved."""
        return bool(self.claims) and all(claim.outcome == "holds" for claim in self.claims)

    def __bool__(self) -> bool:
        return self.holds

    @property
    def checked(self) -> int:
        """Number of claims that the kernel checked."""
        return sum(claim.proof == "checked" for claim in self.claims)

    @property
    def broken(self) -> tuple[Claim, ...]:
        """Claims that are not proved."""
        return tuple(claim for claim in self.claims if claim.outcome != "holds")

    def to_dict(self) -> dict[str, Any]:  # of any type: JSON nests
        """Return the audit as plain data, with a digest of itself."""
        data = {
            "format": AUDIT_FORMAT,
            "source": self.source,
            "flights": self.digest,
            "drones": self.drones,
            "pieces": self.pieces,
            "duration": self.duration,
            "asked": dict(self.asked),
            "holds": self.holds,
            "claims": [claim_data(claim) for claim in self.claims],
            "tightest": {name: [asdict(instant) for instant in row] for name, row in self.tightest.items()},
            "notes": list(self.notes),
            "versions": dict(self.versions),
            "kernel": self.kernel,
        }
        return {**data, "digest": payload_digest(data)}

    def to_json(self) -> str:
        """Return the audit as JSON."""
        return json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n"


def audit(
    files: str | Path | Sequence[str | Path],
    mission: Mission | None = None,
    limits: AuditLimits = AuditLimits(),  # noqa: B008  # frozen
    *,
    proof: bool = False,
    progress: Progress = silent,
) -> Audit:
    """Check what others planned, for all times.

    Args:
        files: A Skybrush show (`.skyc`), or a folder of CSV files, each of one robot as crazyswarm2 has them, or the files.
        mission: Whose agents they are: its workspace, separation, vehicles' limits, margin, obstacles and rims are asked, and its formula
            where it has one.
        limits: Single limits, in place of the mission's or beside it.
        proof: Whether to write down a proof of what holds, and to have the kernel check it.
        progress: Called with what is being done and the share that is done.

    Raises:
        BadInput: A file is at fault, nothing is asked, the drones are not the mission's agents, or its trace is infinite.
        InternalError: Two independent answers to the formula disagree: a bug of ours.
        MissingEngine: The mission has a formula, and Spot is absent.
    """
    if not isinstance(limits, AuditLimits):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput(f"limits must be verify.AuditLimits(...), not {type(limits).__name__}.")
    if mission is not None:
        mission = check_mission(mission, to_plan=False)
        check_words(mission)
    progress("reading", 0.0)
    fleet = read_fleet(files)
    if fleet.columns and not limits.columns:
        fleet = replace(fleet, columns=(), assumed=("Take-off and landing outside the paths are not judged: as asked.",))
    if mission is not None:
        require_agents(fleet, mission)
        starts = (
            (*homes, ("start", 0, mission.agents[name].start)) for name, homes in zip(fleet.names, fleet.homes, strict=True)
        )
        fleet = replace(fleet, homes=tuple(starts))
    asked = resolve(fleet, mission, limits)
    found = judge_fleet(fleet, asked, progress)
    if mission is not None:
        progress("the mission's words", 0.9)
        found = replace(found, claims=(*found.claims, *word_claims(mission, fleet, asked), *unknown_claims(mission, fleet)))
    if not proof:
        return found
    progress("the proof", 0.95)
    try:
        require_statable(fleet)
        proved = prove_audit(fleet, asked, mission, found.claims)
    except Refused as refused:
        return replace(found, notes=(*found.notes, f"No proof is written: {refused}"))
    notes = (*found.notes, proved.note) if proved.note else found.notes
    return replace(found, claims=proved.claims, kernel=proved.verdict.kernel, files=proved.files, notes=notes)


def judge_fleet(fleet: Fleet, asked: Asked, progress: Progress = silent) -> Audit:
    """Check flights that were read.

    Args:
        fleet: The drones.
        asked: What is asked of them.
        progress: Called with what is being done and the share that is done.
    """
    claims: list[Claim] = []
    tightest: dict[str, tuple[Instant, ...]] = {}

    def take(name: str, found: tuple[list[Claim], list[Instant]]) -> None:
        claims.extend(found[0])
        tightest[name] = tuple(found[1])

    progress("how pieces join", 0.1)
    steps = jumps(fleet, 0)
    claims.extend(joint_claims(fleet, steps, asked))
    if not (asked.workspace is None and asked.min_height is None and asked.altitude is None):
        progress("the workspace", 0.2)
    if asked.workspace is not None:
        low, high = asked.workspace.min, asked.workspace.max
        walls = [(axis, side, corner[axis]) for axis in range(3) for side, corner in (("min", low), ("max", high))]
        found = [
            extreme
            for axis, side, at in walls
            for extreme in (
                _floor(fleet, at, asked.margin) if (axis, side) == (2, "min") else _wall(fleet, axis, side, at, asked.margin)
            )
        ]
        take("workspace", extreme_claims(fleet, "workspace", "m", _nearest_walls(found)))
    if asked.min_height is not None:
        take("height", extreme_claims(fleet, "height", "m", _floor(fleet, asked.min_height, asked.margin)))
    if asked.altitude is not None:
        take("altitude", extreme_claims(fleet, "altitude", "m", _wall(fleet, 2, "max", asked.altitude, asked.margin)))
    if asked.fences:
        progress("the geofence", 0.25)
        take("geofence", fence_claims(fleet, asked.fences, asked.margin))
    if asked.yaw_rates is not None:
        take("limits.yaw_rate", yaw_claims(fleet, yaw_extremes(fleet, asked.yaw_rates)))
    for rate in asked.rates:
        progress("speeds" if rate.order == 1 else "accelerations", 0.2 + 0.1 * rate.order)
        take(rate.name, extreme_claims(fleet, rate.name, rate.unit, rate_extremes(fleet, rate), rate.what))
    if asked.least is not None and len(fleet) == 1:
        sentence = f"There is one drone, {fleet.names[0]}, which has none to keep apart from."
        claims.append(claim_of("separation", "holds", sentence, robot=fleet.names[0], unit="m", limit=asked.most))
    elif asked.least is not None:
        progress("distances", 0.5)
        take("separation", _separation(fleet, asked, steps, progress))
    return Audit(
        source=fleet.source, digest=fleet.digest, drones=len(fleet), pieces=len(fleet.values), duration=float(fleet.end),
        asked=MappingProxyType(asked.said), claims=tuple(claims), tightest=MappingProxyType(tightest),
        versions=MappingProxyType(versions()), notes=(*fleet.assumed, *fleet.notes, *asked.notes), fleet=fleet,
    )  # fmt: skip


def _wall(fleet: Fleet, axis: int, side: str, at: float, margin: Fraction) -> list[Extreme]:
    return wall_extremes(fleet, axis, side, Fraction(at) + (margin if side == "min" else -margin))


def _floor(fleet: Fleet, at: float, margin: Fraction) -> list[Extreme]:
    """Bound how near drones come to the floor, on their paths and where they take off and land outside them."""
    return columns_lowest(fleet, _wall(fleet, 2, "min", at, margin), Fraction(at) + margin)


def _nearest_walls(found: Iterable[Extreme]) -> list[Extreme]:
    """Return for each drone the wall that it comes nearest to, and every wall that it passes."""
    by_drone: dict[int, list[Extreme]] = {}
    for extreme in found:
        by_drone.setdefault(extreme.drone, []).append(extreme)
    result: list[Extreme] = []
    for row in by_drone.values():
        broken = [extreme for extreme in row if extreme.outcome != "holds"]
        result += broken or [min(row, key=lambda e: abs(e.bound - e.limit))]
    return result


def _separation(fleet: Fleet, asked: Asked, steps: Joints, progress: Progress) -> tuple[list[Claim], list[Instant]]:
    assert asked.least is not None
    stretched: Floats = steps.jumps * (max(1.0, float(asked.weight)) * (1 + 2.0**-40))
    windows = windows_of(fleet, asked.above, covered_rows(fleet))
    pairs = Separation(asked.least, asked.most, asked.weight, stretched, asked.fewest, asked.above, windows)
    closest = Closest()

    def told(share: float) -> None:
        progress("distances", 0.5 + 0.5 * share)

    nearest, breaches = judge_distances(fleet, pairs, near_pieces(fleet, pairs, closest, told), closest)
    claims, instants = separation_claims(fleet, pairs, nearest, breaches)
    if fleet.columns:
        others, more = column_claims(fleet, pairs, judge_columns(fleet, pairs))
        claims, instants = [*claims, *others], sorted([*instants, *more], key=lambda i: i.value - i.limit)[:TIGHTEST]
    return claims, instants
