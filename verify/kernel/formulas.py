"""Formulas: nested lists read into a table, printed, and what is left of one after a letter (progression).

A formula is broken by a word if the word satisfies its negation. So it is the negation that is read here, with `not` at its propositions
only: constants, propositions and their negations, `and`, `or`, `until` and `release`; the other operators come to these:

    eventually f = true U f     always f = false R f     f weak g = g R (f or g)     f strong g = g U (f and g)

*Progression.* A word with first letter a satisfies a part exactly if the rest of it satisfies one of the part's *alternatives* after a:
each a set of untils and releases, all of which are still owed. For `f U g` that is g's alternatives, or f's with `f U g` owed again: then
it was *put off*. The empty word keeps releases and no untils. (Coq: `progress_state_sat`, `accepts_sound`.)

A proposition is a number of robots: at least k of some robots' letters satisfy a combination of names. A plain name is one robot of all.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Any

from .refused import Refused

Tree = Any  # of any type: JSON nests

MOST_ALTERNATIVES = 500
MOST_NODES = 20_000

_UNARY = ("not", "eventually", "always")
_BINARY = ("implies", "iff", "xor", "until", "release", "weak", "strong")
_TEMPORAL = ("eventually", "always", "until", "release", "weak", "strong")
_SIGNS = {
    "not": "!", "eventually": "F ", "always": "G ", "and": " & ", "or": " | ", "implies": " -> ", "iff": " <-> ", "xor": " xor ",
    "until": " U ", "release": " R ", "weak": " W ", "strong": " M ",
}  # fmt: skip

Owed = frozenset[int]
"""One alternative: nodes of a table that the rest of a word has to satisfy, all of them."""

Alternatives = tuple[tuple[Owed, Owed], ...]
"""What may be owed after a letter, and which untils were then put off."""


def operands(tree: Tree) -> list[Tree]:
    """Return the formulas that an operator joins; none of a proposition.

    Raises:
        Refused: It is no formula.
    """
    if not isinstance(tree, list) or not tree or not isinstance(tree[0], str):
        raise Refused("a formula is no list that begins with its operator")
    sign, rest = tree[0], tree[1:]
    if (sign in _UNARY and len(rest) == 1) or (sign in _BINARY and len(rest) == 2) or (sign in ("and", "or") and rest):
        return rest
    if sign in ("true", "false", "free") and not rest:
        return []
    if sign == "name" and len(rest) == 1 and isinstance(rest[0], str):
        return []
    if sign == "robot" and len(rest) == 2 and isinstance(rest[0], str):
        return []
    if sign == "count" and len(rest) == 2 and isinstance(rest[0], int) and not isinstance(rest[0], bool):
        return []
    raise Refused(f"a formula's part {sign[:40]!r} is not covered by the kernel")


def bottom_up(tree: Tree) -> list[Tree]:
    """Return a formula and all its parts, parts first.

    Raises:
        Refused: It is no formula, or too large.
    """
    found: list[Tree] = []
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        found.append(node)
        if len(found) > MOST_NODES:
            raise Refused(f"a formula has more than {MOST_NODES} parts")
        waiting += operands(node)
    return found[::-1]


def show(tree: Tree) -> str:
    """Return a formula as text, in the missions' syntax."""
    texts: dict[int, str] = {}
    for node in bottom_up(tree):
        sign, parts = node[0], [texts[id(part)] for part in operands(node)]
        if sign in ("robot", "count"):
            counted = show_combination(node[2])
            texts[id(node)] = f"{node[1]}.{counted}" if sign == "robot" else f"(count({counted}) >= {node[1]})"
        elif sign in _UNARY:
            texts[id(node)] = f"{_SIGNS[sign]}{parts[0]}"
        elif parts:
            texts[id(node)] = parts[0] if len(parts) == 1 else f"({_SIGNS[sign].join(parts)})"
        else:
            texts[id(node)] = node[1] if sign == "name" else sign
    return texts[id(tree)]


def show_combination(tree: Tree) -> str:
    """Return a combination of names as text.

    Raises:
        Refused: It is none.
    """
    if any(node[0] in ("robot", "count", *_TEMPORAL) for node in bottom_up(tree)):
        raise Refused("what is counted is no combination of names")
    return show(tree)


def conjuncts(tree: Tree) -> list[Tree]:
    """Return formulas that together say what one says: parts of conjunctions, also of those that hold always."""
    found: list[Tree] = []
    waiting: list[tuple[Tree, bool]] = [(tree, False)]
    while waiting:
        node, always = waiting.pop()
        parts = operands(node)
        if node[0] == "and":
            waiting += [(part, always) for part in reversed(parts)]
        elif node[0] == "always":
            waiting.append((parts[0], True))
        else:
            found.append(["always", node] if always else node)
    return found


def names_of(tree: Tree, regions: Collection[str]) -> frozenset[str]:
    """Return all names that a formula's letters are asked for."""
    found: set[str] = set()
    waiting = [tree]
    while waiting:
        for node in bottom_up(waiting.pop()):
            if node[0] == "name":
                found.add(node[1])
            elif node[0] == "free":
                found.update(regions)
            elif node[0] in ("robot", "count"):
                show_combination(node[2])
                waiting.append(node[2])
    return frozenset(found)


@dataclass(frozen=True, slots=True)
class Proposition:
    """At least `least` of some robots satisfy a combination of names; of all robots where none is named."""

    robot: str
    least: int
    counted: str


class Table:
    """The negation of a formula, as a table in which parts stand once, each after its own parts.

    Args:
        tree: The formula.
        regions: All regions, which `free` speaks of.

    Attributes:
        root: The negation as a whole.
        propositions: What letters of the team are asked for; a letter is the set of those that hold, by their numbers.
    """

    def __init__(self, tree: Tree, regions: Collection[str]) -> None:
        self._regions = sorted(regions)
        self._nodes: list[tuple[str, tuple[int, ...]]] = []
        self._numbers: dict[tuple[str, tuple[int, ...]], int] = {}
        self.propositions: list[Proposition] = []
        self._after: dict[frozenset[int], list[Alternatives]] = {}
        self._known: dict[tuple[frozenset[int], Owed], Alternatives] = {}
        self.root = self._read(tree)

    def __len__(self) -> int:
        return len(self._nodes)

    @property
    def nodes(self) -> tuple[tuple[str, tuple[int, ...]], ...]:
        """All parts: an operator, and the numbers of its parts, or of a proposition."""
        return tuple(self._nodes)

    def _read(self, tree: Tree) -> int:
        """Read a formula and its negation, parts first; return the negation."""
        pairs: dict[int, tuple[int, int]] = {}
        for node in bottom_up(tree):
            parts = [pairs[id(part)] for part in operands(node)]
            yes, no = [a for a, _ in parts], [b for _, b in parts]
            match node[0]:
                case "true":
                    pair = self._add("true"), self._add("false")
                case "false":
                    pair = self._add("false"), self._add("true")
                case "free":
                    outside = [self._literals(Proposition("", 1, _text(["name", region]))) for region in self._regions]
                    pair = self._both("and", [b for _, b in outside]), self._both("or", [a for a, _ in outside])
                case "name":
                    pair = self._literals(Proposition("", 1, _text(node)))
                case "robot":
                    pair = self._literals(Proposition(node[1], 1, _text(node[2])))
                case "count":
                    pair = self._literals(Proposition("", node[1], _text(node[2])))
                case "not":
                    pair = no[0], yes[0]
                case "and":
                    pair = self._both("and", yes), self._both("or", no)
                case "or":
                    pair = self._both("or", yes), self._both("and", no)
                case "implies":
                    pair = self._both("or", [no[0], yes[1]]), self._both("and", [yes[0], no[1]])
                case "iff" | "xor":
                    same = [self._both("and", yes), self._both("and", no)]
                    other = [self._both("and", [yes[0], no[1]]), self._both("and", [no[0], yes[1]])]
                    ways = (same, other) if node[0] == "iff" else (other, same)
                    pair = self._both("or", ways[0]), self._both("or", ways[1])
                case "eventually":
                    pair = self._add("until", self._add("true"), yes[0]), self._add("release", self._add("false"), no[0])
                case "always":
                    pair = self._add("release", self._add("false"), yes[0]), self._add("until", self._add("true"), no[0])
                case "until":
                    pair = self._add("until", *yes), self._add("release", *no)
                case "release":
                    pair = self._add("release", *yes), self._add("until", *no)
                case "weak":
                    pair = self._add("release", yes[1], self._both("or", yes)), self._add("until", no[1], self._both("and", no))
                case _:  # strong
                    pair = self._add("until", yes[1], self._both("and", yes)), self._add("release", no[1], self._both("or", no))
            pairs[id(node)] = pair
        return pairs[id(tree)][1]

    def _literals(self, proposition: Proposition) -> tuple[int, int]:
        if proposition not in self.propositions:
            self.propositions.append(proposition)
        number = self.propositions.index(proposition)
        return self._add("holds", number), self._add("fails", number)

    def _both(self, sign: str, parts: Iterable[int]) -> int:
        return self._add(sign, *sorted(set(parts)))

    def _add(self, sign: str, *parts: int) -> int:
        if len(parts) == 1 and sign in ("and", "or"):
            return parts[0]
        if (sign, parts) not in self._numbers:
            self._numbers[sign, parts] = len(self._nodes)
            self._nodes.append((sign, parts))
        return self._numbers[sign, parts]

    def is_until(self, node: int) -> bool:
        """Return whether a node is an until."""
        return self._nodes[node][0] == "until"

    def empty_word_keeps(self, owed: Owed) -> bool:
        """Return whether the empty word satisfies an alternative."""
        return all(self._nodes[node][0] in ("release", "true") for node in owed)

    def after(self, letter: frozenset[int], owed: Owed) -> Alternatives:
        """Return the alternatives of what is owed after a letter.

        Args:
            letter: Numbers of the propositions that hold.
            owed: All of it is owed before.

        Raises:
            Refused: They are too many.
        """
        found = self._known.get((letter, owed))
        if found is None:
            parts = self._parts_after(letter)
            found = _NOTHING
            for node in sorted(owed):
                found = _all_of(found, parts[node])
            self._known[letter, owed] = found
        return found

    def _parts_after(self, letter: frozenset[int]) -> list[Alternatives]:
        if letter not in self._after:
            found: list[Alternatives] = []
            for number, (sign, parts) in enumerate(self._nodes):
                again: Alternatives = ((frozenset({number}), frozenset({number}) if sign == "until" else frozenset()),)
                match sign:
                    case "true" | "false":
                        value = _NOTHING if sign == "true" else ()
                    case "holds" | "fails":
                        value = _NOTHING if (parts[0] in letter) == (sign == "holds") else ()
                    case "and":
                        value = _NOTHING
                        for part in parts:
                            value = _all_of(value, found[part])
                    case "or":
                        value = _least(one for part in parts for one in found[part])
                    case "until":
                        value = _least((*found[parts[1]], *_all_of(found[parts[0]], again)))
                    case _:  # release
                        value = _all_of(found[parts[1]], _least((*found[parts[0]], *again)))
                found.append(value)
            self._after[letter] = found
        return self._after[letter]


_NOTHING: Alternatives = ((frozenset(), frozenset()),)


def _all_of(one: Alternatives, other: Alternatives) -> Alternatives:
    if len(one) * len(other) > MOST_ALTERNATIVES:
        raise Refused(f"not covered by the kernel: what is left of a formula has more than {MOST_ALTERNATIVES} alternatives")
    return _least((a | b, put | off) for a, put in one for b, off in other)


def _least(alternatives: Iterable[tuple[Owed, Owed]]) -> Alternatives:
    """Leave out alternatives that ask for no less than another one: whoever satisfies them satisfies that."""
    kept: list[tuple[Owed, Owed]] = []
    for owed, off in sorted(set(alternatives), key=lambda one: (len(one[0]), len(one[1]), sorted(one[0]), sorted(one[1]))):
        if not any(a <= owed and b <= off for a, b in kept):
            kept.append((owed, off))
    return tuple(kept)


def _text(tree: Tree) -> str:
    return json.dumps(tree, separators=(",", ":"))


class Combination:
    """A combination of names, which one robot's letter satisfies or does not.

    Args:
        text: Its tree as JSON.
        regions: All regions, which `free` speaks of.
    """

    def __init__(self, text: str, regions: Collection[str]) -> None:
        self._order: list[Tree] = bottom_up(json.loads(text))
        self._regions = frozenset(regions)

    def holds(self, letter: frozenset[str]) -> bool:
        """Return whether a letter satisfies it."""
        truth: dict[int, bool] = {}
        for node in self._order:
            parts = [truth[id(part)] for part in operands(node)]
            truth[id(node)] = _truth(node, parts, letter, self._regions)
        return truth[id(self._order[-1])]


def _truth(node: Tree, parts: list[bool], letter: frozenset[str], regions: frozenset[str]) -> bool:
    match node[0]:
        case "true" | "false":
            return node[0] == "true"
        case "name":
            return node[1] in letter
        case "free":
            return not letter & regions
        case "not":
            return not parts[0]
        case "and":
            return all(parts)
        case "or":
            return any(parts)
        case "implies":
            return not parts[0] or parts[1]
        case "iff" | "xor":
            return (parts[0] == parts[1]) == (node[0] == "iff")
        case _:
            raise Refused("what is counted is no combination of names")
