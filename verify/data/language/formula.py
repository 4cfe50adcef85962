"""Linear temporal logic as text: our own reader, so that names mean what the user wrote.

Spot's lexer reads `F Gate1` as `F G ate1` and `FIRE` as `F IRE`. Here a name is a letter or `_` followed by
letters, digits and `_`, and an operator letter is an operator only when it stands alone, or where a name cannot
stand (`GF(a)`, `FG!a`). What Spot prints without spaces (`GFa`) is one name here, and is refused where there is no such
name. The grammar and the precedences are Spot's (loosest first: `->` `<->`, `|`, `xor`, `&`, `U W R M`, then the prefix
operators `F G X X[!] !`); the tests hold this reader against Spot's on random formulas.
Whoever passes a formula on to Spot uses `Formula.quoted`.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal

from verify.data.errors import BadInput, did_you_mean

Operator = Literal["true", "false", "name", "!", "F", "G", "X", "X[!]", "&", "|", "xor", "->", "<->", "U", "W", "R", "M"]

RESERVED_NAMES = frozenset({"F", "G", "X", "U", "W", "R", "M", "V", "true", "false", "xor"})
"""Words that the formula language keeps for itself."""

FREE = "free"
"""The built-in proposition of a mission's formula that means "in no region"."""

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")

MAX_LENGTH = 100_000
MAX_DEPTH = 200

_TOKEN = re.compile(
    r"""(?P<space>\s+)
      | (?P<strong>X\[!\])
      | (?P<name>[A-Za-z_][A-Za-z0-9_]*)
      | (?P<quoted>"[^"\n]*")
      | (?P<equiv><->|<=>|<-->)
      | (?P<implies>->|=>|-->)
      | (?P<and>&&?|/\\)
      | (?P<or>\|\|?|\\/)
      | (?P<xor>\^)
      | (?P<not>!|~)
      | (?P<always>\[\])
      | (?P<eventually><>)
      | (?P<open>\()
      | (?P<close>\))
      | (?P<one>[01](?![A-Za-z0-9_]))
    """,
    re.VERBOSE,
)
_KIND_TO_OPERATOR: Mapping[str, str] = {
    "strong": "X[!]", "equiv": "<->", "implies": "->", "and": "&", "or": "|", "xor": "xor", "not": "!",
    "always": "G", "eventually": "F", "open": "(", "close": ")",
}  # fmt: skip
_WORDS: Mapping[str, str] = {
    "and": "&", "or": "|", "not": "!", "implies": "->", "until": "U", "always": "G", "globally": "G", "eventually": "F",
    "finally": "F", "f": "F", "g": "G", "u": "U", "w": "W", "r": "R", "m": "M",
}  # fmt: skip
"""What people write for an operator, as a hint where a formula cannot be read."""
_PREFIX = frozenset({"!", "F", "G", "X", "X[!]"})
_GLUED = re.compile("[FGX]+")
# operator -> (left binding power, right binding power); a smaller right power makes it right-associative
_INFIX: Mapping[str, tuple[int, int]] = {
    "->": (2, 1), "<->": (2, 1), "|": (3, 4), "xor": (5, 6), "&": (7, 8),
    "U": (10, 9), "W": (10, 9), "R": (10, 9), "M": (10, 9),
}  # fmt: skip
_PREFIX_POWER = 11
_ARGUMENTS: Mapping[object, int] = {
    "true": 0, "false": 0, "name": 0, **dict.fromkeys(_PREFIX, 1), **dict.fromkeys(_INFIX, 2),
}  # fmt: skip


class FormulaError(BadInput):
    """A formula that cannot be read.

    Attributes:
        formula: The text.
        position: Offset of the first fault in it.
        reasons: One sentence per fault.
    """

    def __init__(self, formula: str, faults: list[tuple[int, str]]) -> None:
        self.formula = formula
        self.position = faults[0][0]
        self.reasons = tuple(reason for _, reason in faults)
        super().__init__("\n".join(f"{reason}\n{_caret(formula, position)}" for position, reason in faults))


@dataclass(frozen=True, slots=True)
class Formula:
    """One node of a formula: an operator and its arguments.

    Attributes:
        operator: "name" for a proposition, "true", "false", or the operator's own sign.
        arguments: None, one or two formulas.
        name: The proposition's name, for operator "name"; otherwise empty.
        position: Offset of this node's operator or name in the text that it was read from (not compared).
    """

    operator: Operator
    arguments: tuple[Formula, ...] = ()
    name: str = ""
    position: int = field(default=0, compare=False)

    def names(self) -> frozenset[str]:
        """Return the propositions that occur."""
        return frozenset(node.name for node in self._nodes() if node.operator == "name")

    def walk(self) -> Iterator[Formula]:
        """Yield this node and all below it, parents first, one that is shared as often as it occurs."""
        stack: list[Formula] = [self]
        while stack:
            node = stack.pop()
            yield node
            stack.extend(reversed(node.arguments))

    def conjuncts(self) -> tuple[Formula, ...]:
        """Return the parts of the topmost conjunction (the formula itself where there is none)."""
        if self.operator != "&":
            return (self,)
        return tuple(part for argument in self.arguments for part in argument.conjuncts())

    def substitute(self, values: Mapping[str, Formula]) -> Formula:
        """Return the formula with each proposition in `values` replaced."""
        if self.operator == "name":
            return values.get(self.name, self)
        return Formula(self.operator, tuple(a.substitute(values) for a in self.arguments), "", self.position)

    def uses_next(self) -> bool:
        """Tell whether an X or X[!] occurs, so that truth depends on how time is sampled."""
        return any(node.operator in ("X", "X[!]") for node in self._nodes())

    def _nodes(self) -> Iterator[Formula]:
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
        """Return the formula fully parenthesised with quoted names, for Spot."""
        return self._text(quote=True, power=0)

    def __str__(self) -> str:
        return self._text(quote=False, power=0)

    def _text(self, *, quote: bool, power: int) -> str:
        match self.operator:
            case "true":
                return "1" if quote else "true"
            case "false":
                return "0" if quote else "false"
            case "name":
                return f'"{self.name}"' if quote or not NAME.fullmatch(self.name) else self.name
            case "!" | "F" | "G" | "X" | "X[!]":
                text = self.arguments[0]._text(quote=quote, power=_PREFIX_POWER)
                return f"!{text}" if self.operator == "!" else f"{self.operator} {text}"
            case _:
                left, right = self.arguments
                bind_left, bind_right = _INFIX[self.operator]
                first = left._text(quote=quote, power=max(bind_left, bind_right))
                second = right._text(quote=quote, power=bind_right)
                text = f"{first} {self.operator} {second}"
                return f"({text})" if quote or power > min(bind_left, bind_right) else text


TRUE = Formula("true")
FALSE = Formula("false")


def parse_formula(
    text: str, names: Collection[str] | None = None, *, shown: Collection[str] = (), allow_next: bool = True
) -> Formula:
    """Read a formula.

    Args:
        text: LTL in Spot's syntax, without SERE operators.
        names: The propositions that exist; None accepts any name but those that are operators without spaces, such as `GFa`.
        shown: Where any name is accepted: names that are known to exist, such as those of a word that is held against it.
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
    tokens = _tokenise(text)
    if not tokens:
        raise FormulaError(text, [(0, "The formula is empty; write `true` for no requirement.")])
    formula = _Parser(text, tokens).read()
    faults: list[tuple[int, str]] = []
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
            faults.append((node.position, f"'{node.name}' is not a name of this mission.{hint} Names: {listed}."))
        elif hint:
            faults.append((node.position, f'{hint}, or `"{node.name}"` where it is meant as a name.'))
    if faults:
        raise FormulaError(text, sorted(faults))
    return formula


def _with_spaces(name: str, known: Collection[str]) -> str | None:
    """Return how a name that does not exist reads as operators without spaces, or None where that is far-fetched."""
    cuts = [(name[:cut], name[cut:]) for cut in range(1, len(name)) if _GLUED.fullmatch(name[:cut])]
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
        if len(node.arguments) != _ARGUMENTS[node.operator] or (node.operator == "name") != bool(node.name):
            raise BadInput(
                f"A Formula with operator `{node.operator}` is not {node!r:.80}: its arguments or its name do not fit."
            )
        if id(node) not in seen:
            seen.add(id(node))
            stack.extend(node.arguments)
    return formula


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str  # "name", "constant" or an operator's sign
    text: str
    position: int


def _tokenise(text: str) -> list[_Token]:
    tokens: list[_Token] = []
    position = 0
    while position < len(text):
        match = _TOKEN.match(text, position)
        if match is None:
            raise FormulaError(text, [(position, _unreadable(text, position))])
        kind, value = str(match.lastgroup), match.group()
        if kind == "name" and value[-1] == "X" and text.startswith("[!]", match.end()) and _GLUED.fullmatch(value):
            tokens += [_Token(letter, letter, position + i) for i, letter in enumerate(value[:-1])]
            position = match.end() - 1  # what follows is `X[!]`
            continue
        if kind == "name":
            token = {"true": "constant", "false": "constant", "V": "R"}.get(value)
            tokens.append(_Token(token or (value if value in RESERVED_NAMES else "name"), value, position))
        elif kind == "quoted":
            if len(value) == 2:
                raise FormulaError(text, [(position, "A quoted name is empty.")])
            tokens.append(_Token("name", value[1:-1], position))
        elif kind == "one":
            tokens.append(_Token("constant", value, position))
        elif kind != "space":
            tokens.append(_Token(_KIND_TO_OPERATOR[kind], value, position))
        position = match.end()
    return _parted(text, tokens)


def _parted(text: str, tokens: list[_Token]) -> list[_Token]:
    """Take names made of operator letters alone apart where an operand follows, for no name can stand there: `FG(a)`."""
    result: list[_Token] = []
    for token, after in itertools.zip_longest(tokens, tokens[1:]):
        operand = after is not None and (after.kind in ("(", "name", "constant") or after.kind in _PREFIX)
        if token.kind == "name" and operand and _GLUED.fullmatch(token.text) and text[token.position] != '"':
            result += [_Token(letter, letter, token.position + i) for i, letter in enumerate(token.text)]
        else:
            result.append(token)
    return result


def _unreadable(text: str, position: int) -> str:
    if text[position] in "[{;:*#":
        return (
            f"`{text[position]}` begins a sequence (SERE) or bounded operator of Spot's, which is not supported; "
            "use ! & | xor -> <-> F G U W R M and parentheses."
        )
    return f"`{text[position]}` is not part of a formula."


class _Parser:
    """Precedence climbing over the tokens; depth is bounded so that a hostile text cannot exhaust the stack."""

    def __init__(self, text: str, tokens: list[_Token]) -> None:
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
            powers = _INFIX.get(token.kind)
            if powers is None or powers[0] < power:
                break
            self.index += 1
            right = self._expression(powers[1], depth + 1)
            left = Formula(token.kind, (left, right), "", token.position)  # type: ignore[arg-type]  # a key of _INFIX
        return left

    def _operand(self, depth: int) -> Formula:
        if self.index >= len(self.tokens):
            raise FormulaError(self.text, [(len(self.text), "The formula ends where a proposition is expected.")])
        token = self.tokens[self.index]
        self.index += 1
        if token.kind == "name":
            return Formula("name", (), token.text, token.position)
        if token.kind == "constant":
            return Formula("true" if token.text in ("1", "true") else "false", (), "", token.position)
        if token.kind in _PREFIX:
            return Formula(token.kind, (self._expression(_PREFIX_POWER, depth + 1),), "", token.position)  # type: ignore[arg-type]  # a member of _PREFIX
        if token.kind == "(":
            inner = self._expression(0, depth + 1)
            if self.index >= len(self.tokens):
                raise FormulaError(self.text, [(token.position, "This parenthesis is never closed.")])
            if self.tokens[self.index].kind != ")":
                raise self._unexpected()
            self.index += 1
            return inner
        hint = " Operator names cannot be names of regions." if token.text.isalpha() else ""
        raise FormulaError(
            self.text,
            [(token.position, f"`{token.text}` stands where a proposition is expected.{hint}")],
        )

    def _unexpected(self) -> FormulaError:
        """Return what is wrong with a token after which a formula cannot go on."""
        token = self.tokens[self.index]
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


def _caret(text: str, position: int) -> str:
    """Return the line of `text` that holds `position` with a caret under it, cut to a readable width."""
    start = text.rfind("\n", 0, position) + 1
    end = text.find("\n", position)
    line = text[start : end if end >= 0 else len(text)]
    column = position - start
    if column > 60:
        line, column = "..." + line[column - 50 :], 53
    return f"  {line[:100]}\n  {' ' * column}^"
