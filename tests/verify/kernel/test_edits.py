"""Random edits of proofs, trajectories, missions and statements of small flights: no crash, no hang, and no yes that the judge denies.

`LTLPLAN_EDITS=100000 python -m pytest -n 0 -m slow tests/verify/kernel/test_edits.py` makes as many edits as one likes.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from random import Random
from typing import Any

import pytest

from tests.helpers.bounded_work import within
from tests.helpers.kernel.edits import edited, edited_text
from tests.helpers.kernel.proofs import checked, tables, untrue
from tests.helpers.motion.small_flights import FLIGHTS, small_flight, spoiled
from verify import judge
from verify.certificate import Certificate
from verify.data.errors import LtlplanError
from verify.data.files.mission_file import mission_to_yaml, parse_mission
from verify.data.files.trajectory_csv import read_csv
from verify.data.plan import Plan
from verify.data.trajectory import Trajectory
from verify.kernel.checking import Check, Checked
from verify.kernel.flights import Team, read_team
from verify.kernel.statement import Refused, Statement, read_statement
from verify.kernel.trees import Evidence, read_evidence
from verify.proofs.finder import prove
from verify.proofs.statement import statement_of

SECONDS = 20.0
"""Processor time after which the kernel counts as hanging; it needs some hundredths of a second."""
COUNT = int(os.environ.get("LTLPLAN_EDITS", "20000"))
KINDS = {"proof": 70, "text of the proof": 8, "statement": 10, "trajectory": 8, "mission": 4}
"""What is edited, and how often in a hundred times."""


class Noted(Evidence):
    """Evidence that notes what it is asked for."""

    def __init__(self, table: Mapping[str, Any]) -> None:
        super().__init__(table)
        self.asked = set[str]()

    def has(self, key: str) -> bool:
        self.asked.add(key)
        return super().has(key)

    def get(self, key: str, kind: Any) -> Any:
        self.asked.add(key)
        return super().get(key, kind)

    def marks(self, key: str) -> Any:
        self.asked.add(key)
        return super().marks(key)


@dataclass
class Flown:
    """A flight, what the judge says of it, and a proof of it or of another flight."""

    name: str
    plan: Plan
    team: dict[str, Trajectory]
    certificate: Certificate
    statement: str
    evidence: str
    files: dict[str, str]
    rests: list[tuple[Checked, set[str]]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.table = json.loads(self.evidence)["evidence"]
        self.read: Statement = read_statement(self.statement)
        self.flown: Team = read_team(self.read, self.files)
        for number in range(sum(1 for _ in self._check(Evidence(self.table)).owed())):
            evidence = Noted(self.table)
            self.rests.append((self._claim(self._check(evidence), number), evidence.asked))

    def _check(self, evidence: Evidence) -> Check:
        return Check(self.read, self.flown, evidence)

    def _claim(self, check: Check, number: int) -> Checked:
        return next(check._judge(owed) for at, owed in enumerate(check.owed()) if at == number)

    def with_proof(self, table: Mapping[str, Any], keys: set[str]) -> list[Checked]:
        """Return the claims of which the kernel looks at entries with some keys, by another proof."""
        asked = {number for number, (_, seen) in enumerate(self.rests) if seen & keys}
        check = self._check(Evidence(table))
        claims = [check._judge(owed) for number, owed in enumerate(check.owed()) if number in asked]
        assert not any("cannot follow" in claim.missing for claim in claims)
        return claims


@cache
def flights(each: int = 1) -> list[Flown]:
    """Return true flights with their proofs, by each of how many names; false ones with the proof of a true one, and with their own."""
    rng, found = Random(1), list[Flown]()
    for name in list(FLIGHTS)[::each]:
        plan, team = small_flight(name)
        truth = judge(plan, team, largest=False)
        proof, files = prove(plan, team, truth), tables(plan, team)
        found.append(Flown(name, plan, team, truth, proof.statement, proof.evidence, files))
        for other in rng.sample(list(spoiled(team, rng)), 2):
            try:
                certificate = judge(plan, other, largest=False)
            except LtlplanError:  # laps that do not end together
                continue
            own, files = prove(plan, other, certificate), tables(plan, other)
            evidence = rng.choice([proof, own]).evidence
            found.append(Flown(name, plan, other, certificate, own.statement, evidence, files))
    return found


def of_proof(rng: Random, flown: Flown) -> list[Checked]:
    """Edit entries of a proof: marks letter by letter, all else in its structure; or give one robot's or region's to another."""
    table, keys = dict(flown.table), set[str]()
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        key = rng.choice([*table])
        other = rng.choice([*table])
        value = table[key]
        if rng.random() < 0.1:
            table[key] = table[other]
        elif isinstance(value, str) and value and rng.random() < 0.9:
            table[key] = edited_text(value, rng)
        elif isinstance(value, float) and rng.random() < 0.8:
            table[key] = value * rng.choice([0.0, 0.5, 0.99, 1.01, 2.0, -1.0])
        else:
            table[key] = edited(rng, value)
        keys.add(key)
    text = json.dumps({**json.loads(flown.evidence), "evidence": table})
    return flown.with_proof(read_evidence(text)._table, keys)


def of_proof_text(rng: Random, flown: Flown) -> list[Checked]:
    return checked(flown.statement, edited_text(flown.evidence, rng), flown.files)


def of_statement(rng: Random, flown: Flown) -> list[Checked]:
    """Edit a statement, of which nobody but `recheck` knows whether it is the mission's: it is read, or refused."""
    by_letters = rng.random() < 0.4
    text = edited_text(flown.statement, rng) if by_letters else json.dumps(edited(rng, json.loads(flown.statement)))
    claims = checked(text, flown.evidence, flown.files)
    return claims if json.loads(text) == json.loads(flown.statement) else []


def edited_table(rng: Random, text: str) -> str:
    """Edit a trajectory's file: a number, some letters, a line."""
    lines = text.splitlines()
    at, kind = rng.randrange(1, len(lines)), rng.random()
    if kind < 0.7:
        cells = lines[at].split(",")
        cell = rng.choice([0, *range(33)])
        value = float(cells[cell])
        change = rng.choice([0.0, 0.999, 1.0001, 1.01, -1.0, 2.0]) if value else 0.0
        cells[cell] = repr(value * change + (0.0 if value else rng.gauss(0, 1) * 10.0 ** rng.randrange(-7, 1)))
        lines[at] = ",".join(cells)
    elif kind < 0.85:
        other = rng.randrange(1, len(lines))
        lines[at], lines[other] = lines[other], lines[at]
        if rng.random() < 0.3:
            lines.pop()
    else:
        return edited_text(text, rng)
    return "\n".join(lines) + "\n"


def of_trajectory(rng: Random, flown: Flown) -> tuple[Certificate | None, list[Checked]]:
    name = rng.choice([*flown.files])
    files = {**flown.files, name: edited_table(rng, flown.files[name])}
    claims = checked(flown.statement, flown.evidence, files)
    team = {one: read_csv(text, one) for one, text in files.items()}
    team = {
        one: Trajectory(path.durations, path.coefficients, cycle=flown.team[one].cycle, cuts=flown.team[one].cuts)
        for one, path in team.items()
    }
    lap = {one: flown.team[one].cycle for one in team}
    repeat = flown.plan.mission.spec.repeat
    for one, path in team.items():  # of laps the files hold all, the judge is given one
        if lap[one] is not None:
            size = lap[one] + (len(path.durations) - lap[one]) // repeat
            team[one] = Trajectory(path.durations[:size], path.coefficients[:size], cycle=lap[one])
    return judge(flown.plan, team, largest=False), claims


def of_mission(rng: Random, flown: Flown) -> tuple[Certificate | None, list[Checked]]:
    lines = mission_to_yaml(flown.plan.mission).splitlines()
    numbers = [k for k, line in enumerate(lines) if any(c.isdigit() for c in line.partition(":")[2]) and "format" not in line]
    at = rng.choice(numbers)
    lines[at] = changed_number(rng, lines[at])
    mission = parse_mission("\n".join(lines) + "\n")
    plan = flown.plan.changed(mission=mission)
    certificate = judge(plan, flown.team, largest=False)
    evidence = prove(plan, flown.team, certificate).evidence if rng.random() < 0.5 else flown.evidence
    return certificate, checked(statement_of(plan, certificate), evidence, flown.files)


def changed_number(rng: Random, line: str) -> str:
    """Change one of the numbers behind a key."""
    head, _, tail = line.partition(":")
    parts = tail.replace("[", " [ ").replace("]", " ] ").replace(",", " , ").replace("}", " } ").split()
    places = [k for k, part in enumerate(parts) if part.lstrip("-").replace(".", "", 1).isdigit()]
    if places:
        k = rng.choice(places)
        parts[k] = repr(float(parts[k]) * rng.choice([0.5, 0.9, 0.999, 1.001, 1.1, 2.0]) + rng.choice([0.0, 0.0, 0.01, -0.01]))
    return f"{head}: {' '.join(parts)}"


def assert_no_wrong_yes(rng: Random, found: Counter[str], each: int = 1) -> None:
    flown = rng.choice(flights(each))
    (kind,) = rng.choices([*KINDS], [*KINDS.values()])
    certificate: Certificate | None = flown.certificate
    try:
        if kind == "trajectory":
            certificate, claims = of_trajectory(rng, flown)
        elif kind == "mission":
            certificate, claims = of_mission(rng, flown)
        else:
            claims = {"proof": of_proof, "text of the proof": of_proof_text, "statement": of_statement}[kind](rng, flown)
    except (Refused, LtlplanError):
        found[f"{kind}: refused"] += 1
        return
    found[f"{kind}: checked"] += sum(not claim.missing for claim in claims)
    found[f"{kind}: not checked"] += sum(bool(claim.missing) for claim in claims)
    assert certificate is not None
    assert untrue(claims, certificate) == [], kind


@pytest.mark.slow
def test_an_edit_by_which_a_stay_was_hidden() -> None:
    """The path jumps, so that it may brush by its region before it visits it; the proof, of the path without the jump, left it open."""
    assert_no_wrong_yes(Random(46600), Counter())


@pytest.mark.slow  # edited proofs, statements and flights of `test_refused` run by default
@pytest.mark.parametrize(("count", "each"), [(75, 4), (COUNT, 1)])
def test_edited_files_are_refused_or_true(count: int, each: int) -> None:
    found = Counter[str]()
    for seed in range(count):
        try:
            within(SECONDS, lambda seed=seed: assert_no_wrong_yes(Random(seed), found, each))
        except BaseException as error:
            error.add_note(f"edit {seed}")
            raise
    print(sum(found.values()), found)
    for kind in KINDS:
        assert found[f"{kind}: refused"] + found[f"{kind}: not checked"] > 0, kind
    assert min(found["proof: checked"], found["proof: not checked"]) > count // 10
