"""Formulas in negation normal form, as tables in which equal parts stand once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from verify.data.errors import BadInput
from verify.data.language.formula import NAME, Formula
from verify.data.language.formula_error import FormulaError
from verify.data.language.formula_reader import parse_formula

NodeKind = Literal["true", "false", "name", "not", "and", "or", "F", "G", "U", "W", "R", "M", "X", "X[!]"]


@dataclass(frozen=True, slots=True)
class Normal:
    """A formula in negation normal form as a table: entry i uses only entries before it.

    Attributes:
        kinds: Operator of each entry; "not" only on names.
        arguments: Entries that it applies to; any number for "and" and "or".
        names: Proposition of "name" and "not" entries.
        root: The whole formula.
    """

    kinds: tuple[NodeKind, ...]
    arguments: tuple[tuple[int, ...], ...]
    names: tuple[str, ...]
    root: int

    @property
    def propositions(self) -> frozenset[str]:
        """Names that the root depends on."""
        seen, stack, found = set[int](), [self.root], set[str]()
        while stack:
            entry = stack.pop()
            if entry not in seen:
                seen.add(entry)
                stack.extend(self.arguments[entry])
                if self.names[entry]:
                    found.add(self.names[entry])
        return frozenset(found)

    @property
    def uses_next(self) -> bool:
        """Return whether X or X[!] occurs."""
        return any(kind in ("X", "X[!]") for kind in self.kinds)


_DUAL: dict[str, NodeKind] = {"F": "G", "G": "F", "U": "R", "R": "U", "W": "M", "M": "W", "X": "X[!]", "X[!]": "X"}


def normal_form(formula: Formula, *, negated: bool = False) -> Normal:
    """Push negations down to the propositions (of the formula, or of its negation)."""
    table = _Table()
    done: dict[tuple[int, bool], int] = {}
    stack: list[tuple[Formula, bool]] = [(formula, negated)]
    while stack:
        node, negative = stack[-1]
        if (id(node), negative) in done:
            stack.pop()
            continue
        needed = [(argument, sign) for argument, sign in _signed_arguments(node, negative) if (id(argument), sign) not in done]
        if needed:
            stack.extend(needed)
            continue
        stack.pop()
        done[id(node), negative] = _entry(node, negative, table, done)
    return table.finish(done[id(formula), negated])


def _signed_arguments(node: Formula, negative: bool) -> list[tuple[Formula, bool]]:
    """Return the arguments whose normal forms that of a node is made of, each as it is or negated."""
    if node.operator == "count":
        return []  # one proposition
    if node.operator in ("xor", "<->"):
        return [(argument, sign) for argument in node.arguments for sign in (False, True)]
    if node.operator == "!":
        return [(node.arguments[0], not negative)]
    if node.operator == "->":
        return [(node.arguments[0], not negative), (node.arguments[1], negative)]
    if node.operator in ("&", "|"):
        return [(argument, negative) for argument in _operands(node)]
    return [(argument, negative) for argument in node.arguments]


def _operands(node: Formula) -> list[Formula]:
    """Return what a chain of one junction joins, each once, so that a chain of thousands is one entry at once."""
    found: list[Formula] = []
    seen: set[int] = set()
    stack = list(node.arguments)
    while stack:
        part = stack.pop()
        if id(part) in seen:
            continue
        seen.add(id(part))
        if part.operator == node.operator:
            stack.extend(part.arguments)
        else:
            found.append(part)
    return found


def _entry(node: Formula, negative: bool, table: _Table, done: dict[tuple[int, bool], int]) -> int:
    arguments = [done[id(argument), sign] for argument, sign in _signed_arguments(node, negative)]
    match node.operator:
        case "true" | "false":
            return table.constant((node.operator == "true") != negative)
        case "name" | "count":
            return table.add("not" if negative else "name", (), node.atom)
        case "!":
            return arguments[0]
        case "&" | "|" | "->":
            conjunction = (node.operator == "&") != negative
            return table.junction("and" if conjunction else "or", arguments)
        case "xor" | "<->":
            left, not_left, right, not_right = arguments
            if (node.operator == "xor") != negative:
                pairs = ((left, not_right), (not_left, right))
            else:
                pairs = ((left, right), (not_left, not_right))
            return table.junction("or", [table.junction("and", list(pair)) for pair in pairs])
        case _:
            if node.window not in (None, (0, None)):
                raise BadInput(
                    f"`{node}` is bounded in seconds, which words do not measure; only a flight's times say whether it holds."
                )
            kind: NodeKind = _DUAL[node.operator] if negative else node.operator  # type: ignore[assignment]  # the temporal ones
            return table.temporal(kind, tuple(arguments))


class _Table:
    """Entries under construction; equal entries are one."""

    def __init__(self) -> None:
        self.entries: list[tuple[NodeKind, tuple[int, ...], str]] = []
        self.known: dict[tuple[NodeKind, tuple[int, ...], str], int] = {}

    def add(self, kind: NodeKind, arguments: tuple[int, ...] = (), name: str = "") -> int:
        key = (kind, arguments, name)
        if key not in self.known:
            self.known[key] = len(self.entries)
            self.entries.append(key)
        return self.known[key]

    def constant(self, value: bool) -> int:
        return self.add("true" if value else "false")

    def junction(self, kind: Literal["and", "or"], arguments: Iterable[int]) -> int:
        """Flatten, sort and shorten a conjunction or disjunction."""
        parts = set[int]()
        for argument in arguments:
            inner = self.entries[argument]
            parts.update(inner[1] if inner[0] == kind else (argument,))
        absorbing, neutral = ("false", "true") if kind == "and" else ("true", "false")
        kinds = {self.entries[part][0] for part in parts}
        if absorbing in kinds:
            return self.constant(kind == "or")
        parts = {part for part in parts if self.entries[part][0] != neutral}
        literals = {(self.entries[p][0], self.entries[p][2]) for p in parts}
        if any(k == "name" and ("not", name) in literals for k, name in literals):
            return self.constant(kind == "or")
        if not parts:
            return self.constant(kind == "and")
        return min(parts) if len(parts) == 1 else self.add(kind, tuple(sorted(parts)))

    def temporal(self, kind: NodeKind, arguments: tuple[int, ...]) -> int:
        """Add a temporal entry; G F G x and the like are shortened only where that holds on every trace."""
        inner = self.entries[arguments[0]]
        if kind in ("F", "G") and inner[0] == kind:  # F F x = F x, G G x = G x
            return arguments[0]
        if kind == "G" and inner[0] == "and":  # G(x & y) = G x & G y, so that conjuncts come apart
            return self.junction("and", [self.temporal("G", (part,)) for part in inner[1]])
        if kind == "F" and inner[0] == "or":
            return self.junction("or", [self.temporal("F", (part,)) for part in inner[1]])
        if kind in ("F", "G") and inner[0] in ("true", "false"):  # traces are not empty
            return arguments[0]
        return self.add(kind, arguments)

    def finish(self, root: int) -> Normal:
        kinds, arguments, names = zip(*self.entries, strict=True)
        return Normal(tuple(kinds), tuple(arguments), tuple(names), root)


def conjuncts(normal: Normal) -> tuple[Normal, ...]:
    """Return the parts of the topmost conjunction.

    A claim about every word of a set holds for a conjunction exactly where it holds for each part, and parts
    are far smaller.
    """
    parts = normal.arguments[normal.root] if normal.kinds[normal.root] == "and" else (normal.root,)
    return tuple(_restricted(normal, part) for part in parts)


def _restricted(normal: Normal, root: int) -> Normal:
    """Return the table of one entry alone."""
    seen, stack = {root}, [root]
    while stack:
        for argument in normal.arguments[stack.pop()]:
            if argument not in seen:
                seen.add(argument)
                stack.append(argument)
    old = sorted(seen)
    new = {entry: i for i, entry in enumerate(old)}
    return Normal(
        tuple(normal.kinds[i] for i in old),
        tuple(tuple(new[a] for a in normal.arguments[i]) for i in old),
        tuple(normal.names[i] for i in old),
        new[root],
    )


def to_formula(normal: Normal, renamed: Mapping[str, str] | None = None) -> Formula:
    """Return the table as a formula again, for messages and for Spot.

    Args:
        normal: The table.
        renamed: New plain names for its propositions; None keeps them as they are.
    """
    made = proposition if renamed is None else lambda text: Formula("name", (), renamed[text])
    built: list[Formula] = []
    for kind, arguments, name in zip(normal.kinds, normal.arguments, normal.names, strict=True):
        match kind:
            case "name":
                built.append(made(name))
            case "not":
                built.append(Formula("!", (made(name),)))
            case "and" | "or":
                built.append(_balanced("&" if kind == "and" else "|", [built[a] for a in arguments]))
            case _:
                built.append(Formula(kind, tuple(built[a] for a in arguments)))
    return built[normal.root]


@lru_cache(maxsize=4096)
def proposition(text: str) -> Formula:
    """Return the formula of which a text is the proposition: a name, a robot's name or a count."""
    if not NAME.fullmatch(text) and ("." in text or "(" in text):
        try:
            found = parse_formula(text)
        except FormulaError:
            return Formula("name", (), text)
        if (found.robot or found.operator == "count") and found.atom == text:
            return found
    return Formula("name", (), text)


def _balanced(operator: Literal["&", "|"], parts: list[Formula]) -> Formula:
    while len(parts) > 1:
        paired = [Formula(operator, (a, b)) for a, b in zip(parts[::2], parts[1::2], strict=False)]
        parts = paired + parts[len(paired) * 2 :]
    return parts[0]
