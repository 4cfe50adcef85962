"""Subdivision trees: an interval cut into halves, in preorder, with what holds on each leaf (Coq: `check_tree_sound`).

Marks of a tree are letters: `s` splits, `?` claims nothing, any other is a claim that is checked by whole numbers. The proof chooses marks; it
cannot choose what they claim.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import NamedTuple, Protocol, Self

from .polynomials import Bernstein
from .refused import Refused

DEEPEST = 64
"""Halvings of an interval, at the most; they bound the work."""

Rows = Sequence[Bernstein]


class Part(Protocol):
    """Knowledge of one part of an interval."""

    def holds(self, mark: str) -> bool:
        """Return whether what a mark claims is so on all of the part."""
        ...

    def halves(self) -> tuple[Self, Self]:
        """Return the same on its first and on its second half."""
        ...


class Marks(Protocol):
    """Marks, one after another."""

    def take(self, part: Part, depth: int) -> str:
        """Return the next mark; those of a file do not depend on the arguments."""
        ...


@dataclass(frozen=True)
class Cell:
    """Polynomials on a part of an interval, and what marks claim of them."""

    rows: Rows
    claims: Callable[[str, Rows], bool]
    _known: dict[str, bool] = field(default_factory=dict[str, bool])

    def holds(self, mark: str) -> bool:
        """Return whether what a mark claims is so."""
        if mark not in self._known:
            self._known[mark] = self.claims(mark, self.rows)
        return self._known[mark]

    def halves(self) -> tuple[Cell, Cell]:
        """Return both halves."""
        first, second = zip(*(row.halves() for row in self.rows), strict=True)
        return Cell(first, self.claims), Cell(second, self.claims)


class Leaf(NamedTuple):
    """A part of [0, 1], from place / 2^depth to (place + 1) / 2^depth, with its mark."""

    place: int
    depth: int
    mark: str
    part: Part

    @property
    def start(self) -> Fraction:
        """Its beginning."""
        return Fraction(self.place, 1 << self.depth)


def leaves(whole: Part, marks: Marks) -> Iterator[Leaf]:
    """Walk over one tree and yield its leaves from left to right, each of them checked.

    Raises:
        Refused: A mark is not so.
    """
    waiting = [(whole, 0, 0)]
    while waiting:
        part, place, depth = waiting.pop()
        mark = marks.take(part, depth)
        if mark == "s":
            if depth == DEEPEST:
                raise Refused("a tree is too deep")
            first, second = part.halves()
            waiting += [(second, 2 * place + 1, depth + 1), (first, 2 * place, depth + 1)]
        elif mark == "?" or part.holds(mark):
            yield Leaf(place, depth, mark, part)
        else:
            raise Refused(f"a leaf is marked {mark!r}, and that is not so")


def require(whole: Part, marks: Marks, what: str) -> None:
    """Check a tree that leaves nothing open.

    Args:
        whole: The interval.
        marks: Evidence.
        what: What is not proved where it does.

    Raises:
        Refused: It does.
    """
    if any(leaf.mark == "?" for leaf in leaves(whole, marks)):
        raise Refused(f"it is not proved that {what}")


def at_least(rows: Sequence[tuple[Bernstein, Fraction]]) -> Cell:
    """Return the claim `m` that polynomials are nowhere below their numbers."""
    least = [bound for _, bound in rows]
    return Cell([row for row, _ in rows], lambda mark, here: mark == "m" and all(map(Bernstein.at_least, here, least)))
