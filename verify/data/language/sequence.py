"""Sequences of hoop passages as text: `hoop0F hoop1R (hoop2F hoop0F)*` (2019 paper, Section III-A).

Each entry is a hoop's name followed by the side: `F` flies along the hoop's normal, from its rear control point
to its front one; `R` flies the other way. One group at the end, `(...)*`, is a cycle that is repeated for ever.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

from verify.data.errors import BadInput, did_you_mean

Direction = Literal["F", "R"]

MAX_PASSAGES = 500


@dataclass(frozen=True, slots=True)
class Passage:
    """One flight through a hoop: along its normal (`F`) or against it (`R`)."""

    hoop: str
    direction: Direction

    def __str__(self) -> str:
        return f"{self.hoop}{self.direction}"


@dataclass(frozen=True, slots=True)
class Sequence:
    """Passages in order; `cycle` is repeated for ever where it is not None."""

    prefix: tuple[Passage, ...]
    cycle: tuple[Passage, ...] | None = None

    def __str__(self) -> str:
        text = " ".join(map(str, self.prefix))
        if self.cycle is not None:
            text += (" " if text else "") + "(" + " ".join(map(str, self.cycle)) + ")*"
        return text

    def same_passages(self, other: Sequence) -> bool:
        """Return whether both are the same passages in the same order for ever, wherever their cycles begin.

        `aF (bF)*` is `aF bF (bF bF)*`, and is neither `(aF bF)*` nor `aF bF`.
        """
        if bool(self.cycle) != bool(other.cycle):
            return False
        # two words that repeat are one where they agree on both prefixes and as much as both cycles (Fine and Wilf 1965)
        parts = (self.prefix, other.prefix, self.cycle or (), other.cycle or ())
        count = sum(map(len, parts)) + 1
        return self._first(count) == other._first(count)

    def _first(self, count: int) -> tuple[Passage, ...]:
        return tuple(itertools.islice(itertools.chain(self.prefix, itertools.cycle(self.cycle or ())), count))


class SequenceError(BadInput):
    """A sequence that cannot be read; the message has a caret under the place."""

    def __init__(self, text: str, position: int, reason: str) -> None:
        super().__init__(f"{reason}\n  {text}\n  {' ' * position}^")
        self.position = position
        self.reason = reason


_TOKEN = re.compile(r"\s*(?:(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<open>\()|(?P<close>\)\s*\*)|(?P<other>\S))")


def parse_sequence(text: str, hoops: Collection[str]) -> Sequence:
    """Read a sequence of passages.

    Args:
        text: Such as `hoop0F hoop1R (hoop2F)*`.
        hoops: Names of the hoops that exist.

    Raises:
        SequenceError: An unknown hoop, a missing F or R, an empty or misplaced cycle.
    """
    prefix: list[Passage] = []
    cycle: list[Passage] | None = None
    closed = False
    position = 0
    while match := _TOKEN.match(text, position):
        kind = str(match.lastgroup)
        start, position = match.start(kind), match.end()
        if closed:
            raise SequenceError(text, start, "Nothing may follow the cycle `(...)*`: it repeats for ever.")
        if kind == "name":
            (prefix if cycle is None else cycle).append(_passage(text, start, match.group("name"), hoops))
        elif kind == "open" and cycle is None:
            cycle = []
        elif kind == "close" and cycle:
            closed = True
        elif kind == "close":
            raise SequenceError(text, start, "An empty cycle `()*`." if cycle is not None else "This `)*` was never opened.")
        elif match.group(kind) == ")":
            raise SequenceError(text, start, "A group is a cycle and ends with `)*`.")
        else:
            raise SequenceError(text, start, f"`{match.group(kind)}` is not expected; write entries such as `hoop0F`.")
        if len(prefix) + len(cycle or ()) > MAX_PASSAGES:
            raise SequenceError(text[:80], 0, f"More than {MAX_PASSAGES} passages.")
    if cycle is not None and not closed:
        raise SequenceError(text, len(text), "The cycle is not closed with `)*`.")
    if not prefix and cycle is None:
        raise SequenceError(text, 0, "The sequence is empty; write entries such as `hoop0F`.")
    return Sequence(tuple(prefix), None if cycle is None else tuple(cycle))


def _passage(text: str, start: int, token: str, hoops: Collection[str]) -> Passage:
    name, side = token[:-1], token[-1]
    if name in hoops and side == "F":
        return Passage(name, "F")
    if name in hoops and side == "R":
        return Passage(name, "R")
    if token in hoops:
        raise SequenceError(
            text, start, f"'{token}' lacks its side: write {token}F (along its normal) or {token}R (against it)."
        )
    if side not in "FR":
        raise SequenceError(text, start, f"'{token}' must end in F or R, after the name of a hoop.{did_you_mean(token, hoops)}")
    known = ", ".join(sorted(hoops)) or "(none)"
    raise SequenceError(text, start, f"'{name}' is not a hoop of this mission.{did_you_mean(name, hoops)} Hoops: {known}.")
