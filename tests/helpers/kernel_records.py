"""Trees and invariants that the kernel checks, recorded while it does, and written as cases for the extracted checkers."""

from __future__ import annotations

import inspect
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import lcm
from pathlib import Path
from typing import Any

import pytest

from tests.helpers.proved_checkers import Region, formula, listed, numbers, tree_case
from verify.kernel import hoops, planned, timelines, trees, words
from verify.kernel.__main__ import check_folder
from verify.kernel.bodies import Body
from verify.kernel.distances import Solid
from verify.kernel.hoops import Opening
from verify.kernel.places import Places
from verify.kernel.planned import PlannedClaim
from verify.kernel.polynomials import Bernstein
from verify.kernel.refused import Refused
from verify.kernel.team import At, Step, Team
from verify.kernel.trees import Cell, Leaf, Marks, Part
from verify.kernel.words import LAP, Configuration

_check_leaves, _check_invariant = trees.leaves, words.check_invariant
NEVER = [-1]
"""A condition that is never kept, or never broken."""


class Given:
    """Marks of one tree, which must be all that it takes."""

    def __init__(self, marks: Sequence[str]) -> None:
        self.left = list(marks)

    def take(self, part: Part, depth: int) -> str:
        del part, depth
        if not self.left:
            raise Refused("the marks end early")
        return self.left.pop(0)


@dataclass(frozen=True)
class Tree:
    """One tree: what it is about, and its marks."""

    whole: Part
    marks: tuple[str, ...]

    def says(self) -> str:
        """Return the leaves that the kernel finds, or `refused`."""
        given = Given(self.marks)
        try:
            found = list(_check_leaves(self.whole, given))
        except Refused:
            return "refused"
        return (
            "refused"
            if given.left
            else " ".join(f"{_marks(self.whole)[leaf.mark]}:{leaf.place:b}:{leaf.depth}" for leaf in found)
        )

    def asked(self) -> str:
        """Return the case: polynomials and marks, or, where more than signs of polynomials counts, what the kernel says of each leaf."""
        known = _marks(self.whole)
        marks = [known.get(mark, "x") for mark in self.marks]
        if (region := _region(self.whole)) is not None:
            return tree_case(region, marks)
        return f"walk {listed(self._looked_at())} {listed(marks)}"

    def _looked_at(self) -> list[str]:
        """Walk as far as the marks go, whatever they say, and return the leaves of which they are so."""
        found: list[str] = []
        waiting = [(self.whole, 0, 0)]
        for mark in self.marks:
            if not waiting:
                break
            part, place, depth = waiting.pop()
            if mark == "s":
                first, second = part.halves()
                waiting += [(second, 2 * place + 1, depth + 1), (first, 2 * place, depth + 1)]
            elif part.holds(mark):
                found.append(f"{_marks(self.whole)[mark]} {place:b} {depth}")
        return found

    def edited(self, draw: random.Random) -> Tree:
        """Return it with another mark, or, of polynomials, with another coefficient."""
        if isinstance(self.whole, Cell) and draw.random() < 0.5:
            rows = list(self.whole.rows)
            k = draw.randrange(len(rows))
            row = list(rows[k].numbers)
            i = draw.randrange(len(row))
            row[i] += draw.choice([-1, 1, -2 * row[i], row[0] - row[-1], draw.choice([-1, 1]) * rows[k].unit])
            rows[k] = Bernstein(row, rows[k].unit)
            return Tree(Cell(rows, self.whole.claims), self.marks)
        marks = list(self.marks)
        at = draw.randrange(len(marks))
        marks[at : at + 1] = draw.choices("sn?cmik", k=draw.choice([0, 1, 1, 1, 2]))
        return Tree(self.whole, tuple(marks))


def _marks(whole: Part) -> dict[str, str]:
    """Return the marks that a part's claims know, each as the proved checker writes it; what is open is so everywhere."""
    if not isinstance(whole, Cell):
        return {"s": "s", "?": "?", "m": "m", "k": "n"}
    what = getattr(whole.claims, "__self__", None)
    if isinstance(what, Body):
        return {mark: mark for mark in "s?nmc"}
    return {"s": "s", "?": "?", **({"i": "m", "n": "n"} if isinstance(what, Opening) else {"m": "m", "n": "n"})}


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
    """Return what a part's marks claim as a region's conditions; None where more than signs of polynomials counts."""
    if not isinstance(whole, Cell):
        return None
    what, rows = getattr(whole.claims, "__self__", None), whole.rows
    if isinstance(what, Body):
        asked = [_asked(row, one.inside, one.outside) for row, one in zip(rows, what.conditions, strict=True)]
        return [list(part) for part in what.parts], [list(cover) for cover in what.covers], asked
    if isinstance(what, Opening):
        (along, across), frame = rows, what.frame
        room = frame.ring.opening - what.margin - what.radius
        radial = _asked(
            across, room**2 * frame.square if room > 0 else None, (frame.ring.opening + what.margin) ** 2 * frame.square
        )
        return [[0, 1, 2]], [[2]], [_asked(along, None, what.far), _asked(_minus(along), None, what.far), radial]
    if isinstance(what, Solid):
        asked = [_asked(row, None, one.outside) for row, one in zip(rows, what.asked, strict=False)]
        for row, (frame, room) in zip(rows[len(asked) :], what.openings, strict=True):
            asked.append(_asked(_minus(row), None, -(room**2) * frame.square if room > 0 else None))
        return [list(range(len(asked)))], [], asked
    least = inspect.getclosurevars(whole.claims).nonlocals.get("least")
    if least is None:
        return None
    return [[]], [list(range(len(rows)))], [_asked(_minus(row), -bound, None) for row, bound in zip(rows, least, strict=True)]


@dataclass(frozen=True)
class Invariant:
    """One invariant: the team, and what is said of it."""

    team: Team
    levels: tuple[int, ...]
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
        if isinstance(team.claim, PlannedClaim):
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
                here.append(replace(one, owed=frozenset(sorted(one.owed)[1:])))
            case "read":
                here.append(replace(one, read=one.read ^ 1))
            case "level":
                here.append(replace(one, level=draw.randrange(len(self.levels))))
            case _:
                pass
        return replace(self, sets=tuple(map(tuple, sets)))


def negation(team: Team) -> list[tuple[Any, ...]]:
    """Return each part of the negation as nested tuples."""
    nodes: list[tuple[Any, ...]] = []
    for sign, parts in team.claim.table.nodes:
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


def _spec(part: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return a normal form as missions write it."""
    sign, *parts = part
    if sign in "+-":
        return ("a", parts[0]) if sign == "+" else ("!", ("a", parts[0]))
    if sign in "tf":
        return ("t",) if sign == "t" else ("!", ("t",))
    return (sign, *map(_spec, parts))


def robots_of(team: Team, levels: Sequence[int], sets: Sequence[Sequence[Configuration]]) -> str:
    """Write out a team's robots, and where they may be and what the team may show in each span; the checker moves them."""
    own, nodes, table = not team.claim.joint, negation(team), team.claim.table
    names: dict[str, int] = {one.name: number for number, one in enumerate(table.propositions)} if own else {}

    def letter(places: Places, place: int) -> str:
        """Return a robot's letter; a lap's copy shows that it is one, as the change to it has to be read."""
        shown = [*places.letters[place], *(["second lap"] if places.slots[place].lap == 2 else [])]
        return numbers(sorted(names.setdefault(name, len(names)) for name in shown)) if own else "0"

    def robot(places: Places) -> str:
        changes = [(place, target) for place, then in enumerate(places.following) for target in then]
        letters = [letter(places, place) for place in range(len(places.letters))]
        return f"{listed(letters)} {listed(changes, lambda one: f'{one[0]} {one[1]}')}"

    def span(number: int) -> str:
        open_ = [
            [place for place in range(len(places.letters)) if team._is_open(k, place, number)]
            for k, places in enumerate(team.followed)
        ]
        return f"{listed(open_, numbers)} {listed(map(sorted, team._shown[number]), numbers) if own else shown(number)}"

    def shown(number: int) -> str:
        """Return all that the team may show where a move leads, or the step from the span before."""
        found: dict[At, list[list[int]]] = {}
        steps = [step for one in sets[number] for step in team.moves(number, one.at, one.read)]
        for before in (number - 1, *([team.size - 1] if number == team.back else [])):
            steps += [
                step for one in (sets[before] if before >= 0 else ()) for step in team.handed(before, one.at, one.read)[1]
            ]
        for read, then, _ in steps:
            assert read is not None
            if sorted(read) not in found.setdefault(then, []):
                found[then].append(sorted(read))
        return listed(found.items(), lambda one: f"{numbers(one[0])} {listed(one[1], numbers)}")

    def copy(places: Places) -> str:
        return f"{numbers(k for k, slot in enumerate(places.slots) if slot.lap == 2)} {places.shift}"

    def entry(one: Configuration) -> str:
        at = listed(enumerate(one.at), lambda x: f"{x[1]} {one.read >> x[0] & 1}") if own else numbers(one.at)
        return f"{at} {listed(one.owed, lambda n: formula(nodes[n]))}{_level(team, one)}"

    laps = team.back is not None
    return " ".join(
        [
            f"{'own' if own else 'team'}{'-laps' if laps else ''}",
            listed(team.followed, robot),
            formula(("!", _spec(nodes[table.root]))),
            listed(
                team.begin(), lambda step: numbers(step[1]) if own else f"{numbers(sorted(step[0] or ()))} {numbers(step[1])}"
            ),
            listed(team.followed, copy if laps else lambda places: numbers(sorted(places.final))),
            listed(range(team.size), span),
            *_named(team, levels, nodes),
            listed(sets, lambda here: listed(here, entry)),
        ]
    )


def _level(team: Team, one: Configuration) -> str:
    return "" if team.back is None else f" {one.level}"


def _named(team: Team, levels: Sequence[int], nodes: list[tuple[Any, ...]]) -> list[str]:
    """Return of laps to which span the last one leads, and what levels name."""
    named = listed(levels, lambda one: "lap" if one == LAP else f"until {formula(nodes[one])}")
    return [] if team.back is None else [str(team.back), named]


def system_of(team: Team, levels: Sequence[int], sets: Sequence[Sequence[Configuration]]) -> str:
    """Write out all that a team may do, of the states that an invariant names."""
    robots, nodes, last = len(team.followed), negation(team), team.size - 1

    def state(at: At, read: int) -> str:
        return listed(range(robots), lambda i: f"{at[i]} {read >> i & 1}")

    def move(step: Step) -> str:
        letter, at, read = step
        return f"{'-' if letter is None else f'+ {numbers(sorted(letter))}'} {state(at, read)}"

    def table(states: list[tuple[At, int]], moves: Callable[[At, int], Sequence[Step]]) -> str:
        return listed(states, lambda one: f"{state(*one)} {listed(moves(*one), move)}")

    def states(span: int) -> list[tuple[At, int]]:
        return list(dict.fromkeys((one.at, one.read) for one in sets[span])) if span >= 0 else []

    def handed(span: int) -> str:
        return table(states(span), lambda at, read: team.handed(span, at, read)[1])

    def entry(one: Configuration) -> str:
        return f"{state(one.at, one.read)} {listed(one.owed, lambda n: formula(nodes[n]))}{_level(team, one)}"

    ended = listed([one for one in states(last) if team.may_end(*one)], lambda one: state(*one))
    spans = [
        f"{table(states(k), lambda at, read, k=k: list(team.moves(k, at, read)))} {handed(k - 1)}" for k in range(team.size)
    ]
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


def recorded(folder: Path) -> Records:
    """Have the kernel check a folder, and return what its checkers of trees and of invariants were given; each said yes."""
    found = Records([], [])

    def leaves(whole: Part, marks: Marks) -> Iterator[Leaf]:
        taken: list[str] = []

        class Taken:
            def take(self, part: Part, depth: int) -> str:
                taken.append(marks.take(part, depth))
                return taken[-1]

        yield from list(_check_leaves(whole, Taken()))
        found.trees.append(Tree(whole, tuple(taken)))

    def check_invariant(team: Team, levels: Sequence[int], sets: Sequence[Sequence[Configuration]]) -> None:
        _check_invariant(team, levels, sets)
        found.invariants.append(Invariant(team, tuple(levels), tuple(map(tuple, sets))))

    with pytest.MonkeyPatch.context() as patched:
        for module in (trees, timelines, hoops):
            patched.setattr(module, "leaves", leaves)
        for module in (words, planned):
            patched.setattr(module, "check_invariant", check_invariant)
        _, claims = check_folder(folder)
    assert not any(claim.missing for claim in claims)
    return found
