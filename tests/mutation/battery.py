"""What a kernel has to say of some hundred small folders and words, true ones and false ones: by their proofs, and by what is found with it itself."""

from __future__ import annotations

import importlib
import inspect
import itertools
import json
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

import pytest

from tests.helpers.bounded_work import TooLong, within
from tests.helpers.kernel.kernel_opinion import proofs
from tests.helpers.kernel.kernel_words import kernel_statement, kernel_timeline
from tests.helpers.kernel.proofs import tables
from tests.helpers.missions.random_teams import lap_timeline, random_formula, short_timeline
from tests.helpers.motion.flights import firefighting
from tests.helpers.motion.small_flights import FLIGHTS, small_flight, spoiled
from tests.helpers.words.random_counts import random_counting_formula
from tests.helpers.words.timelines import mission
from tests.mutation.sites import Fault
from tests.mutation.swapped import swapped
from tests.verify.kernel.test_false_certificates import EDITS
from tests.verify.kernel.test_false_certificates import FLIGHTS as FALSE_FLIGHTS
from tests.verify.kernel.test_refused import FALSE, UNREADABLE, changed
from verify import judge
from verify.data.errors import LtlplanError
from verify.data.language.counting import written_out
from verify.proofs.finder import prove
from verify.proofs.formula_tree import tree_of

MOST_LETTERS = 10_000
"""Of the text of a proof of words; longer ones take too long."""
Claims = list[tuple[str, tuple[str, ...], str]]
"""Names, robots, and sentences, which are empty where a claim is not checked."""


class Kernel:
    """A kernel and a finder that uses it, as they are imported now."""

    def __init__(self) -> None:
        self.main, self.finder = (importlib.import_module(f"verify.{name}") for name in ("kernel.__main__", "proofs.finder"))
        self.words, self.team, self.trees = (
            importlib.import_module(f"verify.kernel.{name}") for name in ("words", "team", "trees")
        )
        self.search = importlib.import_module("verify.proofs.words")

    def says(self, statement: str, evidence: str, files: Mapping[str, str]) -> Claims | None:
        """Return what it says of a folder; None where it cannot be read."""
        of = self.main
        try:
            read = of.read_statement(statement)
            claims = of.Check(read, of.read_team(read, files), of.read_evidence(evidence)).claims()
        except of.Refused:
            return None
        lines = [line for line in self.main.claim_lines(claims) if line.startswith("checked")]
        shown = [*lines, *self.main.statement_lines(read), self.main.summary(claims)]
        return [*((one.name, one.robots, "" if one.missing else one.sentence) for one in claims), ("", (), "\n".join(shown))]

    def refuses(self, statement: str, evidence: str, files: Mapping[str, str], names: set[str]) -> list[bool] | None:
        """Return of all claims of some names whether they are refused; None where a folder cannot be read."""
        of = self.main
        try:
            read = of.read_statement(statement)
            check = of.Check(read, of.read_team(read, files), of.read_evidence(evidence))
            return [bool(check._judge(owed).missing) for owed in check.owed() if owed.name in names]
        except of.Refused:
            return None

    def proves(self, statement: str, files: Mapping[str, str]) -> Claims | None:
        """Return what it says of a proof that is found with it."""
        try:
            proof = self.finder.prove_statement(statement, files)
        except self.main.Refused:
            return None
        return self.says(proof.statement, proof.evidence, files)

    def accepts(self, check: Callable[..., object], *given: Any) -> bool:
        """Return whether a check of the kernel's refuses nothing."""
        try:
            check(*given)
        except self.main.Refused:
            return False
        return True

    def satisfies(self, statement: Any, lines: Any, evidence: Any) -> bool:
        """Return whether it is proved that words satisfy the formula."""
        return self.accepts(lambda: self.words.check_words(self.words.flown(statement, lines), evidence))

    def evidence(self, find: Callable[..., object], *given: Any) -> Any:
        """Return evidence that is found with it, as it is read."""
        try:
            return self.trees.Evidence(json.loads(json.dumps(find(*given))))
        except self.main.Refused:
            return self.trees.Evidence({})


Question = Callable[[Kernel], object]
"""Something that a kernel is asked."""


class Case(NamedTuple):
    """Questions about one thing, and what the real kernel says."""

    name: str
    question: Question
    says: object


class _Folder(NamedTuple):
    """A folder's texts."""

    name: str
    flight: Any
    statement: str
    evidence: str
    files: Mapping[str, str]

    def proof(self, kernel: Kernel) -> Claims | None:
        return kernel.says(self.statement, self.evidence, self.files)

    def search(self, kernel: Kernel) -> Claims | None:
        return kernel.proves(self.statement, self.files)

    def words(self, kernel: Kernel) -> list[bool]:
        """Ask about other formulas of the same flight."""
        of = kernel.main
        read = of.read_statement(self.statement)
        courses = of.Check(read, of.read_team(read, self.files), of.read_evidence(self.evidence)).courses
        lines, draw, found = {name: one.timeline for name, one in courses.items()}, random.Random(self.name), list[bool]()
        for _ in range(12):
            asked = read._replace(joint=draw.random() < 0.5, formula=_asked(draw, [*read.regions], [*read.robots]))
            if not asked.joint and any(sign in str(asked.formula) for sign in ("count", "robot")):
                continue
            evidence = kernel.evidence(kernel.search.find_formula, asked, lines)
            found.append(kernel.satisfies(asked, lines, evidence))
        return found


WORDS = ("words", "team", "formulas")
"""Modules of the kernel that only words pass through."""
TOLD_BY_ALL = ("checking", "flights", "statement", "timelines", "__main__", "__init__")
UNITS = {
    "limits": ("test_joints", "test_limits"), "trees": ("test_trees", "test_kernel_units", "test_passages"),
    "timelines": ("test_passages", "test_kernel_units", "test_false_certificates:test_sequences"), "zones": ("test_kernel_units", "test_passages", "test_bodies", "test_distances"),
    "formulas": ("test_kernel_units",), "flights": ("test_kernel_units",), "statement": ("test_kernel_units",),
    "team": ("test_kernel_units",), "words": ("test_kernel_units",), "checking": ("test_kernel_units",), "timing": ("test_timing",),
    "__init__": ("test_kernel_units:test_versions",),
}  # fmt: skip
"""Tests of single functions, by the module of the kernel that they are about."""
WORD_TESTS = (
    "test_words:test_formulas_that_are_none",
    "test_false_certificates:test_robots",
)
"""And of those in `WORDS`."""
HELPERS = ("tests.helpers.kernel.proofs", "tests.helpers.kernel.kernel_words")
"""Helpers of those tests that use the kernel."""
SECONDS = 4.0
"""Processor time that one case may take."""


def noticed_by_proofs(fault: Fault) -> bool:
    """Return whether the proofs of true flights notice a fault in the kernel."""
    known = [_of_proof(name) for name in NAMES[::3]]  # the real kernel speaks before the fault is planted
    with swapped(fault, "verify.kernel", "verify.proofs"):
        try:
            kernel = within(SECONDS, Kernel)
            return any(within(SECONDS / 4, lambda case=case: differs(kernel, case)) for case in known)
        except (Exception, TooLong):
            return True


def noticed(fault: Fault | None, stem: str) -> str:
    """Return what notices a fault in the kernel: a case, a test, or an error; nothing where all is as without it.

    Args:
        fault: The fault; None for the kernel as it is.
        stem: The kernel's module that is loaded with it.
    """
    tests = [f"tests.verify.kernel.{name}" for name in (*UNITS.get(stem, ()), *(WORD_TESTS if stem in WORDS else ()))]
    flights, others = _of_flights(), cases(stem)  # as above
    with swapped(fault, "verify.kernel", "verify.proofs", *HELPERS, *(name.partition(":")[0] for name in tests)):
        try:
            kernel = within(SECONDS, Kernel)
            for case in flights:
                if (stem in WORDS or "words" not in case.name) and within(SECONDS, lambda case=case: differs(kernel, case)):
                    return case.name
            for name in tests:
                module, _, function = name.partition(":")
                if test := _failing(importlib.import_module(module), function):
                    return test
            for case in others:
                if within(SECONDS, lambda case=case: differs(kernel, case)):
                    return case.name
        except (Exception, TooLong) as error:
            return type(error).__name__
    return ""


def cases(stem: str) -> list[Case]:
    """Return the cases that a fault in a module may change, those of true flights aside."""
    about_words, about_all = stem in WORDS, stem in TOLD_BY_ALL
    return [
        *(_of_words() if about_words or about_all else ()),
        *(case for case in _of_flights() if not about_words and about_all and "words" in case.name),
        *_of_false_certificates(),
        *(() if about_words else _of_false_flights()),
        *_of_edits(),
    ]


def _failing(module: ModuleType, function: str = "") -> str:
    """Run tests of a module that need nothing but their parameters, or one of them; return the name of the first that fails."""
    for name, test in vars(module).items():
        if not name.startswith(function or "test_") or not callable(test):
            continue
        marks = [mark for mark in getattr(test, "pytestmark", []) if mark.name == "parametrize"]
        for values in itertools.product(*(mark.args[1] for mark in marks)):
            given: dict[str, Any] = {}
            slow = False
            for mark, value in zip(marks, values, strict=True):
                slow = slow or any(one.name == "slow" for one in getattr(value, "marks", ()))
                names = mark.args[0].split(",") if isinstance(mark.args[0], str) else mark.args[0]
                row = getattr(value, "values", value) if hasattr(value, "marks") else value
                given |= dict(
                    zip(map(str.strip, names), row if len(names) > 1 or hasattr(value, "marks") else (row,), strict=True)
                )
            try:
                if not slow and set(inspect.signature(test).parameters) == set(given):
                    within(5 * SECONDS, lambda given=given, test=test: test(**given))
            except (Exception, TooLong, pytest.fail.Exception):
                return name
    return ""


def differs(kernel: Kernel, case: Case) -> bool:
    """Return whether a kernel says something else than the real one."""
    return case.question(kernel) != case.says


def _case(name: str, question: Question) -> Case:
    return Case(name, question, question(_real()))


@cache
def _real() -> Kernel:
    return Kernel()


NAMES = (*FLIGHTS, "firefighting")


def _folder_of(name: str, plan: Any, team: Any) -> _Folder:
    proof = prove(plan, team, judge(plan, team, largest=False))
    return _Folder(name, (plan, team), proof.statement, proof.evidence, tables(plan, team))


@cache
def _folder(name: str) -> _Folder:
    return _folder_of(name, *(firefighting() if name == "firefighting" else small_flight(name)))


def _folders() -> list[_Folder]:
    return [_folder(name) for name in NAMES]


@cache
def _of_proof(name: str) -> Case:
    return _case(name, _folder(name).proof)


@cache
def _of_flights() -> list[Case]:
    every = [_of_proof(name) for name in NAMES]
    every += [_case(f"{one.name}, sought", one.search) for one in _folders()]
    return every + [_case(f"{one.name}, words", one.words) for one in _folders()]


@cache
def _of_words() -> list[Case]:
    """Return words of random timelines: the proof that is found for them, and for others."""
    draw, found = random.Random(7), list[Case]()
    before: Any = None
    for number in range(150):
        laps = draw.random() < 0.3
        robots = [f"q{k}" for k in range(draw.choice([1, 2] if laps else [1, 2, 2, 3]))]
        counts = draw.random() < 0.4
        formula = (
            random_counting_formula(draw, draw.randint(1, 6), tuple(robots))
            if counts
            else random_formula(draw, draw.randint(1, 6))
        )
        team, trace = "joint" if counts else draw.choice(["own", "joint"]), "infinite" if laps else "finite"
        lines = {
            one: lap_timeline(draw, one) if laps else short_timeline(draw, one, touching=draw.random() < 0.3) for one in robots
        }
        vertices = ("home", "a", "b", "c")
        edges = tuple((x, y) for x in vertices for y in vertices[1:] if x != y and draw.random() < 0.7)
        world = (
            {"environment": {"start": "home", "edges": edges}}
            if edges and not any(one.actions for one in lines.values())
            else {}
        )
        given = kernel_statement(
            mission(str(formula), team=team, robots=len(robots), trace=trace, **world), Fraction(draw.choice([0, 0, 1]))
        )
        own = {name: kernel_timeline(line) for name, line in lines.items()}
        evidence = _real().evidence(_real().search.find_formula, given, own)
        if len(str(vars(evidence))) > MOST_LETTERS:
            continue

        def ask(
            kernel: Kernel, given: Any = given, own: Any = own, evidence: Any = (evidence, before or evidence)
        ) -> list[bool]:
            found = kernel.evidence(kernel.search.find_formula, given, own)
            words = [kernel.satisfies(given, own, one) for one in (*evidence, found)]
            return words + [kernel.accepts(kernel.team.check_transitions, given, line) for line in own.values()]

        found.append(_case(f"words {number}", ask))
        before = evidence
    return found


@cache
def _of_false_flights() -> list[Case]:
    draw, found = random.Random(1), list[Case]()
    for folder in _folders():
        plan, team = folder.flight
        for other in draw.sample(list(spoiled(team, draw)), 2):
            try:
                one = _folder_of(folder.name, plan, other)
            except LtlplanError:  # laps that do not end together
                continue
            found += [
                _case(f"{one.name}, spoiled", one._replace(evidence=folder.evidence).proof),
                _case(f"{one.name}, spoiled and sought", one.search),
            ]
    return found


@cache
def _of_false_certificates() -> list[Case]:
    """Return false flights by hand, each with all proofs that somebody claims to have."""
    found: list[Case] = []
    for flight, claim in FALSE_FLIGHTS:
        plan, team = flight()
        for proof, files in proofs(plan, team, judge(plan, team, largest=False)):
            found.append(_case(claim, lambda kernel, of=(proof.statement, proof.evidence, files): kernel.says(*of)))
    return found


@cache
def _of_edits() -> list[Case]:
    draw, found = random.Random(2), list[Case]()
    for folder in _folders():
        every = [folder._replace(statement=text) for text in _edited(folder.statement, draw)]
        every += [folder._replace(evidence=_greedy(folder.evidence, draw)) for _ in range(1)]
        found += [_case(f"{one.name}, edited", one.proof) for one in every]
    known, fire = {one.name: one for one in _folders()}, _folders()[-1]
    for name, edits, _wanted in EDITS:
        one = known[name]._replace(statement=changed(known[name].statement, **edits))
        found.append(_case(f"{name}, {edits}", one.proof))
    for edits, wanted in (*FALSE, *((one, set[str]()) for one in UNREADABLE)):
        one = fire._replace(statement=changed(fire.statement, **edits))
        found.append(
            _case(
                str(edits),
                lambda kernel, one=one, wanted=wanted: kernel.refuses(one.statement, one.evidence, one.files, wanted),
            )
        )
    return found


def _asked(draw: random.Random, names: Sequence[str], robots: Sequence[str]) -> Any:
    """Return a formula over regions."""
    if draw.random() < 0.3:
        formula: Any = random_counting_formula(draw, draw.randint(1, 5), tuple(robots))
    else:
        formula = random_formula(draw, draw.randint(1, 6))
    text = json.dumps(tree_of(written_out(formula, tuple(robots))))
    for known in ("a", "b", "c", "water"):
        text = text.replace(f'["name", "{known}"]', f'["name", "{draw.choice(names)}"]')
    return json.loads(text)


def _edited(statement: str, draw: random.Random) -> Iterator[str]:
    """Yield statements with some numbers changed."""
    for _ in range(3):
        table = json.loads(statement)
        for way in draw.sample(list(_numbers(table)), 2):
            at = table
            for key in way[:-1]:
                at = at[key]
            value = at[way[-1]]
            at[way[-1]] = (
                value * draw.choice([0.5, 0.9, 1.1, 2.0]) if isinstance(value, float) else value + draw.choice([-1, 1])
            )
        yield json.dumps(table)


def _numbers(value: Any, way: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    if isinstance(value, dict | list):
        for key, one in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _numbers(one, (*way, key))
    elif type(value) in (int, float):
        yield way


def _greedy(evidence: str, draw: random.Random) -> str:
    """Return evidence whose trees claim on each part what they claim anywhere."""
    table = json.loads(evidence)
    for key, value in table["evidence"].items():
        if isinstance(value, str):
            table["evidence"][key] = f"9999{draw.choice(sorted(set(value) & set('nmkirf')) or ['m'])}"
    return json.dumps(table)
