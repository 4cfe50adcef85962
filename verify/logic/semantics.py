"""Semantics of formulas, straight from the definition: LTL on lassos, LTLf on finite words.

Every subformula gets its truth at every position, from the propositions upwards; no automaton is built. On a
finite word `X` is weak (true at the last letter) and `X[!]` strong, as in Spot. It is the checker's last resort:
each counterexample found elsewhere in `verify` is compared with it.
"""

from __future__ import annotations

from dataclasses import dataclass

from verify.data.errors import BadInput
from verify.data.language.formula import Formula
from verify.data.language.word import Letter, Word

MAX_CELLS = 50_000_000
"""Subformulas times letters that are still evaluated."""


@dataclass(frozen=True, slots=True)
class TruthTable:
    """The truth of every subformula at every position of a word (a lasso's cycle once).

    Attributes:
        word: The word.
        nodes: Every distinct subformula, arguments before what they are arguments of.
        rows: One row for each node; row[i] is its truth at position i.
    """

    word: Word
    nodes: tuple[Formula, ...]
    rows: tuple[tuple[bool, ...], ...]
    index: dict[int, int]

    def at(self, formula: Formula, position: int = 0) -> bool:
        """Return the truth of a subformula (a node of the formula that the table was made for)."""
        return self.rows[self.index[id(formula)]][position]

    def row(self, formula: Formula) -> tuple[bool, ...]:
        """Return the truth of a subformula at every position."""
        return self.rows[self.index[id(formula)]]


def satisfies(formula: Formula, word: Word) -> bool:
    """Return whether a word satisfies a formula: LTLf for a finite word, LTL for a lasso."""
    return truth_table(formula, word).rows[-1][0]


def truth_table(formula: Formula, word: Word) -> TruthTable:
    """Evaluate every subformula at every position.

    Raises:
        BadInput: Formula and word together are too large to evaluate, or an operator is bounded in seconds.
    """
    letters = word.letters
    nodes = _arguments_first(formula)
    if bounded := next((node for node in nodes if node.window not in (None, (0, None))), None):
        raise BadInput(
            f"`{bounded}` is bounded in seconds, which words do not measure; only a flight's times say whether it holds."
        )
    if len(nodes) * len(letters) > MAX_CELLS:
        raise BadInput(f"{len(nodes)} subformulas on {len(letters)} letters are too many to evaluate; {MAX_CELLS} is the most.")
    loop = None if word.cycle is None else len(word.prefix)
    rows: list[tuple[bool, ...]] = []
    index: dict[int, int] = {}
    known: dict[tuple[str, str, tuple[int, ...]], int] = {}
    kept: list[Formula] = []
    for node in nodes:
        arguments = tuple(index[id(argument)] for argument in node.arguments)
        key = (node.operator, node.atom if node.operator in ("name", "count") else "", arguments)
        if key not in known:
            known[key] = len(rows)
            rows.append(tuple(_row(node, [rows[i] for i in arguments], letters, loop)))
            kept.append(node)
        index[id(node)] = known[key]
    last = index[id(formula)]
    if last != len(rows) - 1:  # cannot be: the whole formula is larger than each of its parts
        raise AssertionError("the formula is not the last of its own subformulas")
    return TruthTable(word, tuple(kept), tuple(rows), index)


def _row(node: Formula, arguments: list[tuple[bool, ...]], letters: tuple[Letter, ...], loop: int | None) -> list[bool]:
    n = len(letters)
    match node.operator:
        case "true":
            return [True] * n
        case "false":
            return [False] * n
        case "name" | "count":
            return [node.atom in letter for letter in letters]
        case "!":
            return [not x for x in arguments[0]]
        case "&":
            return [x and y for x, y in zip(*arguments, strict=True)]
        case "|":
            return [x or y for x, y in zip(*arguments, strict=True)]
        case "xor":
            return [x != y for x, y in zip(*arguments, strict=True)]
        case "->":
            return [not x or y for x, y in zip(*arguments, strict=True)]
        case "<->":
            return [x == y for x, y in zip(*arguments, strict=True)]
        case "X" | "X[!]":
            after_last = arguments[0][loop] if loop is not None else node.operator == "X"
            return [*arguments[0][1:], after_last]
        case "F":
            return _backwards([True] * n, arguments[0], loop, start=False, release=False)
        case "G":
            return _backwards([False] * n, arguments[0], loop, start=True, release=True)
        case "U" | "W":
            return _backwards(arguments[0], arguments[1], loop, start=node.operator == "W", release=False)
        case "R" | "M":
            return _backwards(arguments[0], arguments[1], loop, start=node.operator == "R", release=True)
        case _:  # it speaks of how many robots there are
            raise BadInput(f"`{node}` is no formula on letters; `written_out` says for a team what it comes to.")


def _backwards(
    first: list[bool] | tuple[bool, ...], second: tuple[bool, ...], loop: int | None, *, start: bool, release: bool
) -> list[bool]:
    """Solve x[i] = second[i] or (first[i] and x[i + 1]), or its dual for releases, from the end.

    `start` is the value after the last letter: false for the least solution (U, F, M), true for the greatest (W, R, G).
    On a lasso one more round through the cycle brings the value that comes back from its beginning.
    """
    values = [start] * len(second)
    following = start
    for _ in range(1 if loop is None else 2):
        for i in range(len(second) - 1, -1, -1):
            following = second[i] and (first[i] or following) if release else second[i] or (first[i] and following)
            values[i] = following
        if loop is not None:
            following = values[loop]
    return values


def _arguments_first(formula: Formula) -> list[Formula]:
    """Return all nodes, each once, arguments before their users, without recursion."""
    order: list[Formula] = []
    seen: set[int] = set()
    stack: list[tuple[Formula, bool]] = [(formula, False)]
    while stack:
        node, ready = stack.pop()
        if ready:
            order.append(node)
        elif id(node) not in seen:
            seen.add(id(node))
            stack.append((node, True))
            stack.extend((argument, False) for argument in node.arguments)
    return order
