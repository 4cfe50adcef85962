"""The certificate: every claim about a team's flight, for all times, with the digests of what it covers."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cache
from importlib import metadata
from typing import Any, Literal

from verify.claims.claim import Claim
from verify.claims.soft_claims import SoftClaim
from verify.data.mission import Mission
from verify.data.trajectory import Trajectory
from verify.model_checking.timeline import Timeline

CERTIFICATE_FORMAT = 2
"""Raised whenever a claim's sentence changes its meaning, so that no sentence is read with another meaning than it was proved with."""


KERNEL_KEYS = ("proof", "missing")
"""Keys of a claim that are the kernel's words."""


@dataclass(frozen=True, slots=True)
class ActionInstant:
    """A planned action, placed in time.

    Attributes:
        robot: Name.
        visit: Index of the planned visit during which it happens.
        time: Exact instant, in s (a multiple of 2^-20 s where that lies in the region for sure).
        source: Internal state before.
        target: Internal state after.
    """

    robot: str
    visit: int
    time: float
    source: str
    target: str


@dataclass(frozen=True, eq=False)
class Certificate:
    """Claims that were proved of a team's trajectories, with the mission that they are about.

    Attributes:
        mission: What was asked.
        mission_digest: Digest of the resolved mission.
        plan_digest: Digest of the plan.
        trajectories: Digest of each robot's trajectory.
        cycles: For each robot the piece at which its cycle begins, or None.
        margin: delta, in m.
        largest_margin: Largest delta for which all claims hold, to 0.1 mm; None where there is none or it was not asked.
        clock_error: How far apart the robots' clocks may be, in s.
        duration: T, in s.
        claims: Every claim, proved or not.
        actions: Instants of the planned actions.
        versions: Of the software that checked.
        timelines: For pictures; not part of the file or the digest.
        soft: What is said of each of the mission's soft specifications; no claims, for the certificate holds without them.
        cuts: For each robot whose flight is cut into parts, the pieces with which parts begin.
        kernel: Version of the kernel that checked the claims whose `proof` is "checked"; None where no proof was checked.
    """

    mission: Mission
    mission_digest: str
    plan_digest: str
    trajectories: dict[str, str]
    cycles: dict[str, int | None]
    margin: float
    largest_margin: float | None
    clock_error: float
    duration: float
    claims: tuple[Claim, ...]
    actions: tuple[ActionInstant, ...]
    versions: dict[str, str]
    timelines: dict[str, Timeline] = field(default_factory=dict)
    soft: tuple[SoftClaim, ...] = ()
    cuts: dict[str, tuple[int, ...]] = field(default_factory=dict)
    format: int = CERTIFICATE_FORMAT
    kernel: int | None = None

    def __repr__(self) -> str:
        proved = sum(claim.outcome == "holds" for claim in self.claims)
        return (
            f"<Certificate of '{self.mission.name}': {'holds' if self.holds else 'does not hold'}, {proved} of {len(self.claims)} claims proved, "
            f"{'' if self.kernel is None else f'{self.checked} checked by the kernel, '}margin {self.margin:g} m>"
        )

    @property
    def holds(self) -> bool:
        """True if every claim is proved."""
        return bool(self.claims) and all(claim.outcome == "holds" for claim in self.claims)

    @property
    def tube(self) -> Literal["proved", "assumed"]:
        """The word for robots staying within the margin: proved of all under the mission's disturbances, or assumed."""
        outcomes = {claim.outcome for claim in self.claims if claim.name == "tracking"}
        return "proved" if outcomes == {"holds"} else "assumed"

    @property
    def checked(self) -> int:
        """Number of claims that the kernel checked."""
        return sum(claim.proof == "checked" for claim in self.claims)

    @property
    def soft_weight(self) -> float:
        """Weight of the soft specifications that are proved."""
        return math.fsum(part.weight for part in self.soft if part.outcome == "holds")

    def covers(self, team: Mapping[str, Trajectory]) -> bool:
        """Return whether every claim is proved of exactly these trajectories, bit for bit."""
        return self.holds and {name: trajectory.digest() for name, trajectory in team.items()} == self.trajectories

    def to_dict(self) -> dict[str, Any]:  # of any type: JSON nests
        """Return certificate.json as plain data, its digest included."""
        data = self._payload()
        return {**data, "digest": payload_digest(data)}

    def to_json(self) -> str:
        """Return certificate.json."""
        return json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n"

    def digest(self) -> str:
        """Return the SHA-256 of everything in certificate.json but itself and the kernel's words, in hexadecimal."""
        return payload_digest(self._payload())

    def _payload(self) -> dict[str, Any]:
        return {
            "format": self.format,
            "mission": self.mission_digest,
            "plan": self.plan_digest,
            "trajectories": {
                name: {"digest": digest, "cycle": self.cycles[name], **self._cut(name)}
                for name, digest in self.trajectories.items()
            },
            "margin": self.margin,
            "largest_margin": self.largest_margin,
            "clock_error": self.clock_error,
            "duration": self.duration,
            "claims": [claim_data(claim) for claim in self.claims],
            "actions": [asdict(action) for action in self.actions],
            "versions": self.versions,
            "kernel": self.kernel,
            "tube": self.tube,
            **({"soft": [_soft_data(part) for part in self.soft]} if self.soft else {}),
        }

    def _cut(self, name: str) -> dict[str, list[int]]:
        return {"cuts": list(self.cuts[name])} if name in self.cuts else {}


@cache
def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "unknown"


def versions() -> dict[str, str]:
    """Return the versions of what a verdict rests on."""
    return {name: _version(name) for name in ("ltlplan", "numpy", "python-flint", "spottl")}


def _soft_data(part: SoftClaim) -> dict[str, Any]:
    time = None if part.witness is None else part.witness.time
    data = {"formula": part.formula, "weight": part.weight, "verdict": part.outcome, "sentence": part.sentence}
    return {**data, "time": _finite(time)}


def claim_data(claim: Claim) -> dict[str, Any]:  # of any type: JSON nests
    """Return a claim as it stands in certificate.json; figures that are not finite are null."""
    data: dict[str, Any] = {
        "name": claim.name,
        "verdict": claim.outcome,
        **proof_word(claim),
        "sentence": claim.sentence,
        "robot": claim.robot,
        "other": claim.other,
        "unit": claim.unit,
        "bound": _finite(claim.bound),
        "limit": _finite(claim.limit),
        "margin": _finite(claim.margin),
        "time": _finite(claim.time),
    }
    if claim.witness is not None:
        witness = claim.witness
        data["witness"] = {
            "region": witness.region,
            "visit": witness.visit,
            "what": witness.what,
            "word": [[robot, sorted(letter)] for robot, letter in witness.word],
            "times": [list(interval) for interval in witness.times],
            "order": [[list(first), list(then)] for first, then in witness.order],
        }
    return data


def proof_word(claim: Claim) -> dict[str, str]:
    """Return by whom a claim is proved, as it stands in files: `proof`, and `missing` where the kernel lacks something."""
    return {"proof": claim.proof, **({"missing": claim.missing} if claim.missing else {})}


def _finite(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


def payload_digest(data: Mapping[str, Any]) -> str:
    """Return the SHA-256 of certificate.json's contents, in hexadecimal: what is claimed, and of what.

    The digest itself is no part of it, and neither are the kernel's words: whoever has the proof can have it checked again. What `tube` says follows
    from the claims.
    """
    claims = [{key: value for key, value in claim.items() if key not in KERNEL_KEYS} for claim in data["claims"]]
    payload = {key: value for key, value in {**data, "claims": claims}.items() if key not in ("digest", "kernel", "tube")}
    text = json.dumps(payload, sort_keys=True, allow_nan=False, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
