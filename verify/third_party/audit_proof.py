"""Proofs of audits: what holds of others' flights, stated for the kernel, and the kernel's words on the audit's claims.

A statement always has all that a mission has. What an audit does not ask stands in it as a limit that no flight reaches; what the kernel says of
that is no part of the audit. Only what the audit proved is stated.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from verify.checked_claims import checked_files, with_word
from verify.claims.claim import Claim, figures
from verify.data.files.trajectory_csv import write_csv
from verify.data.mission import Mission
from verify.kernel.flights import MOST_PIECES
from verify.kernel.statement import FORMAT, LARGEST, Refused
from verify.motion.continuity import JUMPS
from verify.proofs.finder import prove_statement
from verify.proofs.formula_tree import formula_tree
from verify.proofs.proof_folder import KERNEL_FILE, ProofVerdict, kernel_archive
from verify.proofs.search import PROOF_FILE
from verify.proofs.statement import STATEMENT_FILE, body_table, statement_text
from verify.third_party.audit_requirements import Asked
from verify.third_party.fleet import Fleet
from verify.third_party.letters import stays
from verify.third_party.rounded_paths import RoundedPaths, rounded_paths

MOST_WORK = 10_000_000
"""Pairs of drones, times the pieces of one, that are stated: the kernel looks at each pair of pieces that share some time."""

_UNASKED = float(LARGEST)
_UPRIGHT = 1.57
"""rad; a greater tilt cannot be stated."""

_KERNEL = {
    "workspace": "workspace", "height": "workspace", "altitude": "workspace", "separation": "separation", "continuity": "continuity",
    "limits.speed": "limits.speed", "limits.acceleration": "limits.acceleration", "formula": "formula", "obstacles": "obstacles", "rims": "rims",
}  # fmt: skip
"""Claims of the kernel that claims of an audit come to."""

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_. -]{0,99}\Z")

Table = dict[str, Any]  # of any type: JSON nests


@dataclass(frozen=True, eq=False, slots=True)
class AuditProof:
    """The proof of an audit.

    Attributes:
        claims: The audit's, with the kernel's words.
        verdict: Of the kernel.
        files: The proof, by file name, with the trajectories that it is of.
        note: What of the flights the proof leaves to the audit, as a sentence; empty where nothing.
    """

    claims: tuple[Claim, ...]
    verdict: ProofVerdict
    files: Mapping[str, bytes]
    note: str = ""


def require_statable(fleet: Fleet) -> None:
    """Refuse flights of which no proof can be written.

    Args:
        fleet: The drones.

    Raises:
        Refused: The kernel cannot read them, or there are too many.
    """
    drones, pieces = len(fleet), int(np.diff(fleet.first).max())
    if odd := [name for name in fleet.names if not _NAME.match(name)]:
        raise Refused(f"the kernel reads no file named {odd[0]!r}.")
    if pieces > MOST_PIECES or drones * (drones - 1) // 2 * pieces > MOST_WORK:
        raise Refused(f"{drones} drones of up to {pieces} pieces are too many for the kernel.")


def prove_audit(fleet: Fleet, asked: Asked, mission: Mission | None, claims: Sequence[Claim]) -> AuditProof:
    """Write down a proof of what holds, and have the kernel check the files as they are written.

    Args:
        fleet: The drones; `require_statable` lets them pass.
        asked: What was asked of them.
        mission: Whose agents they are, or None.
        claims: What was found.

    Raises:
        Refused: The kernel cannot read a number.
    """
    claims = tuple(claims)
    named, refused = {claim.name for claim in claims}, {claim.name for claim in claims if claim.outcome != "holds"}
    has_words = bool(named & {"formula", "rims", "obstacles"})
    own_mission, separation_z = mission if has_words else None, mission.separation_z if mission else None
    stated = _Stated(fleet, rounded_paths(fleet), asked, own_mission, frozenset(named - refused), separation_z)
    tables = {name: write_csv(path) for name, path in stated.rounded.paths.items()}
    proof = prove_statement(statement_text(stated.table()), tables)
    texts = {
        STATEMENT_FILE: proof.statement,
        PROOF_FILE: proof.evidence,
        **{f"{name}.csv": text for name, text in tables.items()},
    }
    files = {**{name: text.encode() for name, text in texts.items()}, KERNEL_FILE: kernel_archive()}
    verdict = checked_files(files)
    return AuditProof(tuple(stated.with_word(claim, verdict) for claim in claims), verdict, files, stated.note)


@dataclass(frozen=True, eq=False, slots=True)
class _Stated:
    """Statement about a fleet.

    Attributes:
        fleet: The drones.
        rounded: Their paths in numbers that the kernel reads.
        asked: What was asked of them.
        mission: Whose agents they are, where its regions or obstacles matter to a claim; else None.
        held: Names of the claims all of which hold.
        separation_z: By which of its lengths distances in z count, or None.
    """

    fleet: Fleet
    rounded: RoundedPaths
    asked: Asked
    mission: Mission | None
    held: frozenset[str]
    separation_z: float | None

    @property
    def margin(self) -> float:
        """Margin around the rounded paths, in which all is that is within the audit's margin of the drones' own, m."""
        whole = self.asked.margin + self.rounded.off
        return float(whole) if Fraction(float(whole)) >= whole else math.nextafter(float(whole), math.inf)

    @property
    def note(self) -> str:
        """Claims that the proof leaves to the audit, as a sentence."""
        if not self.rounded.off:
            return ""
        return (
            f"The proof is of float32 paths that are within {figures(float(self.rounded.off), 3, up=True)} m of the show's at every time, at a margin that is larger by that; "
            "the kernel says nothing of the show's speeds and accelerations."
        )

    def table(self) -> Table:
        """Return the statement."""
        mission, names = self.mission, self.fleet.names
        low, high = self._box()
        visits = {} if mission is None else stays(mission, self.fleet, Fraction(self.margin))
        return {
            "format": FORMAT,
            "name": self.fleet.source if mission is None else mission.name,
            "digests": {"flights": self.fleet.digest, **({} if mission is None else {"mission": mission.digest()})},
            "lasso": False, "repeat": 1,
            "joint": mission is not None and mission.spec.team == "joint",
            "formula": formula_tree(mission) if mission is not None and "formula" in self.held else ["true"],
            "sequence": None,
            "margin": self.margin, "clock_error": 0.0,
            "separation": float(self.asked.separation or 0.0) if self._apart else 0.0,
            "separation_z": self.separation_z if self._apart else None,
            "low": low, "high": high,
            "regions": {} if mission is None else {name: body_table(region) for name, region in mission.all_regions.items()},
            "obstacles": {} if mission is None else {name: body_table(obstacle) for name, obstacle in mission.obstacles.items()},
            "robots": {name: self._robot(drone, visits.get(name, [])) for drone, name in enumerate(names)},
            "waits": [], "words": {},
        }  # fmt: skip

    @property
    def _apart(self) -> bool:
        """Return whether the separation holds, and can be stated as it was asked."""
        asked, weight = self.asked, Fraction(1)
        if self.separation_z is not None:
            weight = Fraction(asked.separation or 0.0) / Fraction(self.separation_z)
        return "separation" in self.held and asked.above is None and weight == asked.weight

    def _box(self) -> tuple[list[float], list[float]]:
        """Return the corners of the box in which the drones are proved to stay."""
        low, high = [-_UNASKED] * 3, [_UNASKED] * 3
        if self.asked.workspace is not None and "workspace" in self.held:
            low, high = list(self.asked.workspace.min), list(self.asked.workspace.max)
        if self.asked.min_height is not None and "height" in self.held:
            low[2] = max(low[2], self.asked.min_height)
        if self.asked.altitude is not None and "altitude" in self.held:
            high[2] = min(high[2], self.asked.altitude)
        return low, high

    def speed(self, drone: int) -> float:
        """Return the speed that a drone keeps, m/s."""
        return self._rate("limits.speed", drone)

    def _rate(self, name: str, drone: int) -> float:
        if self.rounded.off:
            return _UNASKED
        limits = [float(rate.limits[drone]) for rate in self.asked.rates if rate.name == name and name in self.held]
        return min([*limits, _UNASKED])

    def _robot(self, drone: int, visits: Sequence[str]) -> Table:
        name = self.fleet.names[drone]
        letter = () if self.mission is None else self.mission.initial_letter(name)
        limits = {
            "speed": self.speed(drone), "acceleration": self._rate("limits.acceleration", drone), "thrust_min": 1 / _UNASKED,
            "thrust_max": _UNASKED, "rotor_thrust_min": 0.0, "rotor_thrust_max": _UNASKED, "tilt": _UPRIGHT, "body_rate": _UNASKED,
            "yaw_rate": _UNASKED,
        }  # fmt: skip
        return {
            "radius": max(float(self.asked.radii[drone]), 1 / _UNASKED), "mass": 1.0, "arm": 1.0, "inertia": [1.0, 1.0, 1.0], "torque_to_thrust": 1.0,
            "limits": limits, "legs": {}, "endurance": None, "pieces": None,
            "start": self.rounded.paths[name].coefficients[0, :3, 0].tolist(), "yaw": 0.0, "end": None,
            "edges": None, "vertex": "", "closed": [],
            "initial": "as at the start", "states": {"as at the start": sorted(letter)}, "actions": [],
            "visits": [{"region": region, "direction": None} for region in visits], "cycle_visit": None, "changes": [],
            "cycle": None, "cuts": [],
        }  # fmt: skip

    def with_word(self, claim: Claim, verdict: ProofVerdict) -> Claim:
        """Return a claim with the kernel's word: of all drones, or of the robot of its own."""
        if claim.outcome != "holds":
            return replace(claim, proof="judged")
        kind, own = _KERNEL.get(claim.name), (claim.robot,) if claim.name in ("obstacles", "rims") else None
        rows = [one.missing for one in verdict.claims if one.name == kind and own in (None, one.robots)]
        return with_word(claim, rows if self._is_stated(claim) else [])

    def _is_stated(self, claim: Claim) -> bool:
        """Return whether what the statement says of a claim's kind is at least what the claim says."""
        if claim.name in ("limits.speed", "limits.acceleration"):
            return not self.rounded.off
        if claim.name == "continuity":  # of places more is always allowed than by the kernel
            return not self.rounded.off and self.asked.velocity_jump >= JUMPS[1]
        if not self.fleet.columns:
            return claim.name != "separation" or self._apart
        # take-off and landing outside of paths are the audit's alone: a part of these claims, or one of no drone's
        return claim.name not in ("workspace", "height") and (
            claim.name != "separation" or (self._apart and claim.robot is not None)
        )
