"""Explanations of a violation in words: from the whole formula down to the part and the letter that decide it."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace

from verify.data.language.formula import Formula
from verify.data.language.word import Word
from verify.logic.semantics import TruthTable, truth_table

Where = Callable[[int], str]
"""Names a position for a person, such as `quad1's letter 2 {smoke}`."""

MAX_SHOWN = 160


@dataclass(frozen=True, slots=True)
class Reason:
    """Decisive reason why a word violates a formula.

    Attributes:
        sentence: For a person.
        part: The conjunct that fails.
        position: The letter that decides, where one does; otherwise None (something never happens).
    """

    sentence: str
    part: Formula
    position: int | None


def explain(formula: Formula, word: Word, where: Where) -> Reason:
    """Say why `word` does not satisfy `formula` (which it must not).

    Args:
        formula: What is broken.
        word: What breaks it.
        where: Names a position of the word for a person.

    Raises:
        BadInput: Formula and word together are too large to evaluate.
    """
    table = truth_table(formula, word)
    part = next(conjunct for conjunct in _conjuncts(formula) if not table.at(conjunct))
    position, because = _why_not(part, 0, table, where)
    place = "" if position is None else f" at {where(position)}"
    return Reason(f"`{show(part)}` fails{place}: {because}.", part, position)


def show(formula: Formula) -> str:
    """Return the formula as text, cut where it is long."""
    if (
        len(list(itertools.islice(formula.walk(), MAX_SHOWN + 1))) > MAX_SHOWN
    ):  # one that shares its parts may be endless as text
        return "(a long formula)"
    text = str(_compared(formula)) if formula.counts else str(formula)
    return text if len(text) <= MAX_SHOWN else text[: MAX_SHOWN - 3] + "..."


def _compared(formula: Formula) -> Formula:
    """Return a formula that is easier to read: with `count(B) < k` for `!(count(B) >= k)`, and `all(B)` for `count(!B) < 1`."""
    if formula.operator == "!" and formula.arguments[0].bound is not None:
        (count,) = formula.arguments
        sign, least = count.bound or (">=", 1)
        (counted,) = count.arguments
        if (sign, least) == (">=", 1):
            every = counted.arguments[0] if counted.operator == "!" else Formula("!", (counted,))
            return Formula("all", (every,))
        if sign == ">=":
            return Formula("count", (counted,), bound=("<=", least - 1))
    if formula.operator == "count" or not formula.arguments:
        return formula
    return replace(formula, arguments=tuple(map(_compared, formula.arguments)))


def _conjuncts(formula: Formula) -> list[Formula]:
    found: list[Formula] = []
    stack = [formula]
    seen: set[int] = set()
    while stack:
        node = stack.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        if node.operator == "&":
            stack.extend(reversed(node.arguments))
        else:
            found.append(node)
    return found


def _why_not(node: Formula, at: int, table: TruthTable, where: Where) -> tuple[int | None, str]:
    """Return the deciding position and a phrase for why `node` is false at `at`."""
    place: int | None = at
    while True:
        match node.operator:
            case "&":
                node = node.arguments[0] if not table.at(node.arguments[0], at) else node.arguments[1]
            case "G":
                at = _first(table, node.arguments[0], at, value=False)
                node, place = node.arguments[0], at
            case "->":
                left, right = node.arguments
                if right.operator in ("name", "count", "!", "&", "|", "false"):
                    return at, f"`{show(left)}` holds there but `{show(right)}` does not"
                _, because = _why_not(right, at, table, where)
                return at, f"`{show(left)}` holds there, and {because}"
            case "F":
                return _later(at), f"`{show(node.arguments[0])}` never happens{_after(at, where)}"
            case "U" | "M":
                return _missing_until(node, at, table, where)
            case "W" | "R":
                return _too_early(node, at, table)
            case "!":
                return _why(node.arguments[0], at, table, where)
            case _:
                return place, f"`{show(node)}` does not hold there"


def _why(node: Formula, at: int, table: TruthTable, where: Where) -> tuple[int | None, str]:
    """Return the deciding position and a phrase for why `node` is true at `at`, where it should not be."""
    chain: list[str] = []
    while node.operator in ("F", "&") and len(chain) < 6:
        if node.operator == "F":
            at = _first(table, node.arguments[0], at, value=True)
            node = node.arguments[0]
        else:
            temporal = [a for a in node.arguments if a.operator in ("F", "&")]
            for argument in node.arguments:
                if argument not in temporal:
                    chain.append(f"`{show(argument)}` at {where(at)}")
            if len(temporal) != 1:
                chain.extend(f"`{show(argument)}` from there on" for argument in temporal)
                return at, "it must not come about, yet: " + ", then ".join(chain)
            node = temporal[0]
    chain.append(f"`{show(node)}` at {where(at)}")
    return at, ("it must not come about, yet: " if len(chain) > 1 else "it must not hold: ") + ", then ".join(chain)


def _missing_until(node: Formula, at: int, table: TruthTable, where: Where) -> tuple[int | None, str]:
    """`a U b` false, or `b M a` false: the awaited part never comes, or the other part gives way before it."""
    keep, goal = node.arguments if node.operator == "U" else (node.arguments[1], node)
    awaited = goal if node.operator == "U" else node.arguments[0]
    n = len(table.word.letters)
    broken = next((i for i in range(at, n) if not table.at(keep, i)), None)
    if broken is None:
        return _later(at), f"`{show(awaited)}` never happens{_after(at, where)}"
    if node.operator == "U" and broken == at and not any(table.row(awaited)[at:]):
        return broken, f"neither `{show(keep)}` nor `{show(awaited)}` holds there"
    return broken, f"`{show(keep)}` gives way there before `{show(awaited)}` has come"


def _too_early(node: Formula, at: int, table: TruthTable) -> tuple[int | None, str]:
    keep, awaited = node.arguments if node.operator == "W" else (node.arguments[1], node.arguments[0])
    n = len(table.word.letters)
    broken = next((i for i in range(at, n) if not table.at(keep, i)), at)
    if table.at(awaited, broken):  # of `R`, whose both parts are to hold at one letter
        return broken, f"`{show(keep)}` gives way there, where `{show(awaited)}` comes: `R` asks for both at that letter"
    return broken, f"`{show(keep)}` gives way there before `{show(awaited)}` has come"


def _first(table: TruthTable, node: Formula, at: int, *, value: bool) -> int:
    """Return the first position from `at` on (round the cycle, if need be) where a node has a value."""
    row = table.row(node)
    loop = len(table.word.prefix) if table.word.cycle is not None else len(row)
    return next(i for i in (*range(at, len(row)), *range(min(loop, at), at)) if row[i] == value)


def _later(at: int) -> int | None:
    return at or None


def _after(at: int, where: Where) -> str:
    return f" from {where(at)} on" if at else ""
