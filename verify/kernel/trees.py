"""Evidence, and subdivision trees: an interval cut into halves, in preorder, with what holds on each leaf (Coq: `check_tree_sound`).

Marks of a tree are letters: `s` splits, `?` claims nothing, any other is a claim that is checked by whole numbers. The proof chooses marks; it
cannot choose what they claim. They stand one after another in the order in which the kernel asks; a number before one says how often it stands there.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from copy import copy
from fractions import Fraction
from functools import cache
from itertools import repeat
from typing import Any, Protocol, Self, TypeVar

from .polynomials import Bernstein
from .statement import read, read_json, require

FORMAT = 4
DEEPEST = 64
"""Halvings of an interval, at the most; they bound the work."""

Atom = tuple[Hashable, str, Fraction]
"""What tells a polynomial from others, how it stands to a value (`Bernstein.keeps`), and the value."""
Rules = Mapping[str, Sequence[Sequence[Sequence[Atom]]]]
"""What each mark claims: of some alternative, all of its clauses, of each of which some atom."""


class Evidence:
    """Evidence as a proof's file holds it, by what it is evidence of."""

    def __init__(self, table: Mapping[str, Any]) -> None:
        self._table = table

    def get(self, key: str, kind: Any) -> Any:
        """Return an entry that is of some type; there has to be one, unless the type has None."""
        return read(kind, self._table.get(key), f"the proof's {key}")

    def marks(self, key: str) -> Iterator[str]:
        """Yield an entry's marks; there has to be one if marks are asked for."""
        text = self._table.get(key)
        require(isinstance(text, str), f"the proof has no marks for {key}")
        for run in re.finditer(r"(\d{0,9})(\D|$)", str(text)):
            yield from repeat(run[2], int(run[1] or 1))

    def prove(self, key: str, parts: Iterable[Part]) -> None:
        """Check the trees of parts, which leave nothing open."""
        marks = self.marks(key)
        for part in parts:
            require(all(mark != "?" for _, mark, _ in leaves(part, marks)), f"the proof's {key} leaves something open")


def read_evidence(text: str) -> Evidence:
    """Read a proof's file."""
    data = read_json(text, "proof.json")
    fits = isinstance(data, dict) and data.get("format") == FORMAT and isinstance(data.get("evidence"), dict)
    require(fits, f"proof.json is no proof of format {FORMAT}.")
    return Evidence(data["evidence"])


class Part(Protocol):
    """Knowledge of one part of an interval: whether what a mark claims holds on all of it, and the same on both halves."""

    def holds(self, mark: str) -> bool: ...  # noqa: D102

    def halves(self) -> tuple[Self, Self]: ...  # noqa: D102


P = TypeVar("P", bound=Part)


class Cell:
    """Polynomials on a part of an interval, which `row` returns, each found when it is asked for; and what marks claim of them."""

    def __init__(self, find: Callable[[Any], Bernstein], rules: Rules) -> None:
        self.row, self.rules = cache(find), rules

    def holds(self, mark: str) -> bool:
        """Return whether what a mark claims is so (Coq: `check_region_sound`, `check_nonneg_sound`)."""
        ways = self.rules.get(mark, ())
        return any(all(any(self.row(form).keeps(sign, value) for form, sign, value in one) for one in way) for way in ways)

    def halves(self) -> tuple[Self, Self]:
        """Return both halves."""
        both = cache(lambda form: self.row(form).halves())
        first, second = copy(self), copy(self)
        first.row, second.row = cache(lambda form: both(form)[0]), cache(lambda form: both(form)[1])
        return first, second


def leaves(whole: P, marks: Iterator[str]) -> Iterator[tuple[Fraction, str, P]]:
    """Yield the leaves of a tree over [0, 1] from left to right, each of them checked: its beginning, its mark and its part."""
    waiting = [(whole, 0, 0)]
    while waiting:
        part, place, depth = waiting.pop()
        mark = next(marks, "")
        if mark == "s":
            require(depth < DEEPEST, "a tree is too deep")
            first, second = part.halves()
            waiting += [(second, 2 * place + 1, depth + 1), (first, 2 * place, depth + 1)]
        else:
            require(mark == "?" or part.holds(mark), f"a leaf is marked {mark!r}, and that is not so")
            yield Fraction(place, 1 << depth), mark, part
