"""The search for evidence: trees of what holds on parts of intervals, found with the kernel's own parts."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, NamedTuple

from verify.kernel.statement import Refused
from verify.kernel.trees import FORMAT, Cell, Part

PROOF_FILE = "proof.json"


class Style(NamedTuple):
    """Way in which a kind of tree is searched: for which marks, how deep at the most, and whether it may leave something open."""

    marks: str
    depth: int
    open: bool = False


STYLES: Mapping[str, Style] = {
    "inside": Style("nmyio", 40, open=True),
    "nominal": Style("nmo", 30, open=True),
    "openings": Style("nFR", 18),
    "rims": Style("n", 16),
    "obstacles": Style("n", 14),
    "workspace": Style("m", 24),
    "limits": Style("m", 24),
    "legs": Style("km", 40),
    "turning": Style("m", 16),
    "apart": Style("km", 28),
}

EDGE = 12
"""Halvings from which on it is near enough to an instant when a path comes to a region at the margin, or leaves it."""

FINE = 20
"""The same where a formula is bounded in seconds: the instant is known to a millionth of a segment."""

NEAR = 8
"""Halvings from which on a path inside an opening's cylinder counts as near the opening."""

_FROM = {**dict.fromkeys("yio", EDGE), **dict.fromkeys("FR", NEAR)}


@dataclass(frozen=True, slots=True)
class OnTheWay:
    """Knowledge of a part of a piece, of which only what is on the way to a visit counts.

    Attributes:
        cell: What is known.
        start: When it begins, s.
        stop: When it ends, s.
        ways: Times that count, s.
    """

    cell: Cell
    start: Fraction
    stop: Fraction
    ways: Sequence[tuple[Fraction, Fraction]]

    def holds(self, mark: str) -> bool:
        """Return whether a mark is so; of `k`, whether none of the part counts."""
        if mark == "k":
            return all(self.stop <= low or high <= self.start for low, high in self.ways)
        return self.cell.holds(mark)

    def halves(self) -> tuple[OnTheWay, OnTheWay]:
        """Return both halves."""
        middle, (first, second) = (self.start + self.stop) / 2, self.cell.halves()
        return replace(self, cell=first, stop=middle), replace(self, cell=second, start=middle)


def trees_of(kind: str, parts: Sequence[Part], roots: Sequence[str] = ()) -> list[str]:
    """Return the marks of the trees of parts, up to what is open and must not be.

    Args:
        kind: Of evidence.
        parts: The parts.
        roots: For each of them a mark of all of it, or nothing; none where none is known.
    """
    found: list[str] = []
    for part, root in zip(parts, roots or [""] * len(parts), strict=True):
        found.append(root or tree_of(STYLES[kind], part, found[-1][-1] if found else ""))
        if not STYLES[kind].open and found[-1].endswith("?"):
            break
    return found


def tree_of(style: Style, whole: Part, before: str = "") -> str:
    """Return the marks of one tree, up to what is open and must not be.

    Args:
        style: Its style.
        whole: The part that it divides.
        before: Mark of the leaf before it, if any.
    """
    found: list[str] = []
    waiting = [(whole, 0)]
    while waiting and (style.open or found[-1:] != ["?"]):
        part, depth = waiting.pop()
        mark = _mark(style, part, depth, before)
        if not mark and depth < style.depth:
            mark = "s"
            first, second = part.halves()
            waiting += [(second, depth + 1), (first, depth + 1)]
        else:
            before = mark
        found.append(mark or "?")
    return "".join(found)


def _mark(style: Style, part: Part, depth: int, before: str) -> str:
    """Return what holds on a part, `?` where no half can tell more, or nothing; a passage goes on in the way in which it began."""
    for mark in style.marks.replace("FR", "RF") if before == "R" else style.marks:
        sought = depth >= _FROM.get(mark, 0) or (mark in "FR" and _is_near(part))
        with suppress(Refused):  # a divisor may be zero
            if sought and part.holds(mark):
                return mark
    hopeless = style.open and isinstance(part, Cell) and _is_hopeless(part)
    return ("y" if "y" in style.marks else "?") if hopeless else ""


def _is_near(part: Part) -> bool:
    """Return whether all of a part is surely within the margin of an opening's plane."""
    assert isinstance(part, Cell)
    along, _, far = part.rules["n"][0][0][0]
    return part.row(along).keeps("<=", far) and part.row(along).keeps(">=", -far)


def _is_hopeless(cell: Cell) -> bool:
    """Return whether no half can be out of a region, as some part nowhere is, nor in, as it breaks what it has to keep."""
    (outside,), ways = cell.rules["n"], cell.rules["m"]
    if not any(all(cell.row(form).keeps("<=", bound) for form, _, bound in part) for part in outside):
        return False
    return all(any(all(cell.row(form).keeps(">", bound) for form, _, bound in one) for one in way) for way in ways)


def starts_of(tree: str) -> Iterator[tuple[Fraction, str]]:
    """Yield where the leaves of a tree begin, from 0 to 1, and their marks."""
    waiting = [(0, 0)]
    for mark in tree:
        place, depth = waiting.pop()
        if mark == "s":
            waiting += [(2 * place + 1, depth + 1), (2 * place, depth + 1)]
        else:
            yield Fraction(place, 1 << depth), mark


def run_lengths(trees: Iterable[str]) -> str:
    """Return marks as text, with how often each stands there one after another."""
    runs = ((mark, len(list(run))) for mark, run in itertools.groupby("".join(trees)))
    return "".join(f"{count if count > 1 else ''}{mark}" for mark, count in runs)


def proof_text(evidence: Mapping[str, Any]) -> str:
    """Return the text of a proof."""

    def plain(value: object) -> object:
        if isinstance(value, Fraction):
            return float(value)
        raise TypeError(type(value).__name__)

    table = {"format": FORMAT, "evidence": evidence}
    return json.dumps(table, sort_keys=True, allow_nan=False, separators=(",", ":"), default=plain) + "\n"
