"""Trees and invariants that the kernel checks, recorded while it does, and written as cases for the extracted checkers."""

from __future__ import annotations

import random
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import lcm
from pathlib import Path
from typing import Any

import pytest

from tests.helpers.kernel.proved_checkers import Region, formula, listed, numbers, tree_case
from verify.kernel import timelines, trees, words
from verify.kernel.__main__ import check_folder
from verify.kernel.statement import Refused
from verify.kernel.team import At, Places, State, Step, Team
from verify.kernel.trees import Atom, Bernstein, Cell, Part
from verify.kernel.words import Configuration

_check_leaves, _check_invariant = trees.leaves, words._check_invariant
NEVER = [-1]
"""A condition that is never kept, or never broken."""


@dataclass(frozen=True)
class Tree:
    """One tree: what it is about, and its marks."""

    whole: Part
    marks: tuple[str, ...]

    def says(self) -> str:
        """Return the leaves that the kernel finds, or `refused`."""
        left = iter(self.marks)
        try:
            found = list(_check_leaves(self.whole, left))
        except Refused:
            return "refused"
        places = list(self._places())
        assert [mark for _, mark, _ in found] == [mark for mark, *_ in places]
        return (
            "refused" if list(left) else " ".join(f"{_marks(self.whole)[m]}:{place:b}:{depth}" for m, place, depth, _ in places)
        )

    def asked(self) -> str:
        """Return the case: polynomials and marks, or, where more than signs of polynomials counts, what the kernel says of each leaf."""
        known = _marks(self.whole)
        marks = [known.get(mark, "x") for mark in self.marks]
        if (region := _region(self.whole)) is not None:
            return tree_case(region, marks)
        so = [f"{known[mark]} {place:b} {depth}" for mark, place, depth, part in self._places() if part.holds(mark)]
        return f"walk {listed(so)} {listed(marks)}"

    def _places(self) -> Iterator[tuple[str, int, int, Part]]:
        """Walk as far as the marks go, whatever they say, and yield the leaves."""
        waiting = [(self.whole, 0, 0)]
        for mark in self.marks:
            if not waiting:
                return
            part, place, depth = waiting.pop()
            if mark == "s":
                first, second = part.halves()
                waiting += [(second, 2 * place + 1, depth + 1), (first, 2 * place, depth + 1)]
            else:
                yield mark, place, depth, part

    def edited(self, draw: random.Random) -> Tree:
        """Return it with another mark, or, of polynomials, with another coefficient."""
        if isinstance(self.whole, Cell) and self.whole.rules and draw.random() < 0.5:
            cell = self.whole
            form = draw.choice(
                [form for rule in cell.rules.values() for one in rule for clause in one for form, _, _ in clause]
            )
            unit, row = cell.row(form).unit, list(cell.row(form).numbers)
            i = draw.randrange(len(row))
            row[i] += draw.choice([-1, 1, -2 * row[i], row[0] - row[-1], draw.choice([-1, 1]) * unit])
            other = Bernstein(row, unit)
            return Tree(Cell(lambda one: other if one is form else cell.row(one), cell.rules), self.marks)
        marks = list(self.marks)
        at = draw.randrange(len(marks))
        marks[at : at + 1] = draw.choices("sn?myioFRk", k=draw.choice([0, 1, 1, 1, 2]))
        return Tree(self.whole, tuple(marks))


def _marks(whole: Part) -> dict[str, str]:
    """Return the marks that a part's claims know, each as the proved checker writes it; what is open is so everywhere."""
    if not isinstance(whole, Cell):
        return {"s": "s", "?": "?", "m": "m", "k": "n"}
    if "F" in whole.rules:
        return {"s": "s", "?": "?", "F": "m", "R": "f", "n": "n"}
    ways = {mark: proved for mark, proved in {"y": "y", "i": "i", "o": "f"}.items() if mark in whole.rules}
    return {"s": "s", "?": "?", "m": "m", "n": "n", **ways}


def _above(row: Bernstein, bound: Fraction, scale: int) -> list[int]:
    """Return what is positive where a polynomial is above a bound, coefficient by coefficient, times a number."""
    return [scale // bound.denominator * (n * bound.denominator - bound.numerator * row.unit) for n in row.numbers]


def _asked(row: Bernstein, inside: Fraction | None, outside: Fraction | None) -> tuple[list[int], list[int]]:
    """Return a condition: a polynomial that is at most one bound where it is kept, and above another one where it is broken."""
    scale = lcm(*(bound.denominator for bound in (inside, outside) if bound is not None))
    kept = NEVER if inside is None else [-x for x in _above(row, inside, scale)]
    return kept, NEVER if outside is None else _above(row, outside, scale)


def _minus(row: Bernstein) -> Bernstein:
    return Bernstein([-n for n in row.numbers], row.unit)


def _region(whole: Part) -> Region | None:
    """Return what a part's marks claim as a region's conditions; None where it is something else."""
    if not isinstance(whole, Cell) or not whole.rules or "F" in whole.rules:
        return None
    broken, kept = (whole.rules.get(mark, [[[]]]) for mark in "nm")
    if len(broken) > 1 or len(kept) > 1:
        return None
    bounds: dict[tuple[Hashable, bool], dict[bool, Fraction]] = {}  # of a polynomial, or of it turned round: is it kept?

    def number(atom: Atom, *, kept: bool) -> int:
        form, sign, bound = atom
        turned = sign in (">=", "<")
        bounds.setdefault((form, turned), {})[kept] = -bound if turned else bound
        return list(bounds).index((form, turned))

    outside = [[number(atom, kept=False) for atom in clause] for clause in broken[0]]
    inside = [[number(atom, kept=True) for atom in clause] for clause in kept[0]]
    for near in whole.rules.get("y", ()):  # which say what is broken, even where nothing is kept
        inside = [[number(atom, kept=False) for atom in clause] for clause in near]
    rows = [(_minus(whole.row(form)) if turned else whole.row(form)) for form, turned in bounds]
    asked = [_asked(row, two.get(True), two.get(False)) for row, two in zip(rows, bounds.values(), strict=True)]
    return outside, inside, asked


@dataclass(frozen=True)
class Invariant:
    """One invariant: the team, and what is said of it."""

    team: Team
    levels: tuple[int | None, ...]
    sets: tuple[tuple[Configuration, ...], ...]

    def says(self) -> str:
        """Return the kernel's verdict."""
        try:
            _check_invariant(self.team, self.levels, self.sets)
        except Refused:
            return "no"
        return "yes"

    def asked(self) -> str:
        """Return the case: robots as they are where the proved checker moves them by itself, else all moves written out."""
        team = self.team
        if team.claim.waits:
            return system_of(team, self.levels, self.sets)
        return robots_of(team, self.levels, self.sets)

    def edited(self, draw: random.Random) -> Invariant:
        """Return it without a configuration, or with one in which others were read, less is owed, or the level is another one."""
        sets = [list(here) for here in self.sets]
        here = draw.choice([here for here in sets if here])
        one = here.pop(draw.randrange(len(here)))
        ways = ["nothing", "owed", *(["read"] if self.team.followed and not self.team.claim.joint else [])]
        match draw.choice([*ways, *(["level"] if self.team.back is not None else [])]):
            case "owed":
                here.append(one._replace(owed=frozenset(sorted(one.owed)[1:])))
            case "read":
                here.append(one._replace(read=one.read ^ 1))
            case "level":
                here.append(one._replace(level=draw.randrange(len(self.levels))))
            case _:
                pass
        return replace(self, sets=tuple(map(tuple, sets)))


def _joined(sign: str, parts: list[tuple[Any, ...]]) -> tuple[Any, ...]:
    """Return parts joined by an operator, two at a time."""
    whole = parts[-1]
    for one in parts[-2::-1]:
        whole = (sign, one, whole)
    return whole


def negation(team: Team) -> list[tuple[Any, ...]]:
    """Return each part of the negation, and what it denies, as nested tuples with negations at propositions."""
    nodes: list[tuple[Any, ...]] = []
    for sign, parts in team.claim.table.nodes:
        if sign == "holds":
            nodes += [("+", parts[0]), ("-", parts[0])]
        elif not parts:
            nodes += [("t",), ("f",)]
        else:
            signs = {"and": "&|", "until": "UR"}[sign]
            nodes += [_joined(signs[negated], [nodes[part ^ negated] for part in parts]) for negated in (0, 1)]
    return nodes


def _spec(part: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return a normal form as missions write it."""
    sign, *parts = part
    if sign in "+-":
        return ("a", parts[0]) if sign == "+" else ("!", ("a", parts[0]))
    if sign in "tf":
        return ("t",) if sign == "t" else ("!", ("t",))
    return (sign, *map(_spec, parts))


def robots_of(team: Team, levels: Sequence[int | None], sets: Sequence[Sequence[Configuration]]) -> str:
    """Write out a team's robots, and where they may be and what the team may show in each span; the checker moves them."""
    own, nodes, table = not team.claim.joint, negation(team), team.claim.table
    names: dict[str, int] = {one.name: number for number, one in enumerate(table.propositions)} if own else {}

    def letter(places: Places, place: int) -> str:
        """Return a robot's letter; a lap's copy shows that it is one, as the change to it has to be read."""
        shown = [*places.letters[place], *(["second lap"] if places.laps[place] == 2 else [])]
        return numbers(sorted(names.setdefault(name, len(names)) for name in shown)) if own else "0"

    def robot(places: Places) -> str:
        changes = [(place, target) for place, then in enumerate(places.following) for target in then]
        letters = [letter(places, place) for place in range(len(places.letters))]
        return f"{listed(letters)} {listed(changes, lambda one: f'{one[0]} {one[1]}')}"

    def span(number: int) -> str:
        open_ = [
            [place for place in range(len(places.letters)) if number in team._when[k][place]]
            for k, places in enumerate(team.followed)
        ]
        return f"{listed(open_, numbers)} {listed(map(sorted, team._shown[number]), numbers) if own else shown(number)}"

    def shown(number: int) -> str:
        """Return all that the team may show where a move leads, or the step from the span before."""
        found: dict[At, list[list[int]]] = {}
        steps = [step for one in sets[number] for step in team.moves(number, (one.at, one.read))]
        for before in (number - 1, *([team.size - 1] if number == team.back else [])):
            steps += [
                step for one in (sets[before] if before >= 0 else ()) for step in team.handed(before, (one.at, one.read))[1]
            ]
        for read, (then, _) in steps:
            assert read is not None
            if sorted(read) not in found.setdefault(then, []):
                found[then].append(sorted(read))
        return listed(found.items(), lambda one: f"{numbers(one[0])} {listed(one[1], numbers)}")

    def copy(places: Places) -> str:
        return f"{numbers(k for k, lap in enumerate(places.laps) if lap == 2)} {places.shift}"

    def entry(one: Configuration) -> str:
        at = listed(enumerate(one.at), lambda x: f"{x[1]} {one.read >> x[0] & 1}") if own else numbers(one.at)
        return f"{at} {listed(one.owed, lambda n: formula(nodes[n]))}{_level(team, one)}"

    def start(step: Step) -> str:
        letter, (at, _) = step
        return numbers(at) if own else f"{numbers(sorted(letter or ()))} {numbers(at)}"

    laps = team.back is not None
    return " ".join(
        [
            f"{'own' if own else 'team'}{'-laps' if laps else ''}",
            listed(team.followed, robot),
            formula(("!", _spec(nodes[table.root]))),
            listed(team.begin(), start),
            listed(team.followed, copy if laps else lambda places: numbers(sorted(places.final))),
            listed(range(team.size), span),
            *_named(team, levels, nodes),
            listed(sets, lambda here: listed(here, entry)),
        ]
    )


def _level(team: Team, one: Configuration) -> str:
    return "" if team.back is None else f" {one.level}"


def _named(team: Team, levels: Sequence[int | None], nodes: list[tuple[Any, ...]]) -> list[str]:
    """Return of laps to which span the last one leads, and what levels name."""
    named = listed(levels, lambda one: "lap" if one is None else f"until {formula(nodes[one])}")
    return [] if team.back is None else [str(team.back), named]


def system_of(team: Team, levels: Sequence[int | None], sets: Sequence[Sequence[Configuration]]) -> str:
    """Write out all that a team may do, of the states that an invariant names."""
    robots, nodes, last = len(team.followed), negation(team), team.size - 1

    def state(at: At, read: int) -> str:
        return listed(range(robots), lambda i: f"{at[i]} {read >> i & 1}")

    def move(step: Step) -> str:
        letter, (at, read) = step
        return f"{'-' if letter is None else f'+ {numbers(sorted(letter))}'} {state(at, read)}"

    def table(states: list[State], moves: Callable[[State], Sequence[Step]]) -> str:
        return listed(states, lambda one: f"{state(*one)} {listed(moves(one), move)}")

    def states(span: int) -> list[State]:
        return list(dict.fromkeys((one.at, one.read) for one in sets[span])) if span >= 0 else []

    def handed(span: int) -> str:
        return table(states(span), lambda one: team.handed(span, one)[1])

    def entry(one: Configuration) -> str:
        return f"{state(one.at, one.read)} {listed(one.owed, lambda n: formula(nodes[n]))}{_level(team, one)}"

    ended = listed([one for one in states(last) if team.may_end(one)], lambda one: state(*one))
    spans = [f"{table(states(k), lambda one, k=k: list(team.moves(k, one)))} {handed(k - 1)}" for k in range(team.size)]
    return " ".join(
        [
            "system" if team.back is None else "laps",
            formula(nodes[team.claim.table.root]),
            listed(team.begin(), move),
            listed(spans),
            ended if team.back is None else handed(last),
            *_named(team, levels, nodes),
            listed(sets, lambda here: listed(here, entry)),
        ]
    )


@dataclass(frozen=True)
class Records:
    """All trees and invariants that were checked."""

    trees: list[Tree]
    invariants: list[Invariant]


def noting(marks: Iterator[str], taken: list[str]) -> Iterator[str]:
    """Yield marks, and note those that were taken."""
    for mark in marks:
        taken.append(mark)
        yield mark


def recorded(folder: Path) -> Records:
    """Have the kernel check a folder, and return what its checkers of trees and of invariants were given; each said yes."""
    found = Records([], [])

    def leaves(whole: Part, marks: Iterator[str]) -> Iterator[tuple[Fraction, str, Part]]:
        taken: list[str] = []

        yield from list(_check_leaves(whole, noting(marks, taken)))
        found.trees.append(Tree(whole, tuple(taken)))

    def check_invariant(team: Team, levels: Sequence[int | None], sets: Sequence[Sequence[Configuration]]) -> None:
        _check_invariant(team, levels, sets)
        found.invariants.append(Invariant(team, tuple(levels), tuple(map(tuple, sets))))

    with pytest.MonkeyPatch.context() as patched:
        for module in (trees, timelines):
            patched.setattr(module, "leaves", leaves)
        patched.setattr(words, "_check_invariant", check_invariant)
        _, claims = check_folder(folder)
    assert not any(claim.missing for claim in claims)
    return found
