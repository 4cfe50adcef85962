"""Linear temporal logic as text: our own reader, so that names mean what the user wrote.

Spot's lexer reads `F Gate1` as `F G ate1` and `FIRE` as `F IRE`. Here a name is a letter or `_` followed by
letters, digits and `_`, and an operator letter is an operator only when it stands alone, or where a name cannot
stand (`GF(a)`, `FG!a`). What Spot prints without spaces (`GFa`) is one name here, and is refused where there is no such
name. The grammar and the precedences are Spot's (loosest first: `->` `<->`, `|`, `xor`, `&`, `U W R M`, then the prefix
operators `F G X X[!] !`); the tests hold this reader against Spot's on random formulas. What counts robots or names one
(`count(B) >= 2`, `quad0.dock`) is an operand.
Whoever passes a formula on to Spot uses `Formula.quoted`.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from fractions import Fraction

from verify.data.errors import BadInput, did_you_mean
from verify.data.language.formula import (
    BOUNDED,
    COUNTING,
    DECIMALS,
    INFIX,
    NAME,
    PREFIX,
    PREFIX_POWER,
    TEMPORAL,
    TIMED,
    Comparison,
    Formula,
    Window,
)  # fmt: skip
from verify.data.language.formula_error import FormulaError
from verify.data.language.formula_tokens import GLUED, LATE, Token, tokenise, unreadable

MAX_LENGTH = 100_000
MAX_DEPTH = 200

_WORDS: Mapping[str, str] = {
    "and": "&", "or": "|", "not": "!", "implies": "->", "until": "U", "always": "G", "globally": "G", "eventually": "F",
    "finally": "F", "f": "F", "g": "G", "u": "U", "w": "W", "r": "R", "m": "M",
}  # fmt: skip
"""What people write for an operator, as a hint where a formula cannot be read."""
_EXAMPLES = {
    "count": "count(dock) >= 2", "all": "all(dock)", "some": "some(dock)", "ever": "ever(dock) <= 1",
    "each": "each(F dock)",
}  # fmt: skip


def parse_formula(
    text: str,
    names: Collection[str] | None = None,
    *,
    shown: Collection[str] = (),
    robots: Collection[str] | None = None,
    allow_next: bool = True,
) -> Formula:
    """Read a formula.

    Args:
        text: LTL in Spot's syntax, without SERE operators.
        names: The propositions that exist; None accepts any name but those that are operators without spaces, such as `GFa`.
        shown: Where any name is accepted: names that are known to exist, such as those of a word that is held against it.
        robots: The robots that exist, for `NAME.p`; None accepts any.
        allow_next: Whether `X` and `X[!]` may occur. A mission's formula may not use them, because its
            truth would then depend on how time is sampled.

    Raises:
        FormulaError: The text is no formula, or names something unknown; all unknown names are reported
            together, each with a caret under its place.
    """
    if not isinstance(text, str):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput(f"A formula is a text, not {type(text).__name__}.")
    if len(text) > MAX_LENGTH:
        raise FormulaError(text[:60], [(0, f"The formula has {len(text)} characters; {MAX_LENGTH} is the most.")])
    tokens = tokenise(text)
    if not tokens:
        raise FormulaError(text, [(0, "The formula is empty; write `true` for no requirement.")])
    formula = _Parser(text, tokens).read()
    faults = [*_strange_counts(formula), *_strange_robots(text, formula, robots)]
    known = frozenset(shown) | formula.names() if names is None else frozenset(names)
    for node in formula.walk():
        if node.operator in ("X", "X[!]") and not allow_next:
            faults.append(
                (node.position, f"`{node.operator}` is not allowed in a mission: flight has no next step, so its "
                 "truth would depend on how time is sampled. Use F, G, U, W, R or M.")
            )  # fmt: skip
        if node.operator != "name" or node.name in (shown if names is None else names):
            continue
        spaced = None if text[node.position] == '"' else _with_spaces(node.name, known)
        hint = "" if spaced is None else f"`{node.name}` is one name here; write `{spaced}`"
        if names is not None:
            listed = ", ".join(sorted(names)) or "(none)"
            hint = f" {hint}." if hint else did_you_mean(node.name, names)
            if node.name in (robots or ()):
                hint = f" It is a robot; write `{node.name}.p` where p is what it shows."
            faults.append((node.position, f"'{node.name}' is not a name of this mission.{hint} Names: {listed}."))
        elif hint:
            faults.append((node.position, f'{hint}, or `"{node.name}"` where it is meant as a name.'))
    if faults:
        raise FormulaError(text, sorted(faults))
    return formula


_INSIDE = "asks each robot for its own letter at one time, so a Boolean combination of names stands in it"


def _strange_counts(formula: Formula) -> Iterator[tuple[int, str]]:
    """Yield what stands in counts and in `each` and cannot stand there, with its place."""
    inside: list[tuple[Formula, Formula | None]] = [(formula, None)]
    while inside:
        node, counted = inside.pop()
        if counted is not None and counted.operator == "each":
            if node.operator == "each":
                yield node.position, "An `each` within an `each` says nothing more; leave the inner one out."
        elif counted is not None:
            if node.operator in COUNTING:
                yield node.position, f"`{counted.operator}` {_INSIDE}; `{node.operator}` counts robots again."
            elif node.robot:
                yield node.position, f"`{counted.operator}` {_INSIDE}; `{node}` names a robot."
            elif node.operator in TEMPORAL:
                yield (
                    node.position,
                    f"`{counted.operator}` {_INSIDE}; `{node.operator}` is about other times. Write it around the count, "
                    "`ever(...)` for how many robots come to it, or `each(...)` for what each robot does in its own time.",
                )
        if node.bound is not None and node.bound[1] < 0:
            yield node.position, f"`{node}` compares a number of robots with {node.bound[1]}; it is never below 0."
        within = node if node.operator in COUNTING and (counted is None or counted.operator == "each") else counted
        inside.extend((argument, within) for argument in reversed(node.arguments))


def _strange_robots(text: str, formula: Formula, robots: Collection[str] | None) -> Iterator[tuple[int, str]]:
    """Yield names of robots that do not exist, with their places."""
    if robots is None:
        return
    for node in formula.walk():
        if node.robot and node.robot not in robots:
            listed = ", ".join(robots)
            hint = did_you_mean(node.robot, robots)
            at = text.rindex(node.robot, 0, node.position)
            yield at, f"'{node.robot}' is not a robot of this mission.{hint} Robots: {listed}."


def _with_spaces(name: str, known: Collection[str]) -> str | None:
    """Return how a name that does not exist reads as operators without spaces, or None where that is far-fetched."""
    cuts = [(name[:cut], name[cut:]) for cut in range(1, len(name)) if GLUED.fullmatch(name[:cut])]
    for head, rest in cuts:
        if rest in known:
            return " ".join((*head, rest))
    if cuts and NAME.fullmatch(cuts[-1][1]):  # all operator letters; a capital and a word, such as `Gate`, is a name
        head, rest = cuts[-1]
        if re.fullmatch(r"[a-z]\d*", rest) or (len(head) > 1 and rest[0].islower()):
            return " ".join((*head, rest))
    for match in re.finditer("[UWRM]", name):
        left, right = name[: match.start()], name[match.end() :]
        if left in known and right in known:
            return f"{left} {match.group()} {right}"
    return None


def window_of(text: str, operator: str) -> Window:
    """Read bounds in seconds.

    Args:
        text: What stands between the brackets: `0,10`, `2.5, inf`.
        operator: Whose bounds they are, for the message.

    Raises:
        ValueError: They are none.
    """
    shown, parts = f"`{operator}[{text[:40]}]`", [part.strip() for part in text.split(",")]
    if len(parts) != 2:
        hint = f"`{operator}[0,{parts[0]}]`" if len(parts) == 1 and _SECONDS.fullmatch(parts[0]) else f"`{operator}[0,10]`"
        raise ValueError(f"{shown} needs two bounds with a comma between them, such as {hint}.")
    for part in parts:
        if part.startswith("-") and _SECONDS.fullmatch(part[1:]):
            raise ValueError(f"{shown} looks back; time is counted in seconds from now, from 0 on.")
        if unit := re.fullmatch(r"([0-9.]{1,24})\s*(s|sec|seconds?|ms|min|h)", part):
            raise ValueError(f"{shown} is in seconds already; write {unit[1]} without its unit, converted where it is not s.")
        if part != "inf" and not _SECONDS.fullmatch(part):
            raise ValueError(
                f"'{part[:40]}' in {shown} is no number of seconds of at most {DECIMALS} digits before and behind its point, nor `inf`."
            )
    if parts[0] == "inf":
        raise ValueError(f"{shown} begins never; only the second bound may be `inf`.")
    low, high = Fraction(parts[0]), None if parts[1] == "inf" else Fraction(parts[1])
    if high is not None and high < low:
        raise ValueError(f"{shown} ends before it begins.")
    return low, high


_SECONDS = re.compile(rf"[0-9]{{1,{DECIMALS}}}(?:\.[0-9]{{1,{DECIMALS}}})?|\.[0-9]{{1,{DECIMALS}}}")


class _Parser:
    """Precedence climbing over the tokens; depth is bounded so that a hostile text cannot exhaust the stack."""

    def __init__(self, text: str, tokens: list[Token]) -> None:
        self.text = text
        self.tokens = tokens
        self.index = 0

    def read(self) -> Formula:
        formula = self._expression(0, 0)
        if self.index < len(self.tokens):
            raise self._unexpected()
        return formula

    def _expression(self, power: int, depth: int) -> Formula:
        if depth > MAX_DEPTH:
            raise FormulaError(self.text, [(self._position(), f"The formula is nested deeper than {MAX_DEPTH} levels.")])
        left = self._operand(depth)
        while self.index < len(self.tokens):
            token = self.tokens[self.index]
            powers = INFIX.get(token.kind)
            if powers is None or powers[0] < power:
                break
            self.index += 1
            window = self._window(token)
            right = self._expression(powers[1], depth + 1)
            left = Formula(token.kind, (left, right), "", token.position, window=window)  # type: ignore[arg-type]  # a key of INFIX
        return left

    def _operand(self, depth: int) -> Formula:
        if self.index >= len(self.tokens):
            raise FormulaError(self.text, [(len(self.text), "The formula ends where a proposition is expected.")])
        token = self.tokens[self.index]
        self.index += 1
        if NAME.fullmatch(token.text) and self._next_is("dot") and self.text[token.position] != '"':
            return self._of_robot(token)
        if token.kind in COUNTING:
            return self._counted(token, depth)
        if token.kind == "name":
            return Formula("name", (), token.text, token.position)
        if token.kind == "constant":
            return Formula("true" if token.text in ("1", "true") else "false", (), "", token.position)
        if token.kind in PREFIX:
            window = self._window(token)
            argument = self._expression(PREFIX_POWER, depth + 1)
            return Formula(token.kind, (argument,), "", token.position, window=window)  # type: ignore[arg-type]  # a member of PREFIX
        if token.kind == "(":
            return self._in_parentheses(token, depth)
        if token.kind in LATE:
            raise FormulaError(self.text, [(token.position, unreadable(self.text, token.position))])
        hint = " Operator names cannot be names of regions." if token.text.isalpha() else ""
        raise FormulaError(
            self.text,
            [(token.position, f"`{token.text}` stands where a proposition is expected.{hint}")],
        )

    def _window(self, operator: Token) -> Window | None:
        """Read the bounds in seconds that follow an operator, if any do."""
        if not self._next_is("window"):
            return None
        token = self.tokens[self.index]
        self.index += 1
        if operator.kind not in TIMED:
            raise FormulaError(self.text, [(token.position, f"`{operator.text}` has no bounds in seconds.")])
        try:
            return window_of(token.text, operator.kind)
        except ValueError as error:
            raise FormulaError(self.text, [(token.position, str(error))]) from None

    def _in_parentheses(self, opened: Token, depth: int) -> Formula:
        """Read what stands between a parenthesis, which was read, and its partner."""
        inner = self._expression(0, depth + 1)
        if self.index >= len(self.tokens):
            raise FormulaError(self.text, [(opened.position, "This parenthesis is never closed.")])
        if self.tokens[self.index].kind != ")":
            raise self._unexpected()
        self.index += 1
        return inner

    def _of_robot(self, robot: Token) -> Formula:
        """Read `.p` after a robot's name."""
        self.index += 1
        token = self.tokens[self.index] if self.index < len(self.tokens) else None
        if token is None or token.kind != "name":
            end = len(self.text) if token is None else token.position
            what = f"After `{robot.text}.` the name of what this robot shows is expected, such as `{robot.text}.free`."
            raise FormulaError(self.text, [(end, what)])
        self.index += 1
        return Formula("name", (), token.text, token.position, robot.text)

    def _counted(self, token: Token, depth: int) -> Formula:
        """Read `(B)` and, after a count, what it is compared with."""
        if not self._next_is("("):
            hint = (
                f"`{token.text}` counts robots and needs parentheses, such as `{_EXAMPLES[token.text]}`; it cannot be a name."
            )
            raise FormulaError(self.text, [(token.position, hint)])
        self.index += 1
        arguments = (self._in_parentheses(self.tokens[self.index - 1], depth),)
        bound = self._bound(token) if token.kind in BOUNDED else None
        return Formula(token.kind, arguments, "", token.position, bound=bound)  # type: ignore[arg-type]  # a member of COUNTING

    def _bound(self, count: Token) -> tuple[Comparison, int]:
        """Read what a count is compared with."""
        if not self._next_is("compare"):
            number = f"`{count.text}(...)`"
            what = f"{number} is a number of robots; compare it, such as `{_EXAMPLES[count.text]}`, or write `some(...)`."
            raise FormulaError(self.text, [(count.position, what)])
        sign = self.tokens[self.index]
        self.index += 1
        number = self.tokens[self.index] if self.index < len(self.tokens) else None
        if number is None or not re.fullmatch(r"-?\d{1,9}", number.text):
            end = len(self.text) if number is None else number.position
            many = number is not None and number.text.isdecimal()
            what = f"a whole number of robots is expected, {'of nine digits at the most' if many else 'such as 2'}."
            raise FormulaError(self.text, [(end, f"After `{sign.text}` {what}")])
        self.index += 1
        return sign.text, int(number.text)  # type: ignore[return-value]  # the tokeniser knows no other signs

    def _next_is(self, kind: str) -> bool:
        return self.index < len(self.tokens) and self.tokens[self.index].kind == kind

    def _unexpected(self) -> FormulaError:
        """Return what is wrong with a token after which a formula cannot go on."""
        token = self.tokens[self.index]
        if token.kind in LATE:
            return FormulaError(self.text, [(token.position, unreadable(self.text, token.position))])
        hint = " A closing parenthesis has no partner." if token.kind == ")" else self._missing_operator()
        return FormulaError(self.text, [(token.position, f"`{token.text}` is not expected here.{hint}")])

    def _missing_operator(self) -> str:
        """Return what a reader of two names in a row may have meant."""
        for token in self.tokens[max(self.index - 1, 0) : self.index + 1]:
            if token.text.lower() in _WORDS:
                return f" Write `{_WORDS[token.text.lower()]}` for '{token.text}'."
        return " An operator is missing before it."

    def _position(self) -> int:
        return self.tokens[min(self.index, len(self.tokens) - 1)].position
