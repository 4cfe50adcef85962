"""Marks of whole segments and pieces, proposed in floats: most trees are one leaf, for which nothing exact needs to be computed.

The kernel checks each mark. What floats do not show with room to spare is left to the exact search.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from verify.kernel.flights import GRAVITY, Path, Segment
from verify.kernel.limits import Interval, rates_and_thrusts
from verify.kernel.statement import Robot
from verify.kernel.trees import Atom, Polynomial, Rules
from verify.kernel.zones import Flown, Two
from verify.proofs.search import EDGE

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
_ROOM = 1e-9
"""Share of the numbers at hand by which a bound must be kept; roundings are far smaller."""


@cache
def _matrix(degree: int) -> Floats:
    """Return the matrix from powers to Bernstein coefficients on [0, 1]."""
    return np.array([[math.comb(i, k) / math.comb(degree, k) for i in range(degree + 1)] for k in range(degree + 1)])


def _bernstein(powers: Floats) -> Floats:
    return powers @ _matrix(powers.shape[-1] - 1)


def _times(one: Floats, other: Floats) -> Floats:
    """Return products of polynomials, in their last axis."""
    found = np.zeros((*one.shape[:-1], one.shape[-1] + other.shape[-1] - 1))
    for k in range(one.shape[-1]):
        found[..., k : k + other.shape[-1]] += one[..., k, None] * other
    return found


def _square(vector: Floats) -> Floats:
    return _times(vector, vector).sum(axis=-2)


def _powers(segments: Sequence[Segment], axes: int) -> Floats:
    """Return coefficients over u from 0 to 1. Shape (segments, axes, 8)."""
    found = np.zeros((len(segments), axes, 8))
    for row, segment in zip(found, segments, strict=True):
        scale = float(segment.length) ** np.arange(8)
        for values, axis in zip(row, segment.axes, strict=False):
            values[: len(axis.numbers)] = [n / (1 << axis.shift) for n in axis.numbers]
        row *= scale
    return found


def _summed(weights: Floats, rows: Floats) -> Floats:
    """Return sums of rows, each times its weight. Shape (sums, coefficients, segments), so that extremes of coefficients are found quickly."""
    return (weights @ rows.reshape(len(rows), -1)).reshape(len(weights), *rows.shape[1:])


def _exceeds(low: Floats, bound: float, size: Floats) -> Flags:
    return low > bound + _ROOM * (1 + abs(bound) + size)


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
        places = _powers(segments, 3)
        ones = np.zeros((len(places), 1, 8))
        ones[:, 0, 0] = 1
        pairs = np.array([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)])
        self.lines = _bernstein(np.concatenate([places, ones], axis=1))
        products = _times(places[:, pairs[:, 0]], places[:, pairs[:, 1]])
        raised = np.pad(np.concatenate([places, ones], axis=1), ((0, 0), (0, 0), (0, 7)))
        squares = _bernstein(np.concatenate([products, raised], axis=1))
        self._lines, self._squares = (np.moveaxis(rows, 0, -1).copy() for rows in (self.lines, squares))

    def roots(self, name: str, rules: Rules, marks: str) -> list[str]:
        """Return for each segment of a robot one of some marks that surely holds on all of it, or nothing.

        Args:
            name: The robot's.
            rules: What marks claim.
            marks: The marks.
        """
        if (id(rules), marks) not in self._known:
            self._known[id(rules), marks] = rules, self._roots(rules, marks)
        return self._known[id(rules), marks][1][self.of[name]]

    def _roots(self, rules: Rules, marks: str) -> list[str]:
        atoms = [atom for mark in marks for one in rules[mark] for clause in one for atom in clause]
        holds = iter(self._hold(atoms))
        found = np.full(len(self.lines), "", dtype="<U1")
        for mark in marks:
            for one in rules[mark]:
                every = np.ones(len(found), bool)
                for clause in one:
                    some = [next(holds) for _ in clause]
                    every &= np.logical_or.reduce(some) if some else False
                found[every & (found == "")] = mark
        return found.tolist()

    def region_trees(self, name: str, rules: Rules) -> list[str]:
        """Return for each segment of a robot the marks of its tree in a region at the margin, open where none can be told.

        Args:
            name: The robot's.
            rules: What marks claim.
        """
        if (id(rules),) not in self._known:
            self._known[(id(rules),)] = rules, self._region_trees(rules, EDGE)
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
        weights = np.array([_weights(form) for form in numbers]).reshape(-1, 10)
        flat = ~weights[:, :6].any(axis=1)  # fewer coefficients do
        order = np.argsort(np.concatenate([np.flatnonzero(flat), np.flatnonzero(~flat)]))
        both = [_summed(weights[flat, 6:], self._lines), _summed(weights[~flat], self._squares)]
        both = [rows for rows in both if len(rows)]
        levels: list[NDArray[np.str_]] = []
        for level in range(depth + 1):
            low = np.concatenate([rows.min(axis=1) for rows in both])[order]
            high = np.concatenate([rows.max(axis=1) for rows in both])[order]
            room = _ROOM * (1 + np.maximum(abs(low), abs(high)))
            marks = np.full(low.shape[1], "", dtype="<U1")
            inside, never, within, beyond = high < inner - room, low > inner, high < outer - room, low > outer + room
            lost = _all(_any(never[one].all(axis=0) for one in way) for way in claims)
            marks[_any(within[part].all(axis=0) for part in parts) & (lost | (level == depth))] = "y"
            marks[_any(_all(inside[one].any(axis=0) for one in way) for way in claims)] = "m"
            marks[_all(beyond[part].any(axis=0) for part in parts)] = "n"
            if level == depth:
                for mark, once in self._changes(both, order, room):
                    marks[
                        _all(beyond[part].any(axis=0) | (within | once)[part].all(axis=0) for part in parts) & (marks == "")
                    ] = mark
            levels.append(marks)
            open_ = marks == ""
            if not open_.any():
                break
            both = [_halves(rows[..., open_]) for rows in both]
        found: list[str] = []
        for marks in reversed(levels):
            below = iter(found)
            found = [mark or ("s" + one + next(below) if (one := next(below, "")) else "?") for mark in marks.tolist()]
        return found

    @staticmethod
    def _changes(both: Sequence[Floats], order: NDArray[np.intp], room: Floats) -> Iterator[tuple[str, Flags]]:
        """Yield where functions surely fall, so that a path may come in, and where they rise, so that it may go out."""
        steps = [np.diff(rows, axis=1) for rows in both]
        yield "i", np.concatenate([step.max(axis=1) for step in steps])[order] < -room
        yield "o", np.concatenate([step.min(axis=1) for step in steps])[order] > room

    def _hold(self, atoms: Sequence[Atom]) -> Flags:
        """Return where atoms surely hold. Shape (atoms, segments)."""
        numbers: dict[Hashable, int] = {}
        index = [numbers.setdefault(form, len(numbers)) for form, _, _ in atoms]
        weights = np.array([_weights(form) for form in numbers]).reshape(-1, 10)
        round_ = weights[:, :6].any(axis=1)
        low, high = np.empty((len(weights), len(self.lines))), np.empty((len(weights), len(self.lines)))
        for chosen, rows in ((round_, self._squares), (~round_, self._lines)):
            if chosen.any():
                forms = _summed(weights[chosen, -len(rows) :], rows)
                low[chosen], high[chosen] = forms.min(axis=1), forms.max(axis=1)
        low, high = low[index], high[index]
        bounds = np.array([float(bound) for _, _, bound in atoms]).reshape(-1, 1)
        room = _ROOM * (1 + abs(bounds) + np.maximum(abs(low), abs(high)))
        over = np.array([sign in (">", ">=") for _, sign, _ in atoms], bool).reshape(-1, 1)
        return np.where(over, low > bounds + room, high < bounds - room)


def parted_roots(parts: Sequence[Two]) -> list[str]:
    """Return `m` for each two segments that a plane across the way from middle to middle surely parts by what is asked, else nothing."""
    if not parts:
        return []
    known: dict[int, Floats] = {}

    def places(one: Flown) -> Floats:
        if id(one.places) not in known:
            known[id(one.places)] = np.array([[n / row.unit for n in row.numbers] for row in one.places])
        return known[id(one.places)]

    near, far = np.array([places(two.one) for two in parts]), np.array([places(two.other) for two in parts])
    least = np.array([math.sqrt(two.square) for two in parts])
    normals = (near - far).mean(axis=-1)
    gaps = np.einsum("nk,nkd->nd", normals, near).min(axis=-1) - np.einsum("nk,nkd->nd", normals, far).max(axis=-1)
    lengths = np.linalg.norm(normals, axis=-1)
    parted = (gaps > (least * (1 + 1e-6) + 1e-6) * lengths) & (lengths > 0.01)
    return ["m" if one else "" for one in parted.tolist()]


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


@dataclass(slots=True)
class _Ranges:
    """Intervals in arrays, in the stead of the kernel's own; where a divisor may be zero, all numbers."""

    low: Floats
    high: Floats

    @classmethod
    def of(cls, value: Fraction) -> _Ranges:
        return cls(np.array(float(value)), np.array(float(value)))

    def __add__(self, other: _Ranges) -> _Ranges:
        return _Ranges(self.low + other.low, self.high + other.high)

    def __sub__(self, other: _Ranges) -> _Ranges:
        return _Ranges(self.low - other.high, self.high - other.low)

    def __neg__(self) -> _Ranges:
        return _Ranges(-self.high, -self.low)

    def __mul__(self, other: _Ranges) -> _Ranges:
        products = [self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high]
        return _Ranges(np.minimum.reduce(products), np.maximum.reduce(products))

    def __truediv__(self, other: _Ranges) -> _Ranges:
        apart = (other.low > 0) | (other.high < 0)
        low, high = np.where(apart, other.low, 1), np.where(apart, other.high, 1)
        found = self * _Ranges(1 / high, 1 / low)
        return _Ranges(np.where(apart, found.low, -1e300), np.where(apart, found.high, 1e300))

    def root(self) -> _Ranges:
        return _Ranges(np.sqrt(np.maximum(self.low, 0)), np.sqrt(np.maximum(self.high, 0)))

    def cosine_and_sine(self) -> tuple[_Ranges, _Ranges]:
        middle, away = (self.low + self.high) / 2, (self.high - self.low) / 2 + 1e-4  # the kernel takes angles on a grid
        cosine, sine = np.cos(middle), np.sin(middle)
        return _Ranges(np.maximum(cosine - away, -1), np.minimum(cosine + away, 1)), _Ranges(
            np.maximum(sine - away, -1), np.minimum(sine + away, 1)
        )


class FlownPieces:
    """All pieces of a team's paths, and which limits they surely keep."""

    def __init__(self, paths: Mapping[str, Path]) -> None:
        pieces = [piece for path in paths.values() for piece in path.pieces]
        ends = np.cumsum([0, *(len(path.pieces) for path in paths.values())])
        self._of = {name: slice(first, last) for name, first, last in zip(paths, ends, ends[1:], strict=False)}
        self._robots, self._turning = {name: path.robot for name, path in paths.items()}, dict[Hashable, list[str]]()
        lengths = np.array([float(piece.length) for piece in pieces])[:, None, None]
        self._derivatives = [_powers(pieces, 4)]
        for _ in range(4):
            before = self._derivatives[-1]
            self._derivatives.append(before[..., 1:] * np.arange(1, before.shape[-1]) / lengths)
        self._force = self._derivatives[2][:, :3].copy()
        self._force[:, 2, 0] += float(GRAVITY)
        self._size = _square(self._force)

    def roots(self, of: str, name: str, limit: float) -> list[str]:
        """Return `m` for each piece of a robot that surely keeps a limit, else nothing.

        Args:
            of: The robot's name.
            name: The limit's.
            limit: SI.
        """
        robot, own = self._robots[of], self._of[of]
        f, size = self._force[own], self._size[own]
        thrust = size * float(robot.mass) ** 2
        kept = np.ones(len(f), bool)
        if name in ("speed", "acceleration"):
            kept &= self._is_above(-_square(self._derivatives[1 if name == "speed" else 2][own, :3]), -(limit**2))
        if name == "thrust_max":
            kept &= self._is_above(-thrust, -(limit**2))
        if name in ("thrust_min", "tilt", "body_rate"):
            kept &= self._is_above(thrust, float(robot.limits["thrust_min"]) ** 2)
        if name == "tilt":
            upright = _times(f[:, 2], f[:, 2]) - size * math.cos(limit) ** 2
            kept &= self._is_above(f[:, 2], 0.0) & self._is_above(upright, 0.0)
        if name == "body_rate":
            j = self._derivatives[3][own]
            rates = [_times(j[:, i], f[:, k]) - _times(j[:, k], f[:, i]) for i, k in ((1, 2), (2, 0), (0, 1))]
            most, turned = _times(size, size) * limit**2, _square(np.stack(rates, axis=1))
            most[:, : turned.shape[1]] -= turned
            kept &= self._is_above(most, 0.0)
        return ["m" if one else "" for one in kept]

    def turning(self, of: str) -> list[str]:
        """Return `m` for each piece of a robot on which yaw rate and rotors surely keep their limits, else nothing."""
        robot = self._robots[of]
        limits = tuple(robot.limits[name] for name in ("rotor_thrust_min", "rotor_thrust_max", "yaw_rate"))
        alike = robot.mass, robot.arm, robot.inertia, robot.torque_to_thrust, limits
        if alike not in self._turning:
            self._turning[alike] = self._turns(robot)
        return self._turning[alike][self._of[of]]

    def _turns(self, robot: Robot) -> list[str]:
        _, _, _, j, s = self._derivatives
        rows = [*(self._force[:, k] for k in range(3)), *(j[:, k] for k in range(3)), *(s[:, k] for k in range(3))]
        rows += [self._derivatives[order][:, 3] for order in range(3)]
        rows += [self._size, np.sum([_times(self._force[:, k], j[:, k]) for k in range(3)], axis=0)]
        given = [_Ranges(row.min(axis=-1), row.max(axis=-1)) for row in map(_bernstein, rows)]
        with np.errstate(all="ignore"):
            rate, *thrusts = rates_and_thrusts(robot, cast("Sequence[Interval]", given))
        limits, kept = robot.limits, np.ones(len(j), bool)
        for one, low, high in [
            (rate, -limits["yaw_rate"], limits["yaw_rate"]),
            *((one, limits["rotor_thrust_min"], limits["rotor_thrust_max"]) for one in thrusts),
        ]:
            range_: Any = one
            room = _ROOM + 1e-6 * (abs(range_.low) + abs(range_.high))
            kept &= (range_.low > float(low) + room) & (range_.high < float(high) - room)
        return ["m" if one else "" for one in kept]

    def _is_above(self, powers: Floats, bound: float) -> Flags:
        rows = _bernstein(powers)
        return _exceeds(rows.min(axis=-1), bound, abs(rows).max(axis=-1))
