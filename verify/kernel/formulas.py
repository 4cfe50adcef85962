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
DEEPEST = 400

_UNARY = ("not", "eventually", "always")
_COUNTING = ("robot", "count")
_BINARY = ("implies", "iff", "xor", "until", "release", "weak", "strong")
_SIGNS = {
    "not": "!", "eventually": "F ", "always": "G ", "and": " & ", "or": " | ", "implies": " -> ", "iff": " <-> ", "xor": " xor ",
    "until": " U ", "release": " R ", "weak": " W ", "strong": " M ",
}  # fmt: skip

Letter = frozenset[int]
"""Numbers of the propositions that hold."""

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
    if len(rest) == 2 and ((sign == "robot" and isinstance(rest[0], str)) or (sign == "count" and type(rest[0]) is int)):
        return rest[1:]
    raise Refused(f"a formula's part {sign[:40]!r} is not covered by the kernel")


def bottom_up(tree: Tree, *, counted: bool) -> list[Tree]:
    """Return a formula and all its parts, parts first.

    Args:
        tree: The formula.
        counted: Whether to go into what is asked of single robots.

    Raises:
        Refused: It is no formula, or too large.
    """
    found: list[Tree] = []
    waiting = [(tree, 0)]
    while waiting:
        node, depth = waiting.pop()
        found.append(node)
        if len(found) > MOST_NODES or depth > DEEPEST:
            raise Refused(f"not covered by the kernel: a formula of more than {MOST_NODES} parts, or {DEEPEST} in one another")
        parts = operands(node)
        waiting += [(part, depth + 1) for part in parts] if counted or node[0] not in _COUNTING else []
    return found[::-1]


def show(tree: Tree) -> str:
    """Return a formula as text, in the missions' syntax."""
    texts: dict[int, str] = {}
    for node in bottom_up(tree, counted=True):
        sign, parts = node[0], [texts[id(part)] for part in operands(node)]
        if sign in _COUNTING:
            texts[id(node)] = f"{node[1]}.{parts[0]}" if sign == "robot" else f"(count({parts[0]}) >= {node[1]})"
        elif sign in _UNARY:
            texts[id(node)] = f"{_SIGNS[sign]}{parts[0]}"
        elif parts:
            texts[id(node)] = parts[0] if len(parts) == 1 else f"({_SIGNS[sign].join(parts)})"
        else:
            texts[id(node)] = node[1] if sign == "name" else sign
    return texts[id(tree)]


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


_Pair = tuple[int, int]
"""Nodes of a part and of its negation."""


def _opposite(pair: _Pair) -> _Pair:
    return pair[1], pair[0]


@dataclass(frozen=True, slots=True)
class Proposition:
    """At least `least` of some robots satisfy a combination of names; of all robots where none is named."""

    robot: str
    least: int
    counted: str

    @property
    def name(self) -> str:
        """The name that is all that is asked of a letter; empty where there is more."""
        sign, *rest = json.loads(self.counted)
        return rest[0] if sign == "name" else ""


class Table:
    """The negation of a formula, as a table in which parts stand once, each after its own parts.

    Args:
        tree: The formula.
        regions: All regions, which `free` speaks of.

    Attributes:
        root: The negation as a whole.
    """

    def __init__(self, tree: Tree, regions: Collection[str]) -> None:
        self._regions = sorted(regions)
        self._nodes: list[tuple[str, tuple[int, ...]]] = []
        self._numbers: dict[tuple[str, tuple[int, ...]], int] = {}
        self._asked: dict[Proposition, int] = {}
        self._letters: dict[frozenset[str], Letter] = {}
        self._after: dict[Letter, list[Alternatives]] = {}
        self._known: dict[tuple[Letter, Owed], Alternatives] = {}
        self.root = self._read(tree)

    def __len__(self) -> int:
        return len(self._nodes)

    @property
    def nodes(self) -> tuple[tuple[str, tuple[int, ...]], ...]:
        """All parts: an operator, and the numbers of its parts, or of a proposition."""
        return tuple(self._nodes)

    def _read(self, tree: Tree) -> int:
        """Read a formula and its negation, parts first; return the negation."""
        pairs: dict[int, _Pair] = {}
        true = self._add("true"), self._add("false")
        for node in bottom_up(tree, counted=False):
            parts = [] if node[0] in _COUNTING else [pairs[id(part)] for part in operands(node)]
            against = [_opposite(part) for part in parts]
            match node[0]:
                case "true" | "false":
                    pair = true if node[0] == "true" else _opposite(true)
                case "free":
                    pair = self._all([_opposite(self._literals("", 1, ["name", region])) for region in self._regions] or [true])
                case "name":
                    pair = self._literals("", 1, node)
                case "robot":
                    pair = self._literals(node[1], 1, node[2])
                case "count":
                    pair = self._literals("", node[1], node[2])
                case "not":
                    pair = against[0]
                case "and":
                    pair = self._all(parts)
                case "or":
                    pair = _opposite(self._all(against))
                case "implies":
                    pair = _opposite(self._all([parts[0], against[1]]))
                case "iff" | "xor":
                    differ = self._all([_opposite(self._all(parts)), _opposite(self._all(against))])
                    pair = differ if node[0] == "xor" else _opposite(differ)
                case "eventually":
                    pair = self._until(true, parts[0])
                case "always":
                    pair = _opposite(self._until(true, against[0]))
                case "until":
                    pair = self._until(parts[0], parts[1])
                case "release":
                    pair = _opposite(self._until(against[0], against[1]))
                case "strong":
                    pair = self._until(parts[1], self._all(parts))
                case _:  # weak
                    pair = _opposite(self._until(against[1], self._all(against)))
            pairs[id(node)] = pair
        return pairs[id(tree)][1]

    def _literals(self, robot: str, least: int, counted: Tree) -> _Pair:
        proposition = Proposition(robot, least, json.dumps(counted))
        number = self._asked.setdefault(proposition, len(self._asked))
        return self._add("holds", number), self._add("fails", number)

    def _all(self, parts: Iterable[_Pair]) -> _Pair:
        parts = sorted(set(parts))
        return self._add("and", *(a for a, _ in parts)), self._add("or", *(b for _, b in parts))

    def _until(self, one: _Pair, other: _Pair) -> _Pair:
        return self._add("until", one[0], other[0]), self._add("release", one[1], other[1])

    def _add(self, sign: str, *parts: int) -> int:
        if len(parts) == 1 and sign in ("and", "or"):
            return parts[0]
        if (sign, parts) not in self._numbers:
            self._numbers[sign, parts] = len(self._nodes)
            self._nodes.append((sign, parts))
        return self._numbers[sign, parts]

    @property
    def propositions(self) -> tuple[Proposition, ...]:
        """All that letters of the team are asked for; a letter is the set of those that hold, by their numbers."""
        return tuple(self._asked)

    @property
    def is_combination(self) -> bool:
        """Return whether a formula is one of names alone."""
        return all(one.name for one in self._asked) and not any(sign in ("until", "release") for sign, _ in self._nodes)

    def letter_of(self, shown: frozenset[str]) -> Letter:
        """Return one robot's letter, of propositions that are names."""
        if shown not in self._letters:
            self._letters[shown] = frozenset(number for one, number in self._asked.items() if one.name in shown)
        return self._letters[shown]

    def is_true(self, shown: frozenset[str]) -> bool:
        """Return whether one robot's letter satisfies a combination."""
        return not self.after(self.letter_of(shown), frozenset({self.root}))

    def is_until(self, node: int) -> bool:
        """Return whether a node is an until."""
        return self._nodes[node][0] == "until"

    def empty_word_keeps(self, owed: Owed) -> bool:
        """Return whether the empty word satisfies an alternative."""
        return all(self._nodes[node][0] in ("release", "true") for node in owed)

    def after(self, letter: Letter, owed: Owed) -> Alternatives:
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

    def _parts_after(self, letter: Letter) -> list[Alternatives]:
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
