"""Coq's proofs of the kernel's rules: they build, rest on no axioms but the reals', and their extracted checkers agree with Python's."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise, product
from math import comb
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import verify
from tests.helpers import proof_rules as rules
from tests.helpers.proved_checkers import (
    REALS,
    ask,
    build_checkers,
    build_proofs,
    formula,
    listed,
    numbers,
    system_case,
    team_case,
    tree_case,
    word_case,
)
from verify.kernel.formulas import Table, conjuncts
from verify.kernel.labels import Relations, Span, Timeline
from verify.kernel.refused import Refused
from verify.kernel.team import Claim, Team
from verify.kernel.words import Configuration, check_invariant, read_invariant
from verify.proofs.words import find_formula

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("coqc") is None, reason="needs Coq: apt-get install coq"),
]
NAMES = "abc"
TRAPS = {
    "joint": (
        "F(a & b) | F(!a & !b)",
        ("|", ("U", ("t",), ("&", ("a", 0), ("a", 1))), ("U", ("t",), ("!", ("|", ("a", 0), ("a", 1))))),
    ),
    "own": ("!b U a", ("U", ("!", ("a", 1)), ("a", 0))),
}


@pytest.fixture(scope="module")
def proofs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, set[str]]]:
    folder = tmp_path_factory.mktemp("coq") / "proofs"
    return folder, build_proofs(folder)


@pytest.fixture(scope="module")
def checkers(proofs: tuple[Path, dict[str, set[str]]]) -> Path:
    if shutil.which("ocamlfind") is None or shutil.which("ocamlopt") is None:
        pytest.skip("needs OCaml: apt-get install ocaml-nox ocaml-findlib")
    return build_checkers(proofs[0])


def test_no_theorem_rests_on_axioms_but_those_of_the_reals(proofs: tuple[Path, dict[str, set[str]]]) -> None:
    _, axioms = proofs
    assert set().union(*axioms.values()) == REALS
    for theorem, those in axioms.items():
        if theorem.startswith(("Progression.", "Invariant.")):
            assert not those, theorem


def test_no_proof_is_left_open(proofs: tuple[Path, dict[str, set[str]]]) -> None:
    for file in proofs[0].glob("*.v"):
        assert not {"Admitted.", "admit.", "Axiom", "Parameter"} & set(file.read_text().split()), file.name


# Trees


def random_row(draw: random.Random) -> list[int]:
    degree, size = draw.randint(0, 7), 2 ** draw.choice([2, 6, 300])
    if draw.random() < 0.3 and degree >= 2:  # a double root, at an eighth: a tie
        root = draw.randint(0, 8)
        power = [root * root, -16 * root, 64]
        return [
            sum(degree * (degree - 1) * power[i] * comb(j, i) // comb(degree, i) for i in range(3)) for j in range(degree + 1)
        ]
    return [draw.randint(-size, size) for _ in range(degree + 1)]


def random_region(draw: random.Random) -> rules.Region:
    """Return parts, at margin zero or above, that may share conditions, and what two of them are across a face."""
    shift = draw.choice([0, draw.randint(0, 3)])
    rows = [random_row(draw) for _ in range(draw.randint(1, 3))]
    parts = [sorted(draw.sample(range(len(rows)), draw.randint(1, len(rows)))) for _ in range(draw.randint(1, 2))]
    covers = list(parts)
    if len(parts) == 2 and draw.random() < 0.5:  # a face between them
        face = random_row(draw)
        covers = [[*parts[0], len(rows)], [*parts[1], len(rows) + 1], sorted({*parts[0], *parts[1]})]
        parts = covers[:2]
        rows += [face, [2 * shift - x for x in face]]
    return parts, covers, [([x - shift for x in row], [-x - shift for x in row]) for row in rows]


def value(row: list[int], t: Fraction) -> Fraction:
    degree = len(row) - 1
    return sum((comb(degree, i) * x * t**i * (1 - t) ** (degree - i) for i, x in enumerate(row)), Fraction(0))


def assert_true(region: rules.Region, leaves: str, draw: random.Random) -> None:
    """Look at what each leaf says at some instants of it."""
    parts, _, conditions = region
    end = Fraction(0)
    for leaf in leaves.split():
        mark, place, depth = leaf.split(":")
        width = Fraction(1, 2 ** int(depth))
        begin = int(place, 2) * width
        assert begin == end
        end = begin + width
        times = sorted({begin, end, *(begin + width * Fraction(draw.randint(0, 64), 64) for _ in range(5))})
        inside = [any(all(value(conditions[k][0], t) >= 0 for k in part) for part in parts) for t in times]
        if mark == "m":
            assert all(inside)
        elif mark == "n":
            assert not any(inside)
        elif mark == "c":
            assert inside[0] != inside[-1]
            assert inside in (sorted(inside), sorted(inside, reverse=True))
    assert end == 1


def test_the_tree_checkers_agree(checkers: Path) -> None:
    draw = random.Random(1)
    cases: list[tuple[rules.Region, list[str]]] = []
    for _ in range(300):
        region = random_region(draw)
        marks = rules.find_tree(region, 4)
        cases.append((region, marks))
        for _ in range(3):
            edited = list(marks)
            at = draw.randrange(len(edited))
            edited[at : at + draw.randint(0, 1)] = draw.choices("smn?c", k=draw.randint(0, 2))
            cases.append((region, edited))
    verdicts = ask(checkers, (tree_case(*case) for case in cases))
    assert verdicts == [rules.check_tree(*case) for case in cases]
    assert min(sum(v == "refused" for v in verdicts), sum(v != "refused" for v in verdicts)) > 150
    for (region, _), verdict in zip(cases[::4], verdicts[::4], strict=True):
        assert_true(region, verdict, draw)


# Formulas


def random_formula(draw: random.Random, size: int) -> tuple[str, tuple[Any, ...]]:
    """Return a formula as missions write it, and as `Progression.v` does."""
    if size <= 1:
        p = draw.randrange(len(NAMES))
        return NAMES[p], ("a", p)
    operator = draw.choice("!FG&|URWM")
    if operator in "!FG":
        text, f = random_formula(draw, size - 1)
        spec = {"!": ("!", f), "F": ("U", ("t",), f), "G": ("R", ("!", ("t",)), f)}[operator]
        return f"{operator}({text})", spec
    left = draw.randint(1, max(1, size - 2))
    (a, f), (b, g) = random_formula(draw, left), random_formula(draw, size - 1 - left)
    spec = {"W": ("R", g, ("|", f, g)), "M": ("U", g, ("&", f, g))}.get(operator, (operator, f, g))
    return f"({a}) {operator} ({b})", spec


def random_word(draw: random.Random, longest: int) -> list[frozenset[int]]:
    word: list[frozenset[int]] = []
    while not word or (len(word) < longest and draw.random() < 0.7):
        letter = frozenset(p for p in range(len(NAMES)) if draw.random() < 0.4)
        if not word or letter != word[-1]:
            word.append(letter)
    return word


def named(word: list[frozenset[int]]) -> list[set[str]]:
    return [{NAMES[p] for p in letter} for letter in word]


def test_formulas_mean_what_the_judge_takes_them_for(checkers: Path) -> None:
    draw = random.Random(2)
    cases = [(random_formula(draw, draw.randint(1, 8)), random_word(draw, 6)) for _ in range(2000)]
    verdicts = ask(checkers, (word_case(spec, word) for (_, spec), word in cases))
    judged = ["yes" if verify.check_word(text, named(word)) else "no" for (text, _), word in cases]
    assert verdicts == judged
    assert verdicts == ["yes" if rules.satisfies(spec, word) else "no" for (_, spec), word in cases]
    assert set(verdicts) == {"yes", "no"}


# Invariants


def chains(words: list[list[frozenset[int]]], own: bool, followed: int, apart: bool) -> tuple[rules.Team, list[rules.Span]]:
    """Return robots that show their words one letter after another, and the spans of a flight to all words' ends.

    Of robots that are not followed the spans say what they may show. `apart` gives the end a span of its own.
    """
    ours, others = words[:followed], words[followed:]

    def shown(rows: list[list[frozenset[int]]]) -> tuple[frozenset[int], ...]:
        if own:
            return tuple(letter for row in rows for letter in row)
        return tuple(frozenset[int]().union(*letters) for letters in product(*rows))

    robots = [(word, [(i, i + 1) for i in range(len(word) - 1)]) for word in ours]
    everywhere = rules.Span(tuple(tuple(range(len(word))) for word in ours), shown(others))
    at_last = rules.Span(tuple((len(word) - 1,) for word in ours), shown([word[-1:] for word in others]))
    return rules.Team(robots, own, list(at_last.places)), [everywhere, at_last] if apart else [everywhere]


class Case:
    """A team with a formula, its invariant, and what Python says of it."""

    def __init__(self, words: list[list[frozenset[int]]], spec: Any, own: bool, followed: int, apart: bool = True) -> None:
        self.team, self.spans = chains(words, own, followed, apart)
        self.spec, self.places = spec, [(0,) * followed]
        self.starts = self.team.starts(self.places, self.spans[0])
        self.invariant = rules.find_invariant(self.team, spec, self.starts, self.spans)

    def asked(self) -> str:
        return team_case(self.team, self.spec, self.places, self.spans, self.invariant)

    def written_out(self) -> str:
        return system_case(self.team, self.spec, self.starts, self.spans, self.invariant)

    def expected(self) -> str:
        holds = rules.check_invariant(self.team, self.spec, self.starts, self.spans, self.invariant)
        return "yes" if holds else "no"


@pytest.mark.parametrize("reading", ["joint", "own"])
def test_invariants_say_what_the_judge_says_of_teams(checkers: Path, reading: Any) -> None:
    draw = random.Random(3)
    cases, judged = [], []
    for number in range(400):
        words = [random_word(draw, 3) for _ in range(draw.randint(1, 3))]
        text, spec = random_formula(draw, draw.randint(1, 6))
        if number == 0:  # one after the other, in either order, r1 and r2 satisfy it; together they do not
            words, (text, spec) = [[frozenset({0}), frozenset()], [frozenset(), frozenset({1})]], TRAPS[reading]
        cases.append(Case(words, spec, reading == "own", len(words), apart=number % 2 == 0))
        verdict = verify.check_team(text, {f"r{i}": named(word) for i, word in enumerate(words)}, reading).parallel
        judged.append("yes" if verdict else "no")
    verdicts = ask(checkers, (case.asked() for case in cases))
    assert verdicts == [case.expected() for case in cases]
    assert verdicts == judged
    assert verdicts[0] == "no"
    assert min(verdicts.count("yes"), verdicts.count("no")) > 50


@pytest.mark.parametrize("reading", ["joint", "own"])
def test_what_is_proved_of_some_robots_holds_of_all(checkers: Path, reading: Any) -> None:
    draw = random.Random(5)
    cases, judged = [], []
    for _ in range(400):
        words = [random_word(draw, 3) for _ in range(draw.randint(2, 3))]
        text, spec = random_formula(draw, draw.randint(1, 5))
        cases.append(Case(words, spec, reading == "own", draw.randint(1, len(words) - 1)))
        judged.append(bool(verify.check_team(text, {f"r{i}": named(word) for i, word in enumerate(words)}, reading).parallel))
    verdicts = ask(checkers, (case.asked() for case in cases))
    assert verdicts == [case.expected() for case in cases]
    assert all(holds for verdict, holds in zip(verdicts, judged, strict=True) if verdict == "yes")
    assert min(verdicts.count("yes"), verdicts.count("no")) > 50


def _without_an_entry(draw: random.Random, invariant: rules.Invariant) -> None:
    entries = draw.choice([one for one in invariant if one] or [[]])
    if entries:
        entries.pop(draw.randrange(len(entries)))


def _without_a_span(draw: random.Random, invariant: rules.Invariant) -> None:
    invariant.pop(draw.randrange(len(invariant)))


def _with_less_owed(draw: random.Random, invariant: rules.Invariant) -> None:
    entries = draw.choice(invariant)
    if entries:
        at, alternative = entries.pop(draw.randrange(len(entries)))
        entries.append((at, frozenset(sorted(alternative)[1:])))


def _with_other_marks(draw: random.Random, invariant: rules.Invariant) -> None:
    entries = draw.choice(invariant)
    if entries:
        at, alternative = entries.pop(draw.randrange(len(entries)))
        turned = tuple((x[0], not x[1]) if isinstance(x, tuple) else 0 for x in at)
        entries.append((turned, alternative))


@pytest.mark.parametrize("edit", [_without_an_entry, _without_a_span, _with_less_owed, _with_other_marks])
@pytest.mark.parametrize("own", [False, True])
def test_both_checkers_refuse_the_same_edits(
    checkers: Path, own: bool, edit: Callable[[random.Random, rules.Invariant], None]
) -> None:
    draw = random.Random(4)
    cases = []
    for _ in range(200):
        _, spec = random_formula(draw, draw.randint(1, 6))
        case = Case([random_word(draw, 3) for _ in range(2)], spec, own, 2)
        edit(draw, case.invariant)
        cases.append(case)
    expected = [case.expected() for case in cases]
    assert ask(checkers, (case.asked() for case in cases)) == expected
    assert ask(checkers, (case.written_out() for case in cases)) == expected
    assert "no" in expected


# The kernel's own invariants


def as_tree(spec: tuple[Any, ...]) -> list[Any]:
    operator, *parts = spec
    if operator == "a":
        return ["name", NAMES[parts[0]]]
    signs = {"t": "true", "!": "not", "&": "and", "|": "or", "U": "until", "R": "release"}
    return [signs[operator], *map(as_tree, parts)]


def random_spans(draw: random.Random, duration: int) -> tuple[Span, ...]:
    """Return spans that may follow each other."""
    times = [0, *sorted(draw.sample(range(1, duration), draw.randint(0, 3))), duration]
    mark = draw.choice(["no", "no", "must", "may"])
    found: list[Span] = []
    for start, stop in pairwise(times):
        found.append(Span(Fraction(start), Fraction(stop), mark))
        ahead = {"no": ["may", "rise"], "must": ["may", "fall"], "rise": ["must"], "fall": ["no"], "may": ["no", "must"]}
        mark = draw.choice(ahead[mark])
    if found[-1].mark in ("rise", "fall"):
        found[-1] = replace(found[-1], mark="may")
    return tuple(found)


def random_claim(draw: random.Random) -> tuple[Any, dict[str, Timeline]]:
    robots = [f"r{i}" for i in range(draw.randint(1, 3))]
    nothing = SimpleNamespace(states={"idle": frozenset()})
    _, spec = random_formula(draw, draw.randint(1, 5))
    statement = SimpleNamespace(
        robots=dict.fromkeys(robots, nothing),
        regions=dict.fromkeys(NAMES),
        joint=draw.random() < 0.5,
        lasso=False,
        clock_error=Fraction(draw.choice([0, 1]), 2),
        formula=as_tree(spec),
    )
    lines = {
        robot: Timeline(robot, Fraction(8), {name: random_spans(draw, 8) for name in NAMES}, frozenset(), (), None)
        for robot in robots
    }
    return statement, lines


def root_of(table: Table) -> list[tuple[Any, ...]]:
    """Return each part of the negation as nested tuples."""
    nodes: list[tuple[Any, ...]] = []
    for sign, parts in table.nodes:
        inner = [nodes[part] for part in parts] if sign in ("and", "or", "until", "release") else []
        if sign in ("holds", "fails"):
            nodes.append(("+" if sign == "holds" else "-", parts[0]))
        elif sign in ("true", "false"):
            nodes.append((sign[0],))
        else:
            short = {"and": "&", "or": "|", "until": "U", "release": "R"}[sign]
            whole = inner[-1]
            for one in inner[-2::-1]:
                whole = (short, one, whole)
            nodes.append(whole)
    return nodes


def system_of(team: Team, sets: list[list[Configuration]]) -> str:
    """Write out all that the kernel's team may do, of the states that an invariant names."""
    robots = len(team.followed)
    nodes = root_of(team.claim.table)

    def state(at: tuple[int, ...], read: int) -> str:
        return listed(range(robots), lambda i: f"{at[i]} {read >> i & 1}")

    def move(step: Any) -> str:
        letter, at, read = step
        return f"{'-' if letter is None else f'+ {numbers(sorted(letter))}'} {state(at, read)}"

    def table(states: list[tuple[Any, int]], moves: Any) -> str:
        return listed(states, lambda one: f"{state(*one)} {listed(moves(*one), move)}")

    def states(span: int) -> list[tuple[Any, int]]:
        return list(dict.fromkeys((one.at, one.read) for one in sets[span])) if 0 <= span < len(sets) else []

    def span(number: int) -> str:
        moves = table(states(number), lambda at, read: list(team.moves(number, at, read)))
        return f"{moves} {table(states(number - 1), lambda at, read: team.handed(number - 1, at, read)[1])}"

    ended = [one for one in states(team.size - 1) if team.may_end(*one)]
    return " ".join(
        [
            "system",
            formula(nodes[team.claim.table.root]),
            listed(team.begin(), move),
            listed(range(team.size), span),
            listed(ended, lambda one: state(*one)),
            listed(
                sets,
                lambda here: listed(
                    here, lambda one: f"{state(one.at, one.read)} {listed(one.owed, lambda n: formula(nodes[n]))}"
                ),
            ),
        ]
    )


def kernel_says(team: Team, levels: list[int], sets: list[list[Configuration]]) -> str:
    try:
        check_invariant(team, levels, sets)
    except Refused:
        return "no"
    return "yes"


def kernel_edited(draw: random.Random, team: Team, sets: list[list[Configuration]]) -> list[list[Configuration]]:
    """Leave a configuration out, or change who was read or what is owed."""
    found = [list(here) for here in sets]
    here = draw.choice([row for row in found if row])
    one = here.pop(draw.randrange(len(here)))
    match draw.randrange(2 if team.claim.joint or not team.followed else 3):
        case 0:
            pass
        case 1:
            here.append(replace(one, owed=frozenset(sorted(one.owed)[1:])))
        case _:
            here.append(replace(one, read=one.read ^ 1))
    return found


def test_the_kernel_and_the_proved_checker_agree_on_invariants(checkers: Path) -> None:
    draw = random.Random(7)
    cases: list[tuple[Team, list[int], list[list[Configuration]]]] = []
    found = 0
    for _ in range(300):
        statement, lines = random_claim(draw)
        relations = Relations(frozenset(), frozenset())
        try:
            evidence = find_formula(statement, lines, relations)
        except Refused:
            continue
        for number, tree in enumerate(conjuncts(statement.formula)):
            if f"formula/{number}" not in evidence:
                continue
            found += 1
            team, levels, sets = read_invariant(Claim(statement, lines, relations, tree), evidence[f"formula/{number}"])
            cases.append((team, levels, sets))
            cases += [(team, levels, kernel_edited(draw, team, sets)) for _ in range(3) if any(sets)]
    expected = [kernel_says(*case) for case in cases]
    verdicts = ask(checkers, (system_of(team, sets) for team, _, sets in cases))
    assert verdicts == expected
    assert found > 30
    assert "no" in verdicts
