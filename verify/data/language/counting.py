"""Formulas that speak of single robots and of how many there are, written out for a given team.

What is written out has, beside plain names, two kinds of propositions of the whole team: `quad0.dock` (that robot shows dock) and
`count(B) >= k` with 1 <= k <= the number of robots. All else comes to these: `all(B)` is `!(count(!B) >= 1)`, `some(B)` is
`count(B) >= 1`, `count(B) <= k` is `!(count(B) >= k + 1)`, `each(f)` is the conjunction of f over the robots. `ever(B)` is the number of robots
r with `F B.r`: at most k are, if of any k + 1 robots one has `G !B.r`; at least k, if of any n - k + 1 robots one has `F B.r`. A count that every
team keeps is `true`, one that asks for more robots than there are `false`. Size: `each` multiplies its formula by the number of
robots, `ever` by the number of such sets; everything else stays as long as it was written.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

from verify.data.errors import BadInput
from verify.data.language.formula import COUNTING, FALSE, FREE, NAME, TRUE, Formula

MOST_SETS = 1000
"""Sets of robots that an `ever` may be written out for."""


def written_out(formula: Formula, robots: Sequence[str]) -> Formula:
    """Return a formula over plain names, single robots' names and `count(B) >= k`; one without counts as it is.

    Args:
        formula: As it was read.
        robots: The team's names. For one robot plain names are all that is left.

    Raises:
        BadInput: The formula names a robot that the team has not, or an `ever` is too long when it is written out.
    """
    if not formula.counts:
        return formula
    if strange := {node.robot for node in formula.nodes() if node.robot}.difference(robots):
        raise BadInput(f"'{min(strange)}' is not a robot of this team. Robots: {', '.join(robots)}.")
    return _written_out(formula, tuple(robots))


def _written_out(formula: Formula, robots: tuple[str, ...]) -> Formula:
    """Return a formula written out, node by node."""
    return formula.rebuilt(partial(_as_written_out, robots))


def _as_written_out(robots: tuple[str, ...], formula: Formula, arguments: tuple[Formula, ...]) -> Formula:
    """Return a node written out, whose arguments are already."""
    match formula.operator:
        case "each":
            each = [_written_out(formula.arguments[0].of(robot), robots) for robot in robots]
            return _halved(each)
        case "some":
            return _at_least(formula.arguments[0], 1, robots, formula.position)
        case "all":
            return negated(_at_least(negated(formula.arguments[0]), 1, robots, formula.position))
        case "count":
            assert formula.bound is not None
            (sign, number), counted = formula.bound, formula.arguments[0]
            if sign in (">=", ">"):
                return _at_least(counted, number + (sign == ">"), robots, formula.position)
            most = negated(_at_least(counted, number + (sign != "<"), robots, formula.position))
            return most if sign != "==" else _both(_at_least(counted, number, robots, formula.position), most)
        case "ever":
            assert formula.bound is not None
            (sign, number), count = formula.bound, len(robots)
            least = number + (sign == ">")
            most = count if sign in (">=", ">") else number - (sign == "<")
            return _both(
                _ever(formula, robots, least if sign not in ("<", "<=") else 0),
                _ever(formula, robots, count - most, never=True),
            )
        case "name":
            return Formula("name", (), formula.name, formula.position) if len(robots) == 1 else formula
        case _:
            return replace(formula, arguments=arguments)


def _at_least(counted: Formula, number: int, robots: tuple[str, ...], position: int) -> Formula:
    if number <= 0:
        return TRUE
    if number > len(robots):
        return FALSE
    if len(robots) == 1 or (number == 1 and counted.operator == "name" and counted.name != FREE):
        return counted  # a plain name is true where some robot shows it; plain `free`, where every robot is free
    return Formula("count", (counted,), "", position, bound=(">=", number))


def _ever(formula: Formula, robots: tuple[str, ...], number: int, *, never: bool = False) -> Formula:
    """Return that so many robots at least come to what an `ever` counts, or never do."""
    if number <= 0:
        return TRUE
    size = len(robots) - number + 1  # of any so many robots, one does
    if size <= 0:
        return FALSE
    if math.comb(len(robots), size) > MOST_SETS:
        raise BadInput(
            f"`{formula}` is written out for {math.comb(len(robots), size)} sets of {size} of the {len(robots)} robots; {MOST_SETS} are the most. "
            "Use a bound nearer to 0 or to the number of robots."
        )
    counted = Formula("G", (negated(formula.arguments[0]),)) if never else Formula("F", formula.arguments)
    each = [_written_out(counted.of(robot), robots) for robot in robots]
    return _halved([_halved(some, "|") for some in itertools.combinations(each, size)])


def negated(formula: Formula) -> Formula:
    """Return the negation of a formula, without a double one."""
    if formula in (TRUE, FALSE):
        return FALSE if formula == TRUE else TRUE
    return formula.arguments[0] if formula.operator == "!" else Formula("!", (formula,), "", formula.position)


def _both(one: Formula, other: Formula) -> Formula:
    if FALSE in (one, other):
        return FALSE
    return other if one == TRUE else one if other == TRUE else Formula("&", (one, other), "", one.position)


def _halved(parts: Sequence[Formula], operator: Literal["&", "|"] = "&") -> Formula:
    """Return a conjunction, or a disjunction, that is never deep."""
    if len(parts) == 1:
        return parts[0]
    half = len(parts) // 2
    return Formula(operator, (_halved(parts[:half], operator), _halved(parts[half:], operator)))


@dataclass(frozen=True, slots=True)
class Atom:
    """A proposition of the whole team that is no plain name.

    Attributes:
        formula: `quad0.dock` or `count(B) >= k`.
        robot: Whose name it is; empty for a count.
        counted: What each robot's own letter is asked: a Boolean combination of names.
        least: How many robots must satisfy it.
    """

    formula: Formula
    robot: str
    counted: Formula
    least: int

    @property
    def text(self) -> str:
        """Its name in letters and automata."""
        return self.formula.atom


def atoms(formula: Formula) -> dict[str, Atom]:
    """Return the propositions of a written-out formula that are no plain names, by their texts."""
    return {atom.text: atom for atom in _atoms(formula)}


def _atoms(formula: Formula) -> Iterator[Atom]:
    stack, seen = [formula], set[int]()
    while stack:
        node = stack.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        if node.operator == "count":
            assert node.bound is not None
            yield Atom(node, "", node.arguments[0], node.bound[1])
        elif node.robot:
            yield Atom(node, node.robot, Formula("name", (), node.name), 1)
        else:
            stack.extend(node.arguments)


def first_count(formula: Formula) -> Formula | None:
    """Return the first node that counts robots or names one; None where a formula has none."""
    found = [node for node in formula.nodes() if node.operator in COUNTING or node.robot]
    return min(found, key=lambda node: node.position, default=None)


def require_plain(formula: Formula, what: str) -> Formula:
    """Return a formula that neither counts robots nor names one.

    Args:
        formula: The formula.
        what: What it is held against or made into, for the message.

    Raises:
        BadInput: It does.
    """
    if (node := first_count(formula)) is not None:
        raise BadInput(f"`{node}` speaks of several robots at one time; {what}.")
    return formula


def require_names(names: Sequence[str]) -> None:
    """Reject names that could be taken for counts or robots' names.

    Raises:
        BadInput: One is no name of letters, digits and `_`.
    """
    if (strange := next((name for name in names if not NAME.fullmatch(name)), None)) is not None:
        raise BadInput(
            f"'{strange}' cannot stand beside counts and robots' names: use a letter or _, then letters, digits and _."
        )
