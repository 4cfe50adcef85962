"""Letters and words: what a robot's flight says, without its times."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeVar

from verify.data.errors import BadInput

Letter = frozenset[str]
_Shown = TypeVar("_Shown", Letter, int)


@dataclass(frozen=True, slots=True)
class Word:
    """A non-empty sequence of letters; with a cycle it is the infinite word prefix cycle cycle ...

    Attributes:
        prefix: Letters before the cycle, or the whole word. May be empty only where there is a cycle.
        cycle: Letters repeated for ever; None for a finite word. Never empty.
    """

    prefix: tuple[Letter, ...]
    cycle: tuple[Letter, ...] | None = None

    def __post_init__(self) -> None:
        if self.cycle is not None and not self.cycle:
            raise BadInput("A word's cycle needs at least one letter; use None for a finite word.")
        if not self.prefix and self.cycle is None:
            raise BadInput("A word needs at least one letter; write {} for free flight.")

    @classmethod
    def of(cls, prefix: Iterable[Iterable[str]], cycle: Iterable[Iterable[str]] | None = None) -> Word:
        """Build a word from any sequences of names; a bare string is refused (it is not a set of names)."""
        return cls(_letters(prefix), None if cycle is None else _letters(cycle))

    @property
    def letters(self) -> tuple[Letter, ...]:
        """All letters, the cycle once."""
        return self.prefix + (self.cycle or ())

    def names(self) -> frozenset[str]:
        """Return the names that occur in its letters."""
        return frozenset[str]().union(*self.letters)

    def compressed(self) -> Word:
        """Return the finite word without immediate repetitions (lassos are returned as they are)."""
        if self.cycle is not None:
            return self
        return Word(stutter_free(self.prefix))

    def __str__(self) -> str:
        text = " ".join(show_letter(letter) for letter in self.prefix)
        if self.cycle is not None:
            text += (" " if text else "") + "(" + " ".join(show_letter(letter) for letter in self.cycle) + ")^w"
        return text


def stutter_free(letters: Iterable[_Shown]) -> tuple[_Shown, ...]:
    """Return letters, or nodes that show them, without immediate repetitions."""
    return tuple(letter for letter, _ in itertools.groupby(letters))


def show_letter(letter: Letter) -> str:
    """Return a letter as {a, b}, names sorted."""
    return "{" + ", ".join(sorted(letter)) + "}"


def _letters(letters: Iterable[Iterable[str]]) -> tuple[Letter, ...]:
    result: list[Letter] = []
    for index, letter in enumerate(letters):
        if isinstance(letter, str):
            raise BadInput(f"Letter {index} is the string {letter!r}; a letter is a set of names, such as {{{letter!r}}}.")
        result.append(frozenset(letter))
    return tuple(result)
