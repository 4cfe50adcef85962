"""Coq's proofs of the kernel's rules: they build, rest on no axioms but the reals', and their extracted checkers agree with Python's."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction
from functools import partial
from itertools import product
from math import comb
from pathlib import Path
from typing import Any

import pytest

import verify
from tests.helpers.kernel import proof_rules as rules
from tests.helpers.kernel.kernel_records import Invariant, Tree, system_of
from tests.helpers.kernel.kernel_words import proof_of
from tests.helpers.kernel.proved_checkers import REALS, ask, system_case, team_case, word_case
from tests.helpers.missions import random_teams
from tests.helpers.words.random_counts import random_counting_formula
from tests.helpers.words.timelines import mission
from verify.kernel.statement import Statement
from verify.kernel.timelines import Timeline
from verify.kernel.trees import Bernstein, Cell, Polynomial, leaves
from verify.kernel.words import flown, read_invariant

pytestmark = pytest.mark.slow
NAMES = "abc"
TRAPS = {
    "joint": (
        "F(a & b) | F(!a & !b)",
        ("|", ("U", ("t",), ("&", ("a", 0), ("a", 1))), ("U", ("t",), ("!", ("|", ("a", 0), ("a", 1))))),
    ),
    "own": ("!b U a", ("U", ("!", ("a", 1)), ("a", 0))),
}


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


def random_region(draw: random.Random) -> Cell:
    """Return parts, at margin zero or above, that may share conditions or meet at a face, and all choices of one of each."""
    shift = draw.choice([0, draw.randint(0, 3)])
    rows = [random_row(draw) for _ in range(draw.randint(1, 3))]
    parts = [tuple(sorted(draw.sample(range(len(rows)), draw.randint(1, len(rows))))) for _ in range(draw.randint(1, 2))]
    met: set[int] = set()
    if len(parts) == 2 and draw.random() < 0.5:  # a face between them
        met = {len(rows), len(rows) + 1}
        parts = [(*part, face) for part, face in zip(parts, sorted(met), strict=True)]
        face = random_row(draw)
        rows += [face, [2 * shift - x for x in face]]
    low, high = Fraction(-shift), Fraction(shift)
    kept, near, broken = (
        [(k, sign, bound) for k in range(len(rows))] for sign, bound in (("<=", low), ("<=", high), (">", high))
    )
    choices = [sorted({*choice}) for choice in product(*parts) if {*choice} != met]
    rules = {
        "m": [[[kept[k] for k in choice] for choice in choices]],
        "n": [[[broken[k] for k in part] for part in parts]],
        "y": [[[near[k] for k in choice] for choice in choices]],
    }
    for mark, sign in (("i", "falls"), ("o", "rises")):
        rules[mark] = [[[*(broken[j] for j in part), near[k], (k, sign, Fraction(0))] for part in parts for k in part]]
    return Cell(lambda k: Bernstein([-x for x in rows[k]], 1), rules)


def sought(whole: Cell) -> list[str]:
    """Return marks that hold, open ones where some depth does not suffice."""
    found: list[str] = []
    waiting = [(whole, 0)]
    while waiting:
        part, depth = waiting.pop()
        found.append(next(filter(part.holds, "mnyio" if depth > 1 else "mn"), "s" if depth < 4 else "?"))
        if found[-1] == "s":
            first, second = part.halves()
            waiting += [(second, depth + 1), (first, depth + 1)]
    return found


def assert_true(cell: Cell, leaves: str, draw: random.Random) -> None:
    """Look at what each leaf says at some instants of it."""
    parts = [[form for form, _, _ in part] for part in cell.rules["n"][0]]
    bounds = {form: bound for part in cell.rules["n"][0] for form, _, bound in part}
    polynomials = {form: Polynomial.of(powers(cell.row(form).numbers)) for form in bounds}
    end = Fraction(0)
    for leaf in leaves.split():
        mark, place, depth = leaf.split(":")
        width = Fraction(1, 2 ** int(depth))
        begin = int(place, 2) * width
        assert begin == end
        end = begin + width
        times = sorted({begin, end, *(begin + width * Fraction(draw.randint(0, 64), 64) for _ in range(5))})
        inside = [
            any(all(polynomials[k].at(t) <= (-bounds[k] if mark == "m" else bounds[k]) for k in part) for part in parts)
            for t in times
        ]
        if mark in "my":
            assert all(inside)
        elif mark == "n":
            assert not any(inside)
        elif mark in "if":
            assert inside == sorted(inside, reverse=mark == "f")
    assert end == 1


def powers(row: list[int]) -> list[Fraction]:
    """Return a polynomial's coefficients, ascending, of its Bernstein coefficients."""
    n = len(row) - 1
    return [Fraction(comb(n, k) * sum((-1) ** (k - i) * comb(k, i) * row[i] for i in range(k + 1))) for k in range(n + 1)]


def test_the_tree_checkers_agree(checkers: Path) -> None:
    draw = random.Random(1)
    cases: list[Tree] = []
    for _ in range(300):
        whole = random_region(draw)
        marks = sought(whole)
        list(leaves(whole, iter(marks)))
        cases.append(Tree(whole, tuple(marks)))
        for _ in range(3):
            edited = list(marks)
            at = draw.randrange(len(edited))
            edited[at : at + draw.randint(0, 1)] = draw.choices("smn?f", k=draw.randint(0, 2))
            cases.append(Tree(whole, tuple(edited)))
    verdicts = ask(checkers, (case.asked() for case in cases))
    assert verdicts == [case.says() for case in cases]
    assert min(sum(v == "refused" for v in verdicts), sum(v != "refused" for v in verdicts)) > 150
    for case, verdict in zip(cases[::4], verdicts[::4], strict=True):
        assert_true(case.whole, verdict, draw)


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


def random_claim(draw: random.Random, *, laps: bool) -> tuple[Statement, dict[str, Timeline], dict[str, Any]]:
    """Return a team's labels and formula, with the evidence that is found."""
    robots = tuple(f"q{i}" for i in range(draw.randint(1, 2 if laps else 3)))
    counts = draw.random() < 0.4
    asked = (
        random_counting_formula(draw, draw.randint(1, 5), robots)
        if counts
        else random_teams.random_formula(draw, draw.randint(1, 5))
    )
    labels = random_teams.lap_timeline if laps else partial(random_teams.short_timeline, touching=draw.random() < 0.3)
    given = mission(
        str(asked),
        team="joint" if counts else draw.choice(["joint", "own"]),
        robots=len(robots),
        trace="infinite" if laps else "finite",
    )
    error = draw.choice([0, 0, 1]) if len(robots) == 2 else 0
    return proof_of(given, {robot: labels(draw, robot) for robot in robots}, error=error)


@pytest.mark.parametrize("laps", [False, True])
def test_the_kernel_and_the_proved_checker_agree_on_invariants(checkers: Path, laps: bool) -> None:
    draw = random.Random(7)
    cases: list[Invariant] = []
    found = 0
    for _ in range(150):
        statement, lines, evidence = random_claim(draw, laps=laps)
        for key, claim in flown(statement, lines):
            if key not in evidence:
                continue
            found += 1
            team, levels, sets = read_invariant(claim, evidence[key])
            cases.append(Invariant(team, tuple(levels), tuple(map(tuple, sets))))
            cases += [cases[-1].edited(draw) for _ in range(3) if any(sets)]
    expected = [case.says() for case in cases]
    assert ask(checkers, (case.asked() for case in cases)) == expected
    assert ask(checkers, (system_of(case.team, case.levels, case.sets) for case in cases)) == expected
    assert found > 30
    assert "no" in expected
