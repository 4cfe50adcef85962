"""The search for evidence: the kernel's own walk, in which each mark is chosen by trying what holds.

The kernel asks for marks one by one and checks each. Here a mark is what holds on the part at hand; where nothing does, the part is split, up to
some depth. What was chosen is written down, and is the proof.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from verify.kernel.bodies import Body, Condition
from verify.kernel.evidence import FORMAT, Evidence
from verify.kernel.hoops import Opening
from verify.kernel.polynomials import Bernstein
from verify.kernel.trees import Cell, Marks, Part

PROOF_FILE = "proof.json"


@dataclass(frozen=True, slots=True)
class Style:
    """Way in which a kind of tree is searched: for which marks, and how deep at the most."""

    marks: str
    depth: int


_STYLES: Mapping[str, Style] = {
    "inside": Style("", 16),
    "nominal": Style("", 30),
    "openings": Style("", 18),
    "rims": Style("n", 16),
    "obstacles": Style("n", 14),
    "workspace": Style("m", 24),
    "limits": Style("m", 24),
    "turning": Style("m", 16),
    "pairs": Style("m", 24),
    "apart": Style("km", 28),
}

CROSSING = 20
"""Halvings from which on one crossing of a region's boundary, without margin, is near enough to an instant."""

NEAR = 8
"""Halvings from which on a path inside an opening's cylinder counts as near the opening."""


@dataclass(eq=False)
class _Chosen:
    """Marks that are chosen as they are asked for."""

    style: Style
    marks: list[str] = field(default_factory=list[str])

    def take(self, part: Part, depth: int) -> str:
        """Return a mark that holds, or that splits, or none."""
        what = getattr(part.claims, "__self__", None) if isinstance(part, Cell) else None
        if isinstance(what, Body) and isinstance(part, Cell):
            mark = _of_region(part, what, depth)
        elif isinstance(what, Opening) and isinstance(part, Cell):
            mark = _of_opening(part, what, depth)
        else:
            mark = next(filter(part.holds, self.style.marks), None)
        mark = mark or ("s" if depth < self.style.depth else "?")
        self.marks.append(mark)
        return mark


class Search(Evidence):
    """Evidence that is sought as the kernel asks for it.

    Args:
        table: Evidence that is known before: numbers, relations, sums of half-spaces.
    """

    def __init__(self, table: Mapping[str, Any]) -> None:
        super().__init__(table)
        self._given = dict(table)
        self._chosen: dict[str, _Chosen] = {}

    def give(self, more: Mapping[str, Any]) -> None:
        """Add evidence that is known."""
        self._given.update(more)

    def look_at_all_times(self, one: str, other: str) -> None:
        """Have a pair's distance looked at for all times that clocks allow, not at one time."""
        self._chosen.pop(f"pairs/{one}/{other}", None)
        self._given[f"apart/{one}/{other}"] = ""

    def optional(self, key: str) -> Any:  # of any type: JSON nests
        """Return what is known of a key."""
        return self._given.get(key)

    def marks(self, key: str) -> Marks:
        """Return marks that are chosen when they are taken."""
        chosen = self._chosen[key] = _Chosen(_STYLES[key.partition("/")[0]])
        return chosen

    def evidence(self) -> dict[str, Any]:
        """Return what was given and chosen."""
        return {**self._given, **{key: run_lengths(chosen.marks) for key, chosen in self._chosen.items()}}


def _of_region(cell: Cell, body: Body, depth: int) -> str | None:
    """Return what holds of a region, `?` where no half can tell more, or None."""
    for mark in "nm":
        if cell.holds(mark):
            return mark
    if depth >= CROSSING and cell.holds("c"):
        return "c"
    known = [body.known(k, row) or _between(row, body.conditions[k]) for k, row in enumerate(cell.rows)]
    never_out = any(all(known[k] in ("kept", "between") for k in part) for part in body.parts)
    never_in = all(any(known[k] in ("broken", "between") for k in cover) for cover in body.covers)
    return "?" if never_out and never_in else None


def _between(row: Bernstein, one: Condition) -> str:
    return "between" if row.at_most(one.outside) and (one.inside is None or row.above(one.inside)) else ""


def _of_opening(cell: Cell, opening: Opening, depth: int) -> str | None:
    """Return what holds of an opening; inside its cylinder a path is taken to be near once it surely is, or parts are small."""
    if cell.holds("n"):
        return "n"
    along = cell.rows[0]
    near = depth >= NEAR or (along.at_least(-opening.far) and along.at_most(opening.far))
    return "i" if near and cell.holds("i") else None


def run_lengths(marks: list[str]) -> str:
    """Return marks as text, with how often each stands there one after another."""
    runs = ((mark, len(list(run))) for mark, run in itertools.groupby(marks))
    return "".join(f"{count if count > 1 else ''}{mark}" for mark, count in runs)


def proof_text(evidence: Mapping[str, Any]) -> str:
    """Return the text of a proof."""

    def plain(value: object) -> object:
        if isinstance(value, Fraction):
            return float(value)
        raise TypeError(type(value).__name__)

    table = {"format": FORMAT, "evidence": evidence}
    return json.dumps(table, sort_keys=True, allow_nan=False, separators=(",", ":"), default=plain) + "\n"
