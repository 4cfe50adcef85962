"""A plugin for pytest: of each flight that a test has judged, the kernel says yes to no claim that the judge refuses.

It is shown four proofs: the one that is found for the flight; one with invariants of words at whose end nobody looked; the same with trees that say
everywhere what they say anywhere; and the proof of the flight that was judged before. The last line of the output counts what was refused.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

import pytest

import verify.certification as certification
from tests.helpers.kernel.proofs import tables, untrue
from verify.certificate import Certificate
from verify.data.errors import LtlplanError
from verify.data.plan import Plan
from verify.data.trajectory import Trajectory
from verify.kernel.checking import Check
from verify.kernel.flights import read_team
from verify.kernel.statement import Refused, read_statement
from verify.kernel.team import Team
from verify.kernel.trees import read_evidence
from verify.proofs.finder import Proof, prove

_real = certification.judge
refused: Counter[str] = Counter()
last: list[Proof] = []


def judge(plan: Plan, team: Mapping[str, Trajectory], **options: Any) -> Certificate:
    """Judge a flight, and have the kernel look at proofs of it."""
    certificate = _real(plan, team, **options)
    for evidence, files in proofs(plan, team, certificate):
        try:
            statement = read_statement(evidence.statement)
            claims = Check(statement, read_team(statement, files), read_evidence(evidence.evidence)).claims()
        except Refused:
            continue
        assert not any("cannot follow" in claim.missing for claim in claims)
        wrong = untrue(claims, certificate)
        if len(certificate.actions) < sum(len(visit.actions) for robot in plan.robots.values() for visit in robot.visits):
            wrong = [
                claim for claim in wrong if claim.name != "visits"
            ]  # a statement has no actions for which there is no instant
        assert wrong == []
    refused.update(claim.name for claim in certificate.claims if claim.outcome != "holds")
    refused["flights"] += not certificate.holds
    return certificate


def proofs(plan: Plan, team: Mapping[str, Trajectory], certificate: Certificate) -> Iterator[tuple[Proof, dict[str, str]]]:
    """Yield proofs of a flight; none where it cannot be written down."""
    try:
        files, honest = tables(plan, team), prove(plan, team, certificate)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Team, "may_end", lambda self, state: False)
            careless = prove(plan, team, certificate)
    except (LtlplanError, Refused):  # numbers that are no float32, or absurd ones
        return
    yield honest, files
    table = json.loads(careless.evidence)
    for key, value in table["evidence"].items():
        if isinstance(value, str):
            marks = sorted(set(re.sub(r"[\d?s]", "", value))) or ["m"]
            table["evidence"][key] = f"99999{marks[-1]}"
    yield Proof(honest.statement, json.dumps(table)), files
    yield Proof(honest.statement, careless.evidence), files
    if last:
        yield Proof(honest.statement, last[0].evidence), files
    last[:] = [honest]


def pytest_configure() -> None:
    """Put this judge in the other's place, before tests import it."""
    certification.judge = judge


def pytest_terminal_summary(terminalreporter: Any) -> None:
    terminalreporter.write_line(f"kernel: {json.dumps(refused)}")
