"""Regions that have no point in common, and regions that lie in others.

Each inequality of a convex part is f(x) <= 0. Where a sum of some of them, with weights that are not negative, is above zero everywhere
there is no common point; where it is nowhere below another inequality, that one is kept as well (Coq: `farkas_empty`, `farkas_keeps`).
Both are questions of a symmetric matrix of four rows being semidefinite.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from .bodies import ZERO, is_semidefinite, terms_of
from .evidence import Evidence
from .labels import Relations
from .refused import Refused
from .statement import Inequality, Shape, Statement

Terms = Sequence[Fraction]


def check_relations(statement: Statement, evidence: Evidence) -> Relations:
    """Check the relations that a proof names: lists of a kind, two regions, and where the weights are.

    Raises:
        Refused: One is not proved.
    """
    found: dict[str, set[tuple[str, str]]] = {"disjoint": set(), "nested": set()}
    names = evidence.optional("relations") or []
    for entry in names if isinstance(names, list) else [None]:
        if not isinstance(entry, list) or len(entry) != 3 or not all(isinstance(word, str) for word in entry):
            raise Refused("the proof's relations are none")
        kind, a, b = entry
        if kind not in found or a not in statement.regions or b not in statement.regions or a == b:
            raise Refused("the proof's relations are of unknown regions")
        rows = evidence.rows(f"weights/{a}/{b}", 2)
        (_check_disjoint if kind == "disjoint" else _check_nested)(statement.regions[a], statement.regions[b], rows)
        found[kind].add((min(a, b), max(a, b)) if kind == "disjoint" else (a, b))
    return Relations(frozenset(found["disjoint"]), frozenset(found["nested"]))


def _check_disjoint(one: Shape, other: Shape, rows: list[list[list[int]]]) -> None:
    """Check each pair of parts: a row of weights for the inequalities of both."""
    pairs = [(a, b) for a in one.parts for b in other.parts]
    if len(rows) != len(pairs):
        raise Refused("the proof does not part all parts of two regions")
    for (a, b), row in zip(pairs, rows, strict=True):
        _require([*_lowered(one, a), *_lowered(other, b)], row, [*[ZERO] * 9, Fraction(1, 1 << 30)])


def _check_nested(inner: Shape, outer: Shape, rows: list[list[list[int]]]) -> None:
    """Check for each part of the inner region, and each inequality of an outer one of one part, that it is kept."""
    asked = [(_lowered(inner, part), kept) for part in inner.parts for held in outer.parts for kept in _lowered(outer, held)]
    if len(outer.parts) > 1 or len(rows) != len(asked):
        raise Refused("the proof does not show that a region lies in another")
    for (terms, kept), row in zip(asked, rows, strict=True):
        _require(terms, row, kept)


def _lowered(shape: Shape, part: Sequence[Inequality]) -> list[Terms]:
    """Return a part's inequalities as weights of what must not be above zero."""
    return [[*terms[:9], terms[9] - one.bound] for one in part for terms in [terms_of(one, shape.center)]]


def _require(inequalities: Sequence[Terms], row: list[list[int]], least: Terms) -> None:
    """Refuse weights, each a whole number over 2^40, with which inequalities are somewhere below a quadratic function."""
    if any(k >= len(inequalities) for k, _ in row):
        raise Refused("the proof weighs an inequality that there is not")
    total = [sum((Fraction(w, 1 << 40) * inequalities[k][i] for k, w in row), -low) for i, low in enumerate(least)]
    xx, xy, xz, yy, yz, zz, x, y, z, one = (
        value * (1 if i in (0, 3, 5, 9) else Fraction(1, 2)) for i, value in enumerate(total)
    )
    if not is_semidefinite([[xx, xy, xz, x], [xy, yy, yz, y], [xz, yz, zz, z], [x, y, z, one]]):
        raise Refused("a relation of two regions is not proved")
