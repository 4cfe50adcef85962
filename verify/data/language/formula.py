"""Linear temporal logic as a value: formulas, what they name, and how they are printed.

Under `team: joint` a formula may also speak of robots: `NAME.p`, `count(B) >= k`, `all(B)`, `some(B)`, `ever(B) <= k`, `each(f)`. Such a node
says something of all robots' letters at one time; `counting` writes it out for a team, after which only propositions (`Formula.atom`)
are left. Temporal operators but X may be bounded in seconds (`F[0,10] a`; Alur, Feder and Henzinger 1996). `formula_reader` reads text.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from decimal import Context, Decimal
from fractions import Fraction
from typing import Literal, TypeVar

from verify.data.errors import BadInput

Operator = Literal[
    "true", "false", "name", "!", "F", "G", "X", "X[!]", "&", "|", "xor", "->", "<->", "U", "W", "R", "M",
    "count", "all", "some", "ever", "each",
]  # fmt: skip
Comparison = Literal[">=", "<=", "==", "<", ">"]

COUNTING = frozenset({"count", "all", "some", "ever", "each"})
"""Operators that speak of several robots' letters."""

BOUNDED = frozenset({"count", "ever"})
"""Numbers of robots, which are compared with a number."""

WRITTEN_OUT = COUNTING - {"count"}
"""Operators that come to others; to which, depends on the robots that there are."""

RESERVED_NAMES = frozenset({"F", "G", "X", "U", "W", "R", "M", "V", "true", "false", "xor"}) | COUNTING
"""Words that the formula language keeps for itself."""

FREE = "free"
"""The built-in proposition of a mission's formula that means "in no region"."""

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")

TEMPORAL = frozenset({"F", "G", "U", "W", "R", "M", "X", "X[!]"})
TIMED = TEMPORAL - {"X", "X[!]"}
"""Operators that may be bounded in seconds."""
PREFIX = frozenset({"!", "F", "G", "X", "X[!]"})
# operator -> (left binding power, right binding power); a smaller right power makes it right-associative
INFIX: Mapping[str, tuple[int, int]] = {
    "->": (2, 1), "<->": (2, 1), "|": (3, 4), "xor": (5, 6), "&": (7, 8),
    "U": (10, 9), "W": (10, 9), "R": (10, 9), "M": (10, 9),
}  # fmt: skip
PREFIX_POWER = 11
DECIMALS = 12
"""Digits that a bound in seconds may have before its point, and behind it."""
COMPARISONS = frozenset({">=", "<=", "==", "<", ">"})
_ARGUMENTS: Mapping[object, int] = {
    "true": 0, "false": 0, "name": 0, **dict.fromkeys(PREFIX, 1), **dict.fromkeys(INFIX, 2), **dict.fromkeys(COUNTING, 1),
}  # fmt: skip


Window = tuple[Fraction, Fraction | None]


Result = TypeVar("Result")


@dataclass(frozen=True, slots=True, eq=False)
class Formula:
    """One node of a formula: an operator and its arguments.

    Attributes:
        operator: "name" for a proposition, "true", "false", or the operator's own sign.
        arguments: None, one or two formulas.
        name: The proposition's name, for operator "name"; otherwise empty.
        position: Offset of this node's operator or name in the text that it was read from (not compared).
        robot: For operator "name": the robot whose letter is meant (`quad0.dock`); empty for a plain name.
        bound: For the operators `BOUNDED`: what the number of robots is compared with, such as (">=", 2); otherwise None.
        window: For the operators `TIMED`: bounds on the time from now, s, the second one None for no end; None for all time.
    """

    operator: Operator
    arguments: tuple[Formula, ...] = ()
    name: str = ""
    position: int = field(default=0, compare=False)
    robot: str = ""
    bound: tuple[Comparison, int] | None = None
    window: Window | None = None
    _hash: int | None = field(default=None, init=False, repr=False)

    def __hash__(self) -> int:
        if self._hash is None:
            object.__setattr__(self, "_hash", self.rebuilt(lambda node, parts: hash((node._own, parts))))
        return self._hash or 0

    def __reduce__(self) -> tuple[object, ...]:  # hashes of other processes are others
        return Formula, (self.operator, self.arguments, self.name, self.position, self.robot, self.bound, self.window)

    def __eq__(self, other: object) -> bool:
        pairs: list[tuple[object, object]] = [(self, other)]
        for one, another in pairs:  # grows while it is walked
            if one is not another:
                if not isinstance(one, Formula) or not isinstance(another, Formula) or one._own != another._own:
                    return False
                pairs += zip(one.arguments, another.arguments, strict=True)
        return True

    @property
    def _own(self) -> tuple[object, ...]:
        """The formula without its arguments."""
        return self.operator, len(self.arguments), self.name, self.robot, self.bound, self.window

    @property
    def atom(self) -> str:
        """The proposition that a name or a count is for whoever reads letters of a whole team: `dock`, `quad0.dock`, `count(dock) >= 2`."""
        return self.name if self.operator == "name" and not self.robot else str(self)

    @property
    def counts(self) -> bool:
        """True if it names single robots or counts them."""
        return any(node.operator in COUNTING or node.robot for node in self.nodes())

    def names(self) -> frozenset[str]:
        """Return the propositions of robots that occur, those that are counted too."""
        return frozenset(node.name for node in self.nodes() if node.operator == "name")

    def walk(self) -> Iterator[Formula]:
        """Yield this node and all below it, parents first, one that is shared as often as it occurs."""
        stack: list[Formula] = [self]
        while stack:
            node = stack.pop()
            yield node
            stack.extend(reversed(node.arguments))

    def conjuncts(self) -> tuple[Formula, ...]:
        """Return the parts of the topmost conjunction (the formula itself where there is none)."""
        found: list[Formula] = []
        stack: list[Formula] = [self]
        while stack:
            node = stack.pop()
            if node.operator == "&":
                stack.extend(reversed(node.arguments))
            else:
                found.append(node)
        return tuple(found)

    def substitute(self, values: Mapping[str, Formula]) -> Formula:
        """Return the formula with each proposition in `values` replaced; of one robot's, by the same of that robot."""

        def made(node: Formula, arguments: tuple[Formula, ...]) -> Formula:
            if node.operator != "name":
                return replace(node, arguments=arguments)
            value = values.get(node.name, node)
            return value.of(node.robot) if node.robot and value is not node else value

        return self.rebuilt(made)

    def rebuilt(self, made: Callable[[Formula, tuple[Result, ...]], Result]) -> Result:
        """Return what is made of the formula from its leaves upwards, without recursion: conjunctions are as deep as they are long.

        Args:
            made: From a node and what was made of its arguments to what is made of it; asked once of a node that is shared.
        """
        found: dict[int, Result] = {}
        stack: list[Formula] = [self]
        while stack:
            node = stack[-1]
            missing = [argument for argument in node.arguments if id(argument) not in found]
            stack += missing
            if not missing:
                stack.pop()
                found[id(node)] = made(node, tuple([found[id(argument)] for argument in node.arguments]))
        return found[id(self)]

    def of(self, robot: str) -> Formula:
        """Return the formula with plain names meaning one robot's; counts count all robots as before.

        Args:
            robot: Its name.
        """

        def made(node: Formula, arguments: tuple[Formula, ...]) -> Formula:
            if node.operator == "name":
                return node if node.robot else replace(node, robot=robot)
            return node if node.operator in COUNTING else replace(node, arguments=arguments)

        return self.rebuilt(made)

    def uses_next(self) -> bool:
        """Return whether an X or X[!] occurs, so that truth depends on how time is sampled."""
        return any(node.operator in ("X", "X[!]") for node in self.nodes())

    @property
    def timed(self) -> bool:
        """True if an operator is bounded in seconds."""
        return any(node.window is not None for node in self.nodes())

    def nodes(self) -> Iterator[Formula]:
        """Yield this node and all below it, one that is shared only once."""
        seen: set[int] = set()
        stack: list[Formula] = [self]
        while stack:
            node = stack.pop()
            if id(node) not in seen:
                seen.add(id(node))
                yield node
                stack.extend(node.arguments)

    def quoted(self) -> str:
        """Return the formula fully parenthesised with quoted names, a count as one name, for Spot.

        Raises:
            BadInput: An operator is bounded in seconds.
        """
        if bounded := next((node for node in self.walk() if node.window is not None), None):
            raise BadInput(f"`{bounded}` is bounded in seconds, which no automaton over words measures.")
        return self._text(quote=True, power=0)

    def __str__(self) -> str:
        return self._text(quote=False, power=0)

    @property
    def bounds(self) -> str:
        """Bounds in seconds as text, behind an operator that has any: `[0,10]`."""
        if self.window is None:
            return ""
        low, high = self.window
        return f"[{decimal(low)},{'inf' if high is None else decimal(high)}]"

    @property
    def _sign(self) -> str:
        return f"{self.operator}{self.bounds}"

    def _text(self, *, quote: bool, power: int) -> str:
        match self.operator:
            case "true":
                return "1" if quote else "true"
            case "false":
                return "0" if quote else "false"
            case "name":
                if self.robot:
                    return f'"{self.robot}.{self.name}"' if quote else f"{self.robot}.{self.name}"
                return f'"{self.name}"' if quote or not NAME.fullmatch(self.name) else self.name
            case operator if operator in COUNTING:
                text = f"{self.operator}({self.arguments[0]._text(quote=False, power=0)})"
                if self.bound is not None:
                    text = f"{text} {self.bound[0]} {self.bound[1]}"
                return f'"{text}"' if quote else text
            case "!" | "F" | "G" | "X" | "X[!]":
                text = self.arguments[0]._text(quote=quote, power=PREFIX_POWER)
                if self.operator == "!":
                    return f"!({text})" if self.arguments[0].operator in BOUNDED and not quote else f"!{text}"
                return f"{self._sign} {text}"
            case _:
                left, right = self.arguments
                bind_left, bind_right = INFIX[self.operator]
                first = left._text(quote=quote, power=max(bind_left, bind_right))
                second = right._text(quote=quote, power=bind_right)
                text = f"{first} {self._sign} {second}"
                return f"({text})" if quote or power > min(bind_left, bind_right) else text


def decimal(seconds: Fraction) -> str:
    """Return a number as it is read again: in decimals, all of them, whatever precision the caller has set."""
    return format(Context(prec=28).divide(Decimal(seconds.numerator), Decimal(seconds.denominator)), "f")


TRUE = Formula("true")
FALSE = Formula("false")


def _is_window(window: object) -> bool:
    """Return whether bounds are exact decimals of seconds, the first from 0 on, the second, if any, no less."""
    if not isinstance(window, tuple) or len(window) != 2:
        return False
    low, high = window
    numbers = [low] if high is None else [low, high]
    exact = all(isinstance(number, Fraction) and 10**DECIMALS % number.denominator == 0 for number in numbers)
    return exact and numbers == sorted(numbers) and numbers[0] >= 0 and numbers[-1] < 10**DECIMALS


def check_formula(formula: Formula) -> Formula:
    """Return a formula that was made in code, if its operators have the arguments that they need.

    Raises:
        BadInput: They have not.
    """
    stack: list[object] = [formula]
    seen: set[int] = set()
    while stack:
        node = stack.pop()
        if not isinstance(node, Formula) or node.operator not in _ARGUMENTS or not isinstance(node.arguments, tuple):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
            raise BadInput(f"A formula is made of Formula values with known operators; {node!r:.80} is none.")
        bound = node.bound is not None and node.bound[0] in COMPARISONS
        if (
            len(node.arguments) != _ARGUMENTS[node.operator]
            or (node.operator == "name") != bool(node.name)
            or (node.operator in BOUNDED) != bound
            or (node.robot and node.operator != "name")
            or (node.window is not None and (node.operator not in TIMED or not _is_window(node.window)))
        ):
            raise BadInput(
                f"A Formula with operator `{node.operator}` is not {node!r:.80}: its arguments or its name do not fit."
            )
        if id(node) not in seen:
            seen.add(id(node))
            stack.extend(node.arguments)
    return formula
