"""Proofs of flights, put to the kernel as texts."""

from __future__ import annotations

from collections.abc import Mapping

from verify.certificate import Certificate
from verify.data.files.trajectory_csv import write_csv
from verify.data.plan import Plan
from verify.data.trajectory import Trajectory
from verify.kernel.checking import Check, Checked
from verify.kernel.flights import read_team
from verify.kernel.statement import read_statement
from verify.kernel.trees import read_evidence


def tables(plan: Plan, team: Mapping[str, Trajectory]) -> dict[str, str]:
    """Return the robots' CSV files."""
    return {name: write_csv(path, plan.mission.spec.repeat) for name, path in team.items()}


def checked(statement: str, evidence: str, files: Mapping[str, str]) -> list[Checked]:
    """Have the kernel check texts."""
    read = read_statement(statement)
    claims = Check(read, read_team(read, files), read_evidence(evidence)).claims()
    assert not any("cannot follow" in claim.missing for claim in claims)
    return claims


def missing(claims: list[Checked]) -> set[str]:
    """Return the names of the claims that are not checked."""
    return {claim.name for claim in claims if claim.missing}


def untrue(claims: list[Checked], certificate: Certificate) -> list[Checked]:
    """Return the claims that the kernel has checked, and the judge does not prove; those of which there are several are told by their count."""
    refused = {(c.name, *sorted(filter(None, (c.robot, c.other)))) for c in certificate.claims if c.outcome != "holds"}
    checked = [c for c in claims if not c.missing]
    found = [c for c in checked if not _several(c.name) and (c.name, *sorted(c.robots)) in refused]
    for name, *robots in {(c.name, *sorted(c.robots)) for c in checked if _several(c.name)}:
        held = [c for c in certificate.claims if (c.name, *sorted(filter(None, (c.robot, c.other)))) == (name, *robots)]
        alike = [c for c in checked if (c.name, *sorted(c.robots)) == (name, *robots)]
        found += alike[sum(c.outcome == "holds" for c in held) :]
    return found


def _several(name: str) -> bool:
    return name in ("precedences", "timing") or name.startswith("limits.legs.")
