"""The finder of proofs: what the judge proved, written down for the kernel."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from verify.certificate import Certificate
from verify.data.files.trajectory_csv import write_csv
from verify.data.plan import Plan
from verify.data.trajectory import Trajectory
from verify.kernel.checking import Check, Checked
from verify.kernel.flights import read_team
from verify.kernel.refused import Refused
from verify.kernel.statement import read_statement
from verify.proofs.bridges import bridges
from verify.proofs.half_space_sums import half_space_sums
from verify.proofs.search import Search, proof_text
from verify.proofs.statement import statement_of
from verify.proofs.words import find_formula, find_ordered

_ROOM = 1.005
"""Share of a proved speed that is asked of the kernel: the nearer to the greatest speed, the more a proof has to say."""

_GRID = 4096
"""Speeds are rounded up to 1 / _GRID m/s."""


@dataclass(frozen=True, slots=True)
class Proof:
    """Files that the kernel reads beside the trajectories.

    Attributes:
        statement: Text of statement.json.
        evidence: Text of proof.json.
        checked: How many of the claims the kernel checked while the proof was sought.
        claims: How many claims the statement owes.
    """

    statement: str
    evidence: str
    checked: int
    claims: int


def prove(plan: Plan, team: Mapping[str, Trajectory], certificate: Certificate) -> Proof:
    """Write down a proof of what a certificate claims, as far as one is found.

    Args:
        plan: What was planned.
        team: The trajectories that were certified.
        certificate: What was proved of them.

    Raises:
        BadInput: The trajectories' numbers are not float32.
    """
    tables = {name: write_csv(path, plan.mission.spec.repeat) for name, path in team.items()}
    return prove_statement(statement_of(plan, certificate), tables, _speeds(certificate))


def prove_statement(text: str, tables: Mapping[str, str], speeds: Mapping[str, Fraction]) -> Proof:
    """Write down a proof of a statement, as far as one is found.

    Args:
        text: Of the statement.
        tables: Each robot's CSV file.
        speeds: Bounds that the kernel is asked to check, m/s, by "speed/" and the robot's name.
    """
    statement = read_statement(text)
    flown = read_team(statement, tables)
    given: dict[str, Any] = {**speeds, **half_space_sums(statement, flown), **bridges(statement)}
    search = Search(given)
    check = Check(statement, flown, search)
    with suppress(Refused):  # without timelines there is nothing to say of words
        search.give(find_formula(statement, check.timelines(), check.relations()))
    with suppress(Refused):
        search.give(find_ordered(statement))
    claims: list[Checked] = []
    for owed in check.owed():
        claim = owed.judge()
        if claim.missing and owed.name == "separation":
            search.look_at_all_times(*owed.robots)
            claim = owed.judge()
        claims.append(claim)
    evidence = search.evidence()
    return Proof(text, proof_text(evidence), sum(not claim.missing for claim in claims), len(claims))


def _speeds(certificate: Certificate) -> dict[str, Fraction]:
    """Return bounds on speeds that the kernel is asked to check, a little above those that were proved."""
    found: dict[str, Fraction] = {}
    for claim in certificate.claims:
        if claim.name == "limits.speed" and claim.robot is not None and claim.bound is not None and claim.limit is not None:
            found[f"speed/{claim.robot}"] = min(Fraction(claim.limit), Fraction(math.ceil(claim.bound * _ROOM * _GRID), _GRID))
    return found
