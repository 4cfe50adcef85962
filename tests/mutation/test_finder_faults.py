"""Whatever proof a faulty finder, or a faulty checker, writes down: the kernel refuses it, or what it claims is so."""

from __future__ import annotations

import importlib
import json
import random
from collections.abc import Callable
from fractions import Fraction
from functools import cache
from typing import Any, NamedTuple

import pytest

from tests.helpers.bounded_work import TooLong, within
from tests.helpers.kernel.kernel_words import kernel_statement, kernel_timeline
from tests.helpers.kernel.proofs import checked, tables, untrue
from tests.helpers.missions.random_teams import random_formula, short_timeline
from tests.helpers.motion.small_flights import FLIGHTS, small_flight, spoiled
from tests.helpers.words.brute_force import Timed, outcomes
from tests.helpers.words.timelines import mission
from tests.mutation.sites import Fault, draw
from tests.mutation.swapped import swapped
from verify import judge
from verify.certificate import Certificate
from verify.data.errors import LtlplanError
from verify.data.plan import Plan
from verify.data.trajectory import Trajectory
from verify.kernel.statement import Refused
from verify.kernel.trees import Evidence
from verify.kernel.words import check_words
from verify.kernel.words import flown as words_of
from verify.proofs.finder import prove
from verify.proofs.statement import statement_of

SECONDS = 1.0
"""Processor time that one proof may take."""
CHECKER = ("verify.motion", "verify.model_checking", "verify.claims", "verify.certification")
"""What finds out what a certificate says."""

JUDGING = (
    "verify/certification.py",
    "verify/claims",
    "verify/motion/visits.py",
    "verify/motion/limits.py",
    "verify/motion/membership",
    "verify/motion/passages.py",
)
"""Modules of it that faults are planted in."""


class Flown(NamedTuple):
    """A flight, and what the judge says of it."""

    plan: Plan
    team: dict[str, Trajectory]
    files: dict[str, str]
    certificate: Certificate

    def wrongly_checked(self, proof: Any) -> list[Any]:
        """Return what the kernel says yes to, and the judge does not; nothing where `recheck` refuses the statement."""
        if proof.statement != statement_of(self.plan, self.certificate):
            return []
        try:
            return untrue(checked(proof.statement, proof.evidence, self.files), self.certificate)
        except Refused:
            return []


class Words(NamedTuple):
    """What a team may show, and whether all of it satisfies a formula."""

    statement: Any
    lines: Any
    is_so: bool


@cache
def flights(each: int) -> list[Flown]:
    """Return true flights and false ones, by each of how many names."""
    rng, found = random.Random(3), list[Flown]()
    for name in list(FLIGHTS)[::each]:
        plan, team = small_flight(name)
        for one in (team, rng.choice(list(spoiled(team, rng)))):
            try:
                found.append(Flown(plan, one, tables(plan, one), judge(plan, one, largest=False)))
            except LtlplanError:  # laps that do not end together
                continue
    return found


@cache
def words() -> list[Words]:
    """Return small teams, by brute force."""
    rng, found = random.Random(4), list[Words]()
    while len(found) < 40:
        robots = ("q0", "q1")[: rng.choice([1, 2])]
        formula, reading = random_formula(rng, rng.randint(2, 6)), rng.choice(["own", "joint"])
        lines = {robot: short_timeline(rng, robot, touching=rng.random() < 0.3) for robot in robots}
        statement = kernel_statement(mission(str(formula), team=reading, robots=len(robots)), Fraction(0))
        is_so = outcomes(formula, robots, Timed(lines, reading, 0)) == {True}
        if sum(one.is_so == is_so for one in found) < 20:
            found.append(Words(statement, {name: kernel_timeline(line) for name, line in lines.items()}, is_so))
    return found


class Compared(NamedTuple):
    """How many proofs are others than without a fault, what the kernel wrongly says yes to, and whether one took too long."""

    others: int
    wrong: list[str]
    too_long: bool


def compared(each: int, find: Callable[[Flown], Any], wrongly: Callable[[Flown, Any], list[Any]]) -> Compared:
    """Compare proofs that are found with a fault with those that are found without."""
    others, wrong = 0, list[str]()
    for flown, honest in zip(flights(each), honest_proofs(each), strict=True):
        try:
            proof = find(flown)
        except TooLong:  # no proof comes out, of others neither
            return Compared(others + 1, wrong, True)
        except Exception:  # of whatever kind: code with a fault may raise anything, and then no proof comes out
            others += 1
            continue
        if (proof.statement, proof.evidence) != (honest.statement, honest.evidence):
            others += 1
            wrong += map(str, wrongly(flown, proof))
    return Compared(others, wrong, False)


def tried(fault: Fault, each: int) -> tuple[int, list[str]]:
    """Return how many proofs a finder with a fault writes down that it would not have written, and what the kernel wrongly says yes to."""
    with swapped(fault, "verify.proofs"):
        try:
            finder, search = (importlib.import_module(f"verify.proofs.{name}") for name in ("finder", "words"))
        except Exception:  # of whatever kind: code with a fault may not even load, and then no proof comes out
            return len(flights(each)), []
        others, wrong, too_long = compared(
            each,
            lambda flown: within(SECONDS, lambda: finder.prove(flown.plan, flown.team, flown.certificate)),
            lambda flown, proof: within(10 * SECONDS, lambda: flown.wrongly_checked(proof)),
        )
        for one in () if too_long else words():
            try:
                evidence = within(
                    SECONDS, lambda one=one: json.loads(json.dumps(search.find_formula(one.statement, one.lines)))
                )
                within(
                    SECONDS,
                    lambda one=one, evidence=evidence: check_words(words_of(one.statement, one.lines), Evidence(evidence)),
                )
            except TooLong:
                return others, wrong
            except Exception:  # as above, or refused
                continue
            wrong += [] if one.is_so else [str(one.statement.formula)]
    return others, wrong


def judged_by(fault: Fault, each: int) -> tuple[int, list[str]]:
    """Return the same of a checker with a fault, whose certificates are proved."""
    with swapped(fault, *CHECKER):
        certification = importlib.import_module("verify.certification")

        def proof(flown: Flown) -> Any:
            certificate = within(SECONDS, lambda: certification.judge(flown.plan, flown.team, largest=False))
            return within(SECONDS, lambda: prove(flown.plan, flown.team, certificate))

        others, wrong, _ = compared(each, proof, untrue_claims)
    return others, wrong


def untrue_claims(flown: Flown, proof: Any) -> list[Any]:
    """Return what the kernel says yes to and the real judge does not, of other instants of actions, too."""
    try:
        return untrue(checked(proof.statement, proof.evidence, flown.files), flown.certificate)
    except Refused:
        return []


@cache
def honest_proofs(each: int) -> list[Any]:
    return [prove(one.plan, one.team, one.certificate) for one in flights(each)]


@pytest.mark.slow
@pytest.mark.parametrize(("number", "each"), [(2, 7), (200, 1)])
def test_no_faulty_finder_makes_the_kernel_say_a_wrong_yes(number: int, each: int) -> None:
    """Faults of what finds; not of `proof_folder`, which reads and writes files."""
    drawn = [fault for fault in draw(None, 1, "verify/proofs", wide=True) if not fault.path.endswith("proof_folder.py")]
    found = {fault.name: tried(fault, each) for fault in drawn[:number]}
    assert {name: wrong for name, (_, wrong) in found.items() if wrong} == {}
    assert sum(others > 0 for others, _ in found.values()) > number // 3, "most faults change some proof"


@pytest.mark.slow
def test_no_faulty_checker_makes_the_kernel_say_a_wrong_yes() -> None:
    """Faults of what a certificate says and a statement repeats: outcomes, instants of actions, bounds on speed."""
    found = {fault.name: judged_by(fault, 1) for fault in draw(60, 1, *JUDGING, wide=True)}
    assert {name: wrong for name, (_, wrong) in found.items() if wrong} == {}
