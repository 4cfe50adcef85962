"""The tokens of a formula: names, constants and signs, and which letters are operators where nothing stands between them."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping
from dataclasses import dataclass

from verify.data.language.formula import PREFIX, RESERVED_NAMES, TEMPORAL
from verify.data.language.formula_error import FormulaError

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
      | (?P<number>-?\d+(?![A-Za-z0-9_]))
      | (?P<compare>>=|<=|==|<|>)
      | (?P<dot>\.)
    """,
    re.VERBOSE,
)
_KIND_TO_OPERATOR: Mapping[str, str] = {
    "strong": "X[!]", "equiv": "<->", "implies": "->", "and": "&", "or": "|", "xor": "xor", "not": "!",
    "always": "G", "eventually": "F", "open": "(", "close": ")",
}  # fmt: skip
GLUED = re.compile("[FGX]+")
"""Operator letters without anything between them."""
LATE = frozenset({"number", "compare", "dot"})
"""Tokens that stand nowhere but in counts and after robots' names."""
_WINDOW = re.compile(r"\[([^][(){}]*)\]")


@dataclass(frozen=True, slots=True)
class Token:
    """A piece of a formula that is read as one.

    Attributes:
        kind: "name", "constant", an operator's sign, "window" for bounds in seconds, or one of `LATE`.
        text: As it was written; a quoted name without its quotes.
        position: Offset of its first character.
    """

    kind: str
    text: str
    position: int


def tokenise(text: str) -> list[Token]:
    """Return a formula's tokens, in order.

    Raises:
        FormulaError: A character begins none, or a quoted name is empty.
    """
    tokens: list[Token] = []
    position = 0
    while position < len(text):
        match = _TOKEN.match(text, position)
        window = _WINDOW.match(text, position) if match is None and tokens and _may_be_bounded(text, tokens[-1]) else None
        if window is not None:
            tokens.append(Token("window", window[1], position))
            position = window.end()
            continue
        if match is None:
            raise FormulaError(text, [(position, unreadable(text, position))])
        kind, value = str(match.lastgroup), match.group()
        if kind == "name" and value[-1] == "X" and text.startswith("[!]", match.end()) and GLUED.fullmatch(value):
            tokens += [Token(letter, letter, position + i) for i, letter in enumerate(value[:-1])]
            position = match.end() - 1  # what follows is `X[!]`
            continue
        if kind == "name":
            token = {"true": "constant", "false": "constant", "V": "R"}.get(value)
            tokens.append(Token(token or (value if value in RESERVED_NAMES else "name"), value, position))
        elif kind == "quoted":
            if len(value) == 2:
                raise FormulaError(text, [(position, "A quoted name is empty.")])
            tokens.append(Token("name", value[1:-1], position))
        elif kind == "one":
            tokens.append(Token("constant", value, position))
        elif kind in LATE:
            tokens.append(Token(kind, value, position))
        elif kind != "space":
            tokens.append(Token(_KIND_TO_OPERATOR[kind], value, position))
        position = match.end()
    return _parted(text, tokens)


def _may_be_bounded(text: str, token: Token) -> bool:
    """Return whether bounds may follow a token: a temporal operator, or several without anything between them."""
    return token.kind in TEMPORAL or (
        token.kind == "name" and text[token.position] != '"' and bool(GLUED.fullmatch(token.text))
    )


def _parted(text: str, tokens: list[Token]) -> list[Token]:
    """Take names made of operator letters alone apart where an operand follows, for no name can stand there: `FG(a)`."""
    result: list[Token] = []
    for token, after in itertools.zip_longest(tokens, tokens[1:]):
        operand = after is not None and (after.kind in ("(", "name", "constant", "window") or after.kind in PREFIX)
        if token.kind == "name" and operand and GLUED.fullmatch(token.text) and text[token.position] != '"':
            result += [Token(letter, letter, token.position + i) for i, letter in enumerate(token.text)]
        else:
            result.append(token)
    return result


_BOUNDED = re.compile(r"(?:(?<![A-Za-z0-9_])[FGX]*([FGXUWRMV])_?|(<>))\s*$")
"""A temporal operator, behind which `[` or `(` begins bounds on its time that are no window."""


def unreadable(text: str, position: int) -> str:
    """Return what to say of a character that no formula holds, or not at its place.

    Args:
        text: The formula.
        position: The character's offset.
    """
    if (bounded := _BOUNDED.search(text[:position])) and text[position] == "[":
        operator, bounds = bounded[1] or bounded[2], re.match(r"\[[^])]*[])]?", text[position:])
        return (
            f"`{operator}{bounds and bounds[0][:40]}` is no `{operator}` that is bounded in seconds. Both ends belong to the time: write "
            f"`{'F' if operator == '<>' else operator}[0,10]` or `[5,inf]`, the operator's letter directly before it."
        )
    if text[position] in "[{;:*#":
        return (
            f"`{text[position]}` begins a sequence (SERE) or bounded operator of Spot's, which is not supported; "
            "use ! & | xor -> <-> F G U W R M and parentheses."
        )
    hint = " Equal numbers of robots are written `==`." if text[position] == "=" else ""
    if text[max(0, position - 1) : position + 1] == "!=":
        hint = " Other numbers of robots are written `!(count(...) == 2)`."
    if re.match(r"\d+\s*[<>=]", text[position:]):
        hint = " The count stands first: `count(...) >= 2`."
    return f"`{text[position]}` is not part of a formula.{hint}"
