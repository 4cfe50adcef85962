"""Formulas: nested lists read into a table, printed, and what is left of one after a letter (progression).

All operators come to constants, propositions, negation, `and` and `until`:

    F f = true U f     G f = !F !f     f R g = !(!f U !g)     f W g = g R (f | g)     f M g = g U (f & g)

*Progression.* A word with first letter a satisfies a formula exactly if the rest of it satisfies one of the formula's *alternatives* after a. Each is
a set of untils and negated ones, all of which are still owed. For `f U g` that is g's alternatives, or f's with `f U g` owed again: then it was *put
off*. The empty word keeps negated untils and no others. (Coq: `progress_state_sat`, `accepts_sound`; `normal_sat` of negations.)

A proposition is a number of robots: at least k of some robots' letters satisfy a combination of names. A plain name is one robot of all. Operators
may have bounds in seconds (`U[0,10]`), which are for `timing`: words measure no time.
"""

import json
import math
import re
from collections.abc import Callable, Collection, Iterable
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple

from .statement import ZERO, few, require

Tree = Any  # of any type: JSON nests

_COUNTING = {"robot": str, "count": int}
_OPERATORS = ("true", "false", "free"), ("!", "F", "G"), ("->", "<->", "xor", "U", "R", "W", "M")
_SECONDS = "[0-9]{1,12}(?:[.][0-9]{1,12})?"
_BOUNDED = re.compile(rf"(until|[FGURWM])\[({_SECONDS}),({_SECONDS}|inf)\]")

Letter = frozenset[int]  # numbers of the propositions that hold
Owed = frozenset[int]
"""One alternative: what the rest of a word has to satisfy, all of it: twice the number of a table's node, or one more for its negation."""
Alternatives = tuple[tuple[Owed, Owed], ...]  # what may be owed after a letter, and which untils were then put off
_NOTHING: Alternatives = ((frozenset(), frozenset()),)


def operands(tree: Tree) -> list[Tree]:
    """Return the formulas that an operator joins; none of a proposition."""
    require(isinstance(tree, list) and tree and isinstance(tree[0], str), "a formula is no list that begins with its operator")
    sign, *rest = tree
    if sign == "name":
        fits, rest = len(rest) == 1 and isinstance(rest[0], str), []
    elif sign in _COUNTING:
        fits, rest = len(rest) == 2 and type(rest[0]) is _COUNTING[sign], rest[1:]
    else:
        name, low, high = window(sign)
        fits = low <= high and ((name in ("&", "|") and rest) or (len(rest) < 3 and name in _OPERATORS[len(rest)]))
    require(fits, f"a formula's part {sign[:40]!r} is not covered by the kernel")
    return rest


def window(sign: str) -> tuple[str, Fraction, Fraction | float]:
    """Return an operator's name, and its bounds; for all time without any."""
    if match := _BOUNDED.fullmatch(sign):
        return match[1], Fraction(match[2]), math.inf if match[3] == "inf" else Fraction(match[3])
    return sign, ZERO, math.inf


def bottom_up(tree: Tree, *, counted: bool) -> list[Tree]:
    """Return a formula and all its parts, parts first; `counted` goes into what is asked of single robots."""
    found: list[Tree] = []
    waiting = [(tree, 0)]
    while waiting:
        node, depth = waiting.pop()
        found.append(node)
        few(len(found), "parts of a formula")
        few(depth, "parts of a formula in one another")
        parts = operands(node)
        waiting += [(part, depth + 1) for part in parts] if counted or node[0] not in _COUNTING else []
    return found[::-1]


def show(tree: Tree) -> str:
    """Return a formula as text, in the missions' syntax."""
    texts: dict[int, str] = {}
    for node in bottom_up(tree, counted=True):
        sign, parts = node[0], [texts[id(part)] for part in operands(node)]
        if sign in _COUNTING:
            text = f"{node[1]}.{parts[0]}" if sign == "robot" else f"(count({parts[0]}) >= {node[1]})"
        elif not parts:
            text = node[-1]
        else:
            ahead = sign if sign == "!" else f"{sign} "
            text = f"{ahead}{parts[0]}" if sign[0] in ("!", "F", "G") else f"({f' {sign} '.join(parts)})"
        texts[id(node)] = text
    return texts[id(tree)]


def conjuncts(tree: Tree) -> list[Tree]:
    """Return formulas that together say what one says: parts of conjunctions, also of those that hold always."""
    found: list[Tree] = []
    waiting: list[tuple[Tree, bool]] = [(tree, False)]
    while waiting:
        node, always = waiting.pop()
        parts = operands(node)
        if node[0] in ("&", "G"):
            waiting += [(part, always or node[0] == "G") for part in reversed(parts)]
        else:
            found.append(["G", node] if always else node)
    return found


class Proposition(NamedTuple):
    """At least `least` of all robots, or one that is named, satisfy a combination of names, text of JSON; `name` where it is a plain name."""

    robot: str
    least: int
    counted: str
    name: str


class Table:
    """A formula as a table in which parts stand once, each after its own parts; of two, one is a node and the other its negation.

    `root` is the formula's negation, which a word that breaks the formula satisfies. `propositions` are all that letters of the team are asked for,
    with their numbers; a letter is the set of those that hold. `free` speaks of all regions.
    """

    def __init__(self, tree: Tree, regions: Collection[str]) -> None:
        self.nodes: list[tuple[str, tuple[int, ...]]] = []
        self.propositions: dict[Proposition, int] = {}
        self._numbers: dict[tuple[str, tuple[int, ...]], int] = {}
        self._after: dict[Letter, list[Alternatives]] = {}
        self._known: dict[tuple[Letter, Owed], Alternatives] = {}
        read: dict[int, int] = {}
        for node in bottom_up(tree, counted=False):
            sign, parts = node[0], [] if node[0] in _COUNTING else [read[id(part)] for part in operands(node)]
            asked: Any = {"name": ("", 1, node), "count": ("", *node[1:]), "robot": (*node[1:2], 1, *node[2:])}.get(sign)
            if sign == "free":
                read[id(node)] = self._and(*(self._proposition("", 1, ["name", one]) ^ 1 for one in sorted(regions)))
            else:
                read[id(node)] = self._joined(sign, parts) if asked is None else self._proposition(*asked)
        self.root = read[id(tree)] ^ 1

    def _joined(self, sign: str, parts: list[int]) -> int:
        """Return what an operator makes of its parts; `^ 1` is negation."""
        also, name = self._and, window(sign)[0]
        until = partial(self._add, f"until{sign.removeprefix(name)}")
        against, (a, b) = [part ^ 1 for part in parts], (*parts, 0, 0)[:2]
        made: dict[str, Callable[[], int]] = {
            "true": also,
            "false": lambda: also() ^ 1,
            "!": lambda: a ^ 1,
            "&": lambda: also(*parts),
            "|": lambda: also(*against) ^ 1,
            "->": lambda: also(a, b ^ 1) ^ 1,
            "xor": lambda: also(also(*parts) ^ 1, also(*against) ^ 1),
            "<->": lambda: also(also(*parts) ^ 1, also(*against) ^ 1) ^ 1,
            "F": lambda: until(also(), a),
            "G": lambda: until(also(), a ^ 1) ^ 1,
            "U": lambda: until(a, b),
            "R": lambda: until(a ^ 1, b ^ 1) ^ 1,
            "M": lambda: until(b, also(a, b)),
            "W": lambda: until(b ^ 1, also(a ^ 1, b ^ 1)) ^ 1,
        }
        return made[name]()

    def _proposition(self, robot: str, least: int, counted: Tree) -> int:
        name = counted[1] if not operands(counted) and (robot, least, counted[0]) == ("", 1, "name") else ""
        one = Proposition(robot, least, json.dumps(counted), name)
        return self._add("holds", self.propositions.setdefault(one, len(self.propositions)))

    def _and(self, *parts: int) -> int:
        parts = tuple(sorted(set(parts)))
        return parts[0] if len(parts) == 1 else self._add("and", *parts)

    def _add(self, sign: str, *parts: int) -> int:
        if (sign, parts) not in self._numbers:
            self._numbers[sign, parts] = 2 * len(self.nodes)
            self.nodes.append((sign, parts))
        return self._numbers[sign, parts]

    def letter_of(self, shown: frozenset[str]) -> Letter:
        """Return one robot's letter, of propositions that are names."""
        return frozenset(number for one, number in self.propositions.items() if one.name in shown)

    def is_true(self, shown: frozenset[str]) -> bool:
        """Return whether one robot's letter satisfies a combination, which is a formula of names alone."""
        return not self.after(self.letter_of(shown), frozenset({self.root}))

    def empty_word_keeps(self, owed: Owed) -> bool:
        """Return whether the empty word satisfies an alternative: it keeps negated untils, and what is true."""
        every = [(*self.nodes[part // 2], part % 2) for part in owed]
        return all(negated == (sign == "until") and (sign == "until" or not parts) for sign, parts, negated in every)

    def after(self, letter: Letter, owed: Owed) -> Alternatives:
        """Return the alternatives of what is owed, all of it, after a letter."""
        if (letter, owed) not in self._known:
            parts = self._parts_after(letter)
            self._known[letter, owed] = _all_of(parts[part] for part in sorted(owed))
        return self._known[letter, owed]

    def _parts_after(self, letter: Letter) -> list[Alternatives]:
        if letter not in self._after:
            found: list[Alternatives] = []
            for number, (sign, parts) in enumerate(self.nodes):
                owed = frozenset({2 * number}), frozenset({2 * number + 1})
                if sign == "holds":
                    found += [_NOTHING, ()] if parts[0] in letter else [(), _NOTHING]
                elif sign == "and":
                    found += [_all_of(found[part] for part in parts), _least(one for part in parts for one in found[part ^ 1])]
                else:
                    require(sign == "until", "a word has no time for bounds")
                    a, b = parts
                    found.append(_least((*found[b], *_all_of([found[a], ((owed[0], owed[0]),)]))))
                    found.append(_all_of([found[b ^ 1], _least((*found[a ^ 1], (owed[1], frozenset())))]))
            self._after[letter] = found
        return self._after[letter]


def _all_of(every: Iterable[Alternatives]) -> Alternatives:
    found = _NOTHING
    for one in every:
        few(len(found) * len(one), "alternatives of what is left of a formula")
        found = _least((a | b, put | off) for a, put in found for b, off in one)
    return found


def _least(alternatives: Iterable[tuple[Owed, Owed]]) -> Alternatives:
    """Leave out alternatives that ask for no less than another one: whoever satisfies them satisfies that."""
    kept: list[tuple[Owed, Owed]] = []
    for owed, off in sorted(set(alternatives), key=lambda one: (len(one[0]), len(one[1]), sorted(one[0]), sorted(one[1]))):
        if not any(a <= owed and b <= off for a, b in kept):
            kept.append((owed, off))
    return tuple(kept)
