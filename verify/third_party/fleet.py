"""Many drones' flights in a few arrays: pieces of polynomials end to end, their times exact, for 10 000 drones of 600 pieces.

Each drone is there from 0 to the end of all: where its file begins later or ends sooner, a piece at rest is put before or after. A time is the
sum of two floats, exactly; the second one is zero where the first suffices.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from types import MappingProxyType
from typing import Literal

import numpy as np
from flint import fmpq, fmpq_poly
from numpy.typing import NDArray
from scipy.spatial import KDTree

from verify.arithmetic.balls import Balls, Floats, from_power, raised
from verify.arithmetic.exact import rational
from verify.data.errors import BadInput
from verify.third_party.shows.own_limits import NO_LIMITS, OwnLimits

Indices = NDArray[np.intp]
Basis = Literal["bernstein", "power"]
Home = tuple[str, int, tuple[float, float, float]]
"""What says so, at which end of a path (0 or 1), and where in m a drone must stand."""

MOST_DRONES = 50_000
LARGEST = 1e6
"""m and s; what is farther away or later is no flight."""
PAD = 0.01
"""m; drones that stand nearer than that to each other stand on one pad."""
SHORTEST = 1e-6
"""s; a shorter piece is a mistake of whoever wrote it."""


@dataclass(frozen=True, slots=True)
class Column:
    """Vertical take-off or landing of a drone outside its path.

    Attributes:
        drone: Index.
        kind: Which of the two.
        place: x and y, exact, in m.
        low: Its foot, in m.
        high: Its top, in m.
        since: From when on the drone may be anywhere on it, exact, in s; None from before the show.
        until: Until when; None after all of it.
    """

    drone: int
    kind: Literal["take-off", "landing"]
    place: tuple[Fraction, Fraction]
    low: float
    high: float
    since: Fraction | None
    until: Fraction | None


@dataclass(frozen=True, eq=False, slots=True)
class Flight:
    """One drone's flight as its file gives it.

    Attributes:
        name: Of the drone.
        knots: Exact start of each piece and end of the last, in s, each the sum of two floats; ascending. Shape (pieces + 1, 2).
        values: Control points of Bezier curves, or ascending powers of local time, in m. Shape (pieces, 3, degree + 1).
        degrees: Degree of each piece; of a lower one the rest of `values` is not looked at. Shape (pieces,).
        homes: Places where the drone must stand by what its file says beside its path.
        durations: Of pieces in powers of local time, in s, each one float exactly. Shape (pieces,).
        yaw: Times in s and headings in deg, between which it turns evenly; None where its file says none. Shape (setpoints, 2).
    """

    name: str
    knots: Floats
    values: Floats
    degrees: NDArray[np.int8]
    homes: tuple[Home, ...] = ()
    durations: Floats | None = None
    yaw: Floats | None = None


@dataclass(frozen=True, eq=False)
class Fleet:
    """All drones' flights, from 0 to the end of the last.

    Attributes:
        source: Names the files in messages.
        basis: What `values` are coefficients of.
        names: Of the drones.
        first: Row of each drone's first piece, and the number of all rows. Shape (drones + 1,).
        knots: Exact start of each piece and end of the drone's last, each the sum of two floats; drone by drone. Shape (rows + drones, 2).
        values: Control points, or ascending powers of local time, in m. Shape (rows, 3, degree + 1).
        degrees: Degree of each piece. Shape (rows,).
        homes: For each drone places where it must stand by what is said elsewhere: what that is, at which end of its path (0 or 1), where.
        durations: Of pieces in powers of local time, in s, each one float exactly (at rest any). Shape (rows,).
        own: What the files ask of the flights themselves.
        notes: What the files hold and nobody checks, in sentences.
        yaws: Of drones whose file says it, by index: times in s and headings in deg, between which they turn evenly. Shape (setpoints, 2).
        columns: Where drones take off and land outside their paths.
        assumed: What is assumed of `columns`, in sentences.
        rests: For each drone whether its first and its last row are rests that only fill the show.
    """

    source: str
    basis: Basis
    names: tuple[str, ...]
    first: Indices
    knots: Floats
    values: Floats
    degrees: NDArray[np.int8]
    homes: tuple[tuple[Home, ...], ...]
    durations: Floats
    own: OwnLimits = NO_LIMITS
    notes: tuple[str, ...] = ()
    yaws: Mapping[int, Floats] = field(default_factory=lambda: MappingProxyType[int, Floats]({}))
    columns: tuple[Column, ...] = ()
    assumed: tuple[str, ...] = ()
    rests: tuple[tuple[bool, bool], ...] = ()

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def owner(self) -> Indices:
        """Drone of each row. Shape (rows,)."""
        return np.repeat(np.arange(len(self.names)), np.diff(self.first))

    @cached_property
    def knot(self) -> Indices:
        """Index into `knots` of each row's start; its end is the next one. Shape (rows,)."""
        return np.arange(len(self.values)) + self.owner

    @property
    def degree(self) -> int:
        """The greatest degree."""
        return self.values.shape[-1] - 1

    @property
    def end(self) -> Fraction:
        """Time at which the last drone has come to its end, exact, in s."""
        return self.time(len(self.knots) - 1)

    def time(self, knot: int) -> Fraction:
        """Return the exact time of a knot, in s."""
        return Fraction(float(self.knots[knot, 0])) + Fraction(float(self.knots[knot, 1]))

    def start(self, row: int) -> Fraction:
        """Return when a piece begins, exact, in s."""
        return self.time(int(self.knot[row]))

    def stop(self, row: int) -> Fraction:
        """Return when a piece ends, exact, in s."""
        return self.time(int(self.knot[row]) + 1)

    def at(self, row: int, place: float) -> float:
        """Return the time at a place of a piece, from 0 to 1, in s."""
        start = self.start(row)
        return float(start + (self.stop(row) - start) * Fraction(place))

    def lengths(self, rows: Indices) -> tuple[Floats, Floats]:
        """Return how long pieces last, in s, and a bound on that number's error."""
        return length_between(self.knots[self.knot[rows]], self.knots[self.knot[rows] + 1])

    def positions(self, rows: Indices) -> Balls:
        """Return x, y and z on pieces, as polynomials on [0, 1]. Shape (rows, 3, degree + 1)."""
        values = self.values[rows]
        if self.basis == "power":
            return from_power(values, self.durations[rows][:, None])
        mid, rad = values.copy(), np.zeros_like(values)
        degrees = self.degrees[rows]
        for degree in np.unique(degrees):
            if degree < self.degree:
                own = np.flatnonzero(degrees == degree)
                low = raised(Balls(values[own][..., : degree + 1], np.zeros((len(own), 3, degree + 1))), self.degree)
                mid[own], rad[own] = low.mid, low.rad
        return Balls(mid, rad)

    def derivative(self, rows: Indices, order: int) -> Balls:
        """Return a time derivative of x, y and z on pieces, in m/s**order. Shape (rows, 3, degree + 1 - order, at least 1)."""
        found = self.positions(rows)
        length, error = self.lengths(rows)
        inverse = 1.0 / length
        off = (error / (length * (length - error)) + 2.0**-52 * inverse) * (1 + 2.0**-40)
        for _ in range(order):
            if found.degree == 0:
                return Balls(np.zeros_like(found.mid), np.zeros_like(found.mid))
            steps = found[..., 1:] - found[..., :-1]
            found = steps.scaled(float(found.degree)).scaled(inverse[:, None, None], off[:, None, None])
        return found

    def exactly(self, row: int) -> list[fmpq_poly]:
        """Return x, y and z on a piece as exact polynomials in u, from 0 to 1."""
        values = self.values[row]
        if self.basis == "power":
            scale = fmpq_poly([0, rational(self.stop(row) - self.start(row))])
            return [fmpq_poly([rational(float(c)) for c in axis])(scale) for axis in values]
        degree = int(self.degrees[row])
        return [_from_bernstein([rational(float(c)) for c in axis[: degree + 1]]) for axis in values]

    def along(self, drones: Indices, times: Floats) -> Floats:
        """Return where drones are at times, up to rounding: for pictures, and nothing is proved by it.

        Args:
            drones: Indices. Shape (k,).
            times: In s, one for each. Shape (k,).

        Returns:
            x, y and z in m. Shape (k, 3).
        """
        rows = np.empty(len(drones), dtype=np.intp)
        for drone in np.unique(drones).tolist():
            own = np.flatnonzero(drones == drone)
            first, last = int(self.first[drone]), int(self.first[drone + 1])
            starts = self.knots[first + drone : last + drone, 0]
            rows[own] = first + np.clip(np.searchsorted(starts, times[own], side="right") - 1, 0, last - first - 1)
        begin = self.knots[self.knot[rows], 0]
        place = np.clip((times - begin) / self.lengths(rows)[0], 0.0, 1.0)[:, None, None]
        control = self.positions(rows).mid
        while control.shape[-1] > 1:
            control = control[..., :-1] + place * (control[..., 1:] - control[..., :-1])
        return control[..., 0]

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the numbers that are checked, in hexadecimal."""
        hasher = hashlib.sha256(f"fleet-1 {self.basis} {self.degree} {' '.join(map(repr, self.names))}".encode())
        for array in (self.first.astype("<i8"), self.knots.astype("<f8"), self.degrees, self.values.astype("<f8")):
            hasher.update(np.ascontiguousarray(array).data)
        if self.yaws or self.columns:
            hasher.update(
                repr([(drone, yaw.tolist()) for drone, yaw in self.yaws.items()]).encode() + repr(self.columns).encode()
            )
        return hasher.hexdigest()


def length_between(start: Floats, stop: Floats) -> tuple[Floats, Floats]:
    """Return how much later times are than others, and a bound on that number's error.

    Args:
        start: Sums of two floats, in s. Shape (..., 2).
        stop: The same.
    """
    large, small = stop[..., 0] - start[..., 0], stop[..., 1] - start[..., 1]
    total = large + small
    return total, (np.abs(large) + np.abs(small) + np.abs(total)) * 2.0**-52


def is_before(one: Floats, other: Floats) -> NDArray[np.bool_]:
    """Return which times are before others, exactly.

    Args:
        one: Sums of two floats. Shape (k, 2).
        other: The same.
    """
    return (one[:, 0] < other[:, 0]) | ((one[:, 0] == other[:, 0]) & (one[:, 1] < other[:, 1]))


def two_floats(times: Sequence[Fraction], what: str) -> Floats:
    """Return exact times as sums of two floats. Shape (times, 2).

    Args:
        times: In s.
        what: Names the flight in messages.

    Raises:
        BadInput: A time has more digits than two floats hold.
    """
    result = np.empty((len(times), 2))
    for row, time in zip(result, times, strict=True):
        row[0] = float(time)
        row[1] = float(time - Fraction(float(row[0])))
        if Fraction(float(row[0])) + Fraction(float(row[1])) != time:
            raise BadInput(
                f"{what}: the durations up to {float(time):g} s are too unlike to be added: no clock has so many digits."
            )
    return result


def assemble(source: str, basis: Basis, flights: Sequence[Flight]) -> Fleet:
    """Put drones' flights together, each at rest before it begins and after its end.

    Args:
        source: Names the files in messages.
        basis: What the flights' values are coefficients of.
        flights: At least one, of different names.

    Raises:
        BadInput: There is none or there are too many, two share a name or a pad, a number is not finite or no flight's, or times do not rise.
    """
    if not flights:
        raise BadInput(f"{source} holds no drones; an audit needs at least one.")
    if len(flights) > MOST_DRONES:
        raise BadInput(f"{source} holds {len(flights)} drones; at most {MOST_DRONES} are checked at once.")
    names = [flight.name for flight in flights]
    if len(set(names)) < len(names):
        twice = next(name for i, name in enumerate(names) if name in names[:i])
        raise BadInput(f"{source}: two drones are named '{twice}'; each needs a name of its own.")
    for flight in flights:
        _check(source, flight)
    for place, points in (
        ("begin at", [flight.values[0, :, 0] for flight in flights]),
        ("end at", [_last_point(flight, basis) for flight in flights]),
    ):
        _require_pads(source, names, place, np.array(points))
    degree = max(flight.values.shape[-1] - 1 for flight in flights)
    end = max((tuple(flight.knots[-1].tolist()) for flight in flights), key=lambda t: Fraction(t[0]) + Fraction(t[1]))
    rows = [_rows(flight, basis, degree, np.array(end)) for flight in flights]
    first = np.concatenate([[0], np.cumsum([len(values) for _, values, _, _ in rows])])
    return Fleet(
        source=source, basis=basis, names=tuple(names), first=first.astype(np.intp),
        knots=np.concatenate([knots for knots, _, _, _ in rows]), values=np.concatenate([values for _, values, _, _ in rows]),
        degrees=np.concatenate([degrees for _, _, degrees, _ in rows]), homes=tuple(flight.homes for flight in flights),
        durations=np.concatenate([durations for *_, durations in rows]),
        rests=tuple((bool(flight.knots[0].any()), not np.array_equal(flight.knots[-1], np.array(end))) for flight in flights),
        yaws=MappingProxyType({drone: flight.yaw for drone, flight in enumerate(flights) if flight.yaw is not None}),
    )  # fmt: skip


def _check(source: str, flight: Flight) -> None:
    where = f"{source}: {flight.name}"
    for array, what in ((flight.knots, "time"), (flight.values, "position")):
        if not np.isfinite(array).all():
            raise BadInput(
                f"{where}: a {what} is not a finite number (at piece {int(np.argwhere(~np.isfinite(array))[0][0])})."
            )
    if flight.knots[0, 0] < 0:
        raise BadInput(f"{where} begins at {flight.knots[0, 0]:g} s; times count from 0.")
    if not len(flight.values):
        return
    short, _ = length_between(flight.knots[:-1], flight.knots[1:])
    if (short < SHORTEST).any():
        piece = int(np.argmax(short < SHORTEST))
        then, now = flight.knots[piece, 0], flight.knots[piece + 1, 0]
        raise BadInput(
            f"{where}: piece {piece} leads from {then:.6g} s to {now:.6g} s; times must rise, by {SHORTEST:g} s at the least."
        )
    if flight.knots[-1, 0] > LARGEST:
        raise BadInput(f"{where} ends at {flight.knots[-1, 0]:g} s; a flight ends before {LARGEST:g} s.")


def _require_pads(source: str, names: Sequence[str], what: str, points: Floats) -> None:
    """Reject two drones that stand on one pad."""
    for one, other in sorted(KDTree(points).query_pairs(PAD)):
        at = ", ".join(f"{value:.4g}" for value in points[one])
        raise BadInput(f"{source}: {names[one]} and {names[other]} both {what} ({at}); each drone needs a pad of its own.")


def _rows(flight: Flight, basis: Basis, degree: int, end: Floats) -> tuple[Floats, Floats, NDArray[np.int8], Floats]:
    """Return knots, values, degrees and durations of one drone from 0 to the end of all."""
    values = np.zeros((len(flight.values), 3, degree + 1))
    values[..., : flight.values.shape[-1]] = flight.values
    knots, degrees = flight.knots, flight.degrees
    durations = np.ones(len(values)) if flight.durations is None else flight.durations
    first, last = values[:1, :, 0], _last_point(flight, basis)[None]
    if knots[0].any():
        knots, durations = np.concatenate([[[0.0, 0.0]], knots]), np.concatenate([[1.0], durations])
        values, degrees = np.concatenate([_rest(first, basis, degree), values]), np.concatenate([[np.int8(degree)], degrees])
    if not np.array_equal(knots[-1], end):
        knots, durations = np.concatenate([knots, [end]]), np.concatenate([durations, [1.0]])
        values, degrees = np.concatenate([values, _rest(last, basis, degree)]), np.concatenate([degrees, [np.int8(degree)]])
    return knots, values, degrees.astype(np.int8), durations


def _rest(point: Floats, basis: Basis, degree: int) -> Floats:
    if basis == "bernstein":
        return np.repeat(point[..., None], degree + 1, -1)
    return np.concatenate([point[..., None], np.zeros((1, 3, degree))], -1)


def _last_point(flight: Flight, basis: Basis) -> Floats:
    """Return where a flight ends: of powers the floats nearest to it, and what is lost by that counts as a jump. Shape (3,)."""
    if basis == "bernstein":
        return flight.values[-1, :, flight.degrees[-1]]
    length = sum(map(Fraction, flight.knots[-1].tolist())) - sum(map(Fraction, flight.knots[-2].tolist()))
    return np.array([float(sum(Fraction(c) * length**k for k, c in enumerate(axis))) for axis in flight.values[-1].tolist()])


def _from_bernstein(coefficients: list[fmpq]) -> fmpq_poly:
    """Return the polynomial on [0, 1] with these Bernstein coefficients, by de Casteljau's rule on polynomials."""
    one_less, same = fmpq_poly([1, -1]), fmpq_poly([0, 1])
    row = [fmpq_poly([c]) for c in coefficients]
    while len(row) > 1:
        row = [a * one_less + b * same for a, b in pairwise(row)]
    return row[0]
