"""One word, finite or lasso, checked against a formula by direct semantics."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from typing import Literal

from verify.data.errors import BadInput
from verify.data.language.counting import require_plain
from verify.data.language.formula import RESERVED_NAMES, Formula, check_formula
from verify.data.language.formula_reader import parse_formula
from verify.data.language.word import Word, show_letter
from verify.logic.explanation import explain, show
from verify.logic.semantics import satisfies
from verify.logic.vacuity import vacuous_parts
from verify.logic.verdict import Verdict

Letters = Word | Iterable[Iterable[str]]
"""A word as users write it: a `Word`, or any sequence of sets of names."""


def check_word(formula: str | Formula, word: Letters, cycle: Iterable[Iterable[str]] | None = None) -> Verdict:
    """Decide whether a word satisfies a formula.

    Args:
        formula: LTL in Spot's syntax. Without a cycle it is read as LTLf, where `X` is weak and `X[!]` strong.
        word: Non-empty sequence of sets of names; names that a letter does not hold are false there.
        cycle: Letters repeated for ever after `word` (which may then be empty); None for a finite trace.

    Returns:
        A verdict; where it fails, the word is its own counterexample and `visit` the letter that decides.

    Raises:
        FormulaError: The text is no formula.
        BadInput: The word is empty, a letter is a bare string, or the formula counts robots.
    """
    given = as_word(word, cycle)
    formula = require_plain(
        as_formula(formula, given.names()), "a single word says nothing of them; `check_team` takes a team's"
    )
    if satisfies(formula, given):
        vacuous = vacuous_parts(formula, [given])
        note = f" But {vacuous[0]}" if vacuous else ""
        return Verdict("holds", f"The word satisfies `{show(formula)}`.{note}", vacuous=vacuous)
    letters = given.letters

    def where(position: int) -> str:
        place = f"letter {position + 1} of {len(letters)}"
        if given.cycle is not None and position >= len(given.prefix):
            place = f"letter {position - len(given.prefix) + 1} of the cycle"
        return f"{place}, {show_letter(letters[position])}"

    reason = explain(formula, given, where)
    return Verdict("fails", reason.sentence, given, visit=reason.position)


def as_formula(formula: str | Formula, shown: Collection[str] = ()) -> Formula:
    """Return a formula from a text, which is compared with words that show some names, or as it is.

    Raises:
        BadInput: It is neither a text nor a sound formula.
        FormulaError: The text is no formula.
    """
    if isinstance(formula, str):
        return parse_formula(formula, shown=shown)
    if not isinstance(formula, Formula):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput(f"A formula is a text or a Formula, not {type(formula).__name__}.")
    return check_formula(formula)


def as_word(word: Letters, cycle: Iterable[Iterable[str]] | None = None, *, owner: str = "The word") -> Word:
    """Return a `Word` from what a user gives; refuse strings, which are no sequences of sets of names.

    Args:
        word: A word, or the letters of its prefix.
        cycle: The letters of its cycle; None for a finite word or one that has its cycle.
        owner: Names the word in messages.

    Raises:
        BadInput: It is no word, or its cycle is given twice.
    """
    if isinstance(word, Word):
        if cycle is None:
            return _named(word, owner)
        if word.cycle is not None:
            raise BadInput(f"{owner} has a cycle already; give the cycle once.")
        word = word.prefix
    for part in (word, cycle):
        if isinstance(part, str):
            raise BadInput(f'{owner} is a text; give a sequence of sets of names, such as [{{"a"}}, set()].')
        if part is not None and not isinstance(part, Iterable):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
            raise BadInput(f"{owner} is no sequence of sets of names but {type(part).__name__}.")
    try:
        return _named(Word.of(word, cycle), owner)
    except TypeError:
        raise BadInput(f"{owner} must be a sequence of sets of names; one of its letters is no set.") from None


def _named(word: Word, owner: str) -> Word:
    for part in (word.prefix, word.cycle or ()):
        if not isinstance(part, tuple) or not all(isinstance(letter, frozenset) for letter in part):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
            raise BadInput(
                f"{owner} is no sound Word: it must hold tuples of frozensets; `Word.of` makes one of any sets of names."
            )
    for letter in word.letters:
        for name in letter:
            if not isinstance(name, str):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
                raise BadInput(f"{owner} has a letter that holds {name!r}, which is no name.")
    return word


_TOKENS = re.compile(
    r"\s*(?:(?P<cycle>cycle\s*\{)|(?P<close>\})|(?P<next>;)|(?P<and>&&?)|(?P<not>!)|(?P<name>[A-Za-z_][A-Za-z0-9_]*)"
    r'|"(?P<quoted>[^"\n]+)"|(?P<constant>[01](?![A-Za-z0-9_]))|(?P<other>\S))'
)


def parse_word(text: str) -> Word:
    """Read a word in Spot's notation, such as `1; a; b & c; cycle{d; 1}`; propositions that are not named are false.

    A letter is a conjunction of names; `1` (or `true`) is the empty letter, and `!a` says what leaving `a` out says.

    Raises:
        BadInput: The text is no word; the message has a caret under the place.
    """
    prefix: list[frozenset[str]] = []
    cycle: list[frozenset[str]] = []
    letter: set[str] | None = None  # None: a letter is expected here
    state: Literal["prefix", "cycle", "closed"] = "prefix"
    negated = joined = False

    def refuse(position: int, reason: str) -> BadInput:
        return BadInput(f"{reason}\n  {text}\n  {' ' * position}^")

    def close(position: int) -> None:
        nonlocal letter
        if letter is None or joined or negated:
            raise refuse(position, "A letter is missing here; write 1 for the empty letter.")
        (prefix if state == "prefix" else cycle).append(frozenset(letter))
        letter = None

    position = 0
    while (match := _TOKENS.match(text, position)) is not None:
        kind = str(match.lastgroup)
        start, value, position = match.start(kind), match.group(kind), match.end()
        if state == "closed":
            raise refuse(start, "Nothing may follow the cycle: it repeats for ever.")
        if kind in ("name", "quoted", "constant"):
            if letter is not None and not joined:
                raise refuse(start, "Join the names of one letter with `&`, and end a letter with `;`.")
            if kind == "name" and value in RESERVED_NAMES - {"true"}:
                raise refuse(start, f"`{value}` is an operator or constant and cannot stand in a letter.")
            letter = set() if letter is None else letter
            empty = value == "true" if kind == "name" else kind == "constant"
            if empty and (value == "0" or negated):
                raise refuse(start, "A letter that is false is no letter.")
            if not empty and not negated:
                letter.add(value)
            negated = joined = False
        elif kind == "not" and not negated and (letter is None or joined):
            negated = True
        elif kind == "and" and letter is not None and not joined and not negated:
            joined = True
        elif kind == "next":
            close(start)
        elif kind == "cycle" and state == "prefix" and letter is None and not negated:
            state = "cycle"
        elif kind == "close" and state == "cycle":
            close(start)
            state = "closed"
        else:
            raise refuse(start, f"`{value}` is not expected here; a word looks like `a; b & c; cycle{{d}}`.")
    if state == "cycle":
        raise refuse(len(text), "The cycle is not closed with `}`.")
    if state == "prefix":
        close(len(text))
    return Word(tuple(prefix), tuple(cycle) if state == "closed" else None)
