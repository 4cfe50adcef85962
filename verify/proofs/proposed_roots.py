"""Marks of whole segments and pieces, proposed in floats: most trees are one leaf, for which nothing exact needs to be computed.

The kernel checks each mark. What floats do not show with room to spare is left to the exact search.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from verify.kernel.flights import Path, Segment
from verify.kernel.trees import Polynomial, Rules
from verify.kernel.zones import Flown, Two
from verify.proofs.search import EDGE

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
ROOM = 1e-9
"""Share of the numbers at hand by which a bound must be kept; roundings are far smaller."""

_BOTH = 2 * EDGE
"""Halvings of two segments, at the most."""

_MOST = 20_000
"""Parts of segments that are looked at together; of robots that meet there would be more and more."""


@cache
def _matrix(degree: int) -> Floats:
    """Return the matrix from powers to Bernstein coefficients on [0, 1]."""
    return np.array([[math.comb(i, k) / math.comb(degree, k) for i in range(degree + 1)] for k in range(degree + 1)])


def bernstein(powers: Floats) -> Floats:
    """Return Bernstein coefficients on [0, 1] of polynomials, in their last axis."""
    return powers @ _matrix(powers.shape[-1] - 1)


def products(one: Floats, other: Floats) -> Floats:
    """Return products of polynomials, in their last axis."""
    found = np.zeros((*one.shape[:-1], one.shape[-1] + other.shape[-1] - 1))
    for k in range(one.shape[-1]):
        found[..., k : k + other.shape[-1]] += one[..., k, None] * other
    return found


def powers_of(segments: Sequence[Segment], axes: int) -> Floats:
    """Return coefficients over u from 0 to 1. Shape (segments, axes, 8)."""
    empty = [0.0] * 8
    rows = [[math.ldexp(n, -axis.shift) for n in axis.numbers] for one in segments for axis in one.axes[:axes]]
    found = np.array([[*row, *empty[len(row) :]] for row in rows]).reshape(len(segments), axes, 8)
    lengths = np.array([float(one.length) for one in segments])
    return found * lengths[:, None, None] ** np.arange(8.0)


def _summed(weights: Floats, rows: Floats) -> Floats:
    """Return sums of rows, each times its weight. Shape (sums, coefficients, segments), so that extremes of coefficients are found quickly."""
    return (weights @ rows.reshape(len(rows), -1)).reshape(len(weights), *rows.shape[1:])


class FlownSegments:
    """All segments of a team's paths: Bernstein coefficients of x, y, z and 1, and of their products.

    Attributes:
        lines: Shape (segments, 4, 8).
        of: For each robot which of them are its own.
    """

    def __init__(self, paths: Mapping[str, Path]) -> None:
        segments = [segment for path in paths.values() for segment in path.segments]
        ends = np.cumsum([0, *(len(path.segments) for path in paths.values())])
        self.of = {name: slice(first, last) for name, first, last in zip(paths, ends, ends[1:], strict=False)}
        self._known: dict[tuple[Hashable, ...], tuple[Rules, list[str]]] = {}
        places = powers_of(segments, 3)
        ones = np.zeros((len(places), 1, 8))
        ones[:, 0, 0] = 1
        pairs = np.array([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)])
        self.lines = bernstein(np.concatenate([places, ones], axis=1))
        twos = products(places[:, pairs[:, 0]], places[:, pairs[:, 1]])
        raised = np.pad(np.concatenate([places, ones], axis=1), ((0, 0), (0, 0), (0, 7)))
        squares = bernstein(np.concatenate([twos, raised], axis=1))
        self._lines, self._squares = (np.moveaxis(rows, 0, -1).copy() for rows in (self.lines, squares))

    def trees(self, name: str, rules: Rules, marks: str, depth: int = 0) -> list[str]:
        """Return for each segment of a robot the marks of a tree, of some that surely hold, or nothing.

        Args:
            name: The robot's.
            rules: What marks claim.
            marks: The marks.
            depth: Halvings at the most.
        """
        if (id(rules), marks) not in self._known:
            self._known[id(rules), marks] = rules, self._trees(rules, marks, depth)
        return self._known[id(rules), marks][1][self.of[name]]

    def _trees(self, rules: Rules, marks: str, depth: int) -> list[str]:
        atoms = [atom for mark in marks for one in rules[mark] for clause in one for atom in clause]
        numbers: dict[Hashable, int] = {}
        index = [numbers.setdefault(form, len(numbers)) for form, _, _ in atoms]
        forms, levels = _Forms(numbers, self._lines, self._squares), list[NDArray[np.str_]]()
        bounds = np.array([float(bound) for _, _, bound in atoms]).reshape(-1, 1)
        over = np.array([sign in (">", ">=") for _, sign, _ in atoms], bool).reshape(-1, 1)
        for _ in range(depth + 1):
            low, high = (edge[index] for edge in forms.extremes())
            room = ROOM * (1 + abs(bounds) + np.maximum(abs(low), abs(high)))
            holds = iter(np.where(over, low > bounds + room, high < bounds - room))
            found = np.full(low.shape[1], "", dtype="<U1")
            for mark in marks:
                for one in rules[mark]:
                    every = np.ones(len(found), bool)
                    for clause in one:
                        some = [next(holds) for _ in clause]
                        every &= np.logical_or.reduce(some) if some else False
                    found[every & (found == "")] = mark
            levels.append(found)
            if found.all():
                break
            forms.halve(found == "")
        return ["" if "?" in tree else tree for tree in _joined(levels)]

    def region_trees(self, name: str, rules: Rules, depth: int = EDGE) -> list[str]:
        """Return for each segment of a robot the marks of its tree in a region at the margin, open where none can be told.

        Args:
            name: The robot's.
            rules: What marks claim.
            depth: Halvings by which comings and goings are told; the same whenever the rules are.
        """
        if (id(rules),) not in self._known:
            self._known[(id(rules),)] = rules, self._region_trees(rules, depth)
        return self._known[(id(rules),)][1][self.of[name]]

    def _region_trees(self, rules: Rules, depth: int) -> list[str]:
        (outside,), ways = rules["n"], rules["m"]
        broken = {form: float(bound) for part in outside for form, _, bound in part}
        kept = {form: float(bound) for way in ways for one in way for form, _, bound in one}
        numbers = {form: k for k, form in enumerate(broken)}
        parts = [[numbers[form] for form, _, _ in part] for part in outside]
        claims = [[[numbers[form] for form, _, _ in one] for one in way] for way in ways]
        inner = np.array([kept.get(form, -math.inf) for form in broken]).reshape(-1, 1)
        outer = np.array(list(broken.values())).reshape(-1, 1)
        forms, levels = _Forms(numbers, self._lines, self._squares), list[NDArray[np.str_]]()
        for level in range(depth + 1):
            low, high = forms.extremes()
            room = ROOM * (1 + np.maximum(abs(low), abs(high)))
            marks = np.full(low.shape[1], "", dtype="<U1")
            inside, never, within, beyond = high < inner - room, low > inner, high < outer - room, low > outer + room
            lost = _all(_any(_all(never[k] for k in one) for one in way) for way in claims)
            marks[_any(_all(within[k] for k in part) for part in parts) & (lost | (level == depth))] = "y"
            marks[_any(_all(_any(inside[k] for k in one) for one in way) for way in claims)] = "m"
            marks[_all(_any(beyond[k] for k in part) for part in parts)] = "n"
            if level == depth:
                for mark, once in forms.changes(room):
                    near = within | once
                    found = _all(_any(beyond[k] for k in part) | _all(near[k] for k in part) for part in parts)
                    marks[found & (marks == "")] = mark
            levels.append(marks)
            if marks.all():
                break
            forms.halve(marks == "")
        return _joined(levels)


class _Forms:
    """Bernstein coefficients of some functions along parts of segments, whole ones at first."""

    def __init__(self, forms: Iterable[Hashable], lines: Floats, squares: Floats) -> None:
        weights = np.array([_weights(form) for form in forms]).reshape(-1, 10)
        flat = ~weights[:, :6].any(axis=1)  # fewer coefficients do
        self._order = np.argsort(np.concatenate([np.flatnonzero(flat), np.flatnonzero(~flat)]))
        both = [_summed(weights[flat, 6:], lines), _summed(weights[~flat], squares)]
        self._both = [rows for rows in both if len(rows)] or both[:1]

    def extremes(self) -> tuple[Floats, Floats]:
        """Return the least and the greatest coefficients. Shape of each (functions, parts)."""
        low, high = (np.concatenate([edge(rows, axis=1) for rows in self._both]) for edge in (np.min, np.max))
        return low[self._order], high[self._order]

    def changes(self, room: Floats) -> Iterator[tuple[str, Flags]]:
        """Yield where functions surely fall, so that a path may come in, and where they rise, so that it may go out."""
        steps = [np.diff(rows, axis=1) for rows in self._both]
        yield "i", np.concatenate([step.max(axis=1) for step in steps])[self._order] < -room
        yield "o", np.concatenate([step.min(axis=1) for step in steps])[self._order] > room

    def halve(self, open_: Flags) -> None:
        """Take both halves of some parts in the stead of all, one after the other."""
        self._both = [_halves(rows[..., open_]) for rows in self._both]


def parted_trees(parts: Sequence[Two]) -> list[str]:
    """Return the marks of trees of two segments each, as the kernel halves and parts them; nothing where floats cannot tell.

    Args:
        parts: The two segments of each tree.
    """
    if not parts:
        return []
    known: dict[int, tuple[Floats, Floats]] = {}

    def floats(one: Flown) -> tuple[Floats, Floats]:
        if id(one) not in known:
            times = [float(one.start), float(one.stop), float(one.stop - one.start)]
            if times[2] != one.stop - one.start:  # which of two lasts longer, floats cannot tell
                times[2] = math.nan
            known[id(one)] = np.array([[n / row.unit for n in row.numbers] for row in one.places]), np.array(times)
        return known[id(one)]

    flown = [(floats(two.one), floats(two.other)) for two in parts]
    places, times = (np.array([[one[k], other[k]] for one, other in flown]) for k in (0, 1))
    asked = np.array([[math.sqrt(two.square), float(two.error)] for two in parts])
    levels: list[NDArray[np.str_]] = []
    for level in range(_BOTH + 1):
        first, other = times[:, 0], times[:, 1]
        beside = np.maximum(first[:, 0] - other[:, 1], other[:, 0] - first[:, 1]) > asked[:, 1] + ROOM * (1 + abs(first[:, 1]))
        across = places.sum(axis=-1)
        normals = np.floor((across[:, 0] - across[:, 1]) * 4096 + 1e-7)  # the kernel's own
        near, far = (np.einsum("nd,ndk->nk", normals, places[:, k]) for k in (0, 1))
        lengths = np.linalg.norm(normals, axis=-1)
        parted = (near.min(axis=-1) - far.max(axis=-1) > (asked[:, 0] * (1 + 1e-6) + 1e-6) * lengths) & (lengths > 300)
        undecided = "" if level < _BOTH and len(places) < _MOST else "?"
        marks = np.where(beside, "k", np.where(parted, "m", undecided))
        marks[(marks == "") & np.isnan(times[:, :, 2]).any(axis=1)] = "?"
        levels.append(marks)
        open_ = marks == ""
        if not open_.any():
            break
        places, times, asked = places[open_], times[open_], np.repeat(asked[open_], 2, axis=0)
        which = (times[:, 0, 2] < times[:, 1, 2]).astype(int)
        rows = np.arange(len(which))
        halves = (places[rows, which] @ _split(7).T).reshape(-1, 3, 2, 8)
        middles = (times[rows, which, 0] + times[rows, which, 1]) / 2
        times[rows, which, 2] /= 2
        places, times = np.repeat(places, 2, axis=0), np.repeat(times, 2, axis=0)
        for k, edge in ((0, 1), (1, 0)):
            places[2 * rows + k, which], times[2 * rows + k, which, edge] = halves[:, :, k], middles
    return ["" if "?" in tree else tree for tree in _joined(levels)]


def _joined(levels: Sequence[NDArray[np.str_]]) -> list[str]:
    """Return trees by the marks of each level, where an empty one is split; what is split at last is open."""
    found: list[str] = []
    for marks in reversed(levels):
        below = iter(found)
        found = [mark or ("s" + one + next(below) if (one := next(below, "")) else "?") for mark in marks.tolist()]
    return found


def _any(every: Iterable[Any]) -> Any:  # of arrays, or of what is so of all
    return functools.reduce(operator.or_, every, False)


def _all(every: Iterable[Any]) -> Any:  # as above
    return functools.reduce(operator.and_, every, True)


@cache
def _split(degree: int) -> Floats:
    """Return the matrix from Bernstein coefficients on an interval to those on its first half, and on its second one."""
    first = np.array([[math.comb(i, k) / 2**i for k in range(degree + 1)] for i in range(degree + 1)])
    return np.concatenate([first, first[::-1, ::-1]])


def _halves(rows: Floats) -> Floats:
    """Return both halves of each segment, one after the other."""
    forms, size, count = rows.shape
    both = (_split(size - 1) @ rows).reshape(forms, 2, size, count)
    return np.moveaxis(both, 1, -1).reshape(forms, size, 2 * count)


def _weights(form: Hashable) -> list[float]:
    assert isinstance(form, Polynomial)
    return [n / (1 << form.shift) for n in form.numbers]
