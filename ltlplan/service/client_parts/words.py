"""Words and verdicts as they travel: in Spot's notation, and as plain data."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from verify import Verdict
from verify.data import Word
from verify.trace_checking.word_verdict import Letters, as_word


def notation(word: Letters | str, cycle: Iterable[Iterable[str]] | None = None) -> str:
    """Return a word in Spot's notation."""
    if isinstance(word, str) and cycle is None:
        return word
    given = as_word(word, cycle)  # type: ignore[arg-type]  # a text with a cycle is rejected there
    parts = [_letter(letter) for letter in given.prefix]
    if given.cycle is not None:
        parts.append(f"cycle{{{'; '.join(map(_letter, given.cycle))}}}")
    return "; ".join(parts)


def _letter(letter: frozenset[str]) -> str:
    return " & ".join(f'"{name}"' for name in sorted(letter)) or "1"


def verdict_of(told: dict[str, Any]) -> Verdict:  # of any type: JSON nests
    """Return the verdict that plain data was made of."""
    shown, length = told["counterexample"], told["cycle_length"]
    word: tuple[tuple[str, frozenset[str]], ...] | Word | None = None
    if shown is not None:
        readings = tuple((str(robot), frozenset(map(str, letter))) for robot, letter in shown)
        letters = tuple(letter for _, letter in readings)
        if length is not None:
            word = Word(letters[: len(letters) - length], letters[len(letters) - length :])
        else:
            word = Word(letters) if all(robot == "" for robot, _ in readings) else readings
    return Verdict(
        told["outcome"],
        told["sentence"],
        word,
        told["time"],
        told["claim"],
        told["robot"],
        told["visit"],
        told["region"],
        tuple((float(a), float(b)) for a, b in told["times"]),
        tuple(map(str, told["vacuous"])),
    )
