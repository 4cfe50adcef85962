"""Extremes of each drone by itself, for all times: speed, acceleration, distance to the walls and to the ground.

A bound that lies on the wrong side of its limit only by rounding is decided on the exact polynomials, piece by piece.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

import numpy as np
from flint import fmpq_poly

from verify.arithmetic import exact
from verify.arithmetic.balls import Balls, Floats, dot, root_up
from verify.arithmetic.bounds import peaks
from verify.claims.claim import Outcome
from verify.third_party.fleet import Fleet, Indices

BLOCK = 32_768
"""Pieces that are looked at at once, about; whole drones, which bounds the memory."""

_SHARE = 1e-6
"""How near to the true extreme a bound is driven, as a share of the limit's size; nearer where that decides."""


Direction = Literal["all", "level", "up", "down"]


@dataclass(frozen=True, slots=True)
class Extreme:
    """The extreme of one quantity over one drone's flight.

    Attributes:
        drone: Index.
        what: Names the quantity, or the wall.
        limit: What must not be passed.
        bound: Proved for all times, on the strict side.
        reached: Reached up to rounding, at `time`.
        time: When, in s.
        outcome: Whether the limit is proved to be kept, or broken; nothing is left undecided.
    """

    drone: int
    what: str
    limit: float
    bound: float
    reached: float
    time: float
    outcome: Outcome


@dataclass(frozen=True, eq=False, slots=True)
class Rate:
    """A limit of speed or acceleration.

    Attributes:
        name: Of the claim.
        what: Names the quantity.
        order: How often positions are derived: 1 for speed, 2 for acceleration.
        direction: Which part of it is limited.
        limits: Of each drone, in m/s or m/s^2. Shape (drones,).
    """

    name: str
    what: str
    order: Literal[1, 2]
    direction: Direction
    limits: Floats

    @property
    def unit(self) -> str:
        """Of the limits."""
        return "m/s" if self.order == 1 else "m/s^2"


@np.errstate(all="ignore")
def rate_extremes(fleet: Fleet, rate: Rate) -> list[Extreme]:
    """Bound the greatest value of a speed or acceleration of each drone.

    Args:
        fleet: The drones.
        rate: What is limited, and by how much.
    """
    if rate.direction in ("up", "down"):
        return _vertical_extremes(fleet, rate)
    limits, axes = rate.limits, 2 if rate.direction == "level" else 3

    def squares(rows: Indices) -> Balls:
        found = fleet.derivative(rows, rate.order)[:, :axes]
        return dot(found, found)

    def left(row: int, limit: Fraction) -> fmpq_poly:
        rates, length = _derived(fleet, row, rate.order)
        return fmpq_poly([exact.rational((limit * length) ** 2)]) - sum(r * r for r in rates[:axes])

    found = _greatest(fleet, squares, limits**2, left, [Fraction(v) for v in limits.tolist()])
    return [
        Extreme(
            drone, rate.what, limit, min(root_up(upper), limit) if holds else root_up(upper), root_up(lower), time, _said(holds),
        )
        for drone, (limit, (upper, lower, time, holds)) in enumerate(zip(limits.tolist(), found, strict=True))
    ]  # fmt: skip


def _vertical_extremes(fleet: Fleet, rate: Rate) -> list[Extreme]:
    sign = 1 if rate.direction == "up" else -1

    def along(rows: Indices) -> Balls:
        found = fleet.derivative(rows, rate.order)[:, 2]
        return found if sign > 0 else -found

    def left(row: int, limit: Fraction) -> fmpq_poly:
        rates, length = _derived(fleet, row, rate.order)
        return fmpq_poly([exact.rational(limit * length)]) - sign * rates[2]

    limits = [Fraction(value) for value in rate.limits.tolist()]
    found = _greatest(fleet, along, rate.limits, left, limits, exact_limits=True)
    return [
        Extreme(drone, rate.what, limit, min(upper, limit) if holds else upper, lower, time, _said(holds))
        for drone, (limit, (upper, lower, time, holds)) in enumerate(zip(rate.limits.tolist(), found, strict=True))
    ]


def _derived(fleet: Fleet, row: int, order: int) -> tuple[list[fmpq_poly], Fraction]:
    """Return derivatives of x, y and z by the place in a piece, exact, and what they must be divided by to be by time."""
    rates = fleet.exactly(row)
    for _ in range(order):
        rates = [rate.derivative() for rate in rates]
    return rates, (fleet.stop(row) - fleet.start(row)) ** order


@np.errstate(all="ignore")
def wall_extremes(fleet: Fleet, axis: int, side: str, wall: Fraction) -> list[Extreme]:
    """Bound how near each drone comes to a wall from within (negative: outside).

    Args:
        fleet: The drones.
        axis: 0, 1 or 2, to which the wall is normal.
        side: "min" or "max".
        wall: Where it is, in m, exact.
    """
    sign = 1.0 if side == "max" else -1.0
    limits = np.full(len(fleet), sign * float(wall))

    def along(rows: Indices) -> Balls:
        part = fleet.positions(rows)[:, axis]
        return part if sign > 0 else -part

    def left(row: int, _: Fraction) -> fmpq_poly:
        position = fleet.exactly(row)[axis]
        return fmpq_poly([exact.rational(wall)]) - position if sign > 0 else position - exact.rational(wall)

    found = _greatest(fleet, along, limits, left, [wall] * len(fleet), exact_limits=wall == Fraction(float(wall)))
    return [
        Extreme(drone, f"{'xyz'[axis]} {side}", float(wall), sign * upper, sign * lower, time, _said(holds))
        for drone, (upper, lower, time, holds) in enumerate(found)
    ]


def _greatest(
    fleet: Fleet,
    values: Callable[[Indices], Balls],
    critical: Floats,
    left: Callable[[int, Fraction], fmpq_poly],
    limits: list[Fraction],
    *,
    exact_limits: bool = False,
) -> list[tuple[float, float, float, bool]]:
    """Return for each drone bounds on its greatest value from above and below, when that is, and whether it is within the limit.

    Floats decide where the bounds lie on one side of the limit with room for its own rounding; the rest is decided by `left`, which is not
    negative on a piece that keeps the limit.
    """
    result: list[tuple[float, float, float, bool]] = []
    for low, high in _blocks(fleet):
        rows = np.arange(fleet.first[low], fleet.first[high])
        table, groups = values(rows), fleet.owner[rows] - low
        asked = critical[low:high]
        slack = np.maximum(_SHARE * np.abs(asked), _SHARE)
        found = peaks(table, groups, high - low, slack=slack, critical=asked)
        room = np.zeros(high - low) if exact_limits else np.abs(asked) * 2.0**-50
        for drone in range(low, high):
            index = drone - low
            upper, lower = float(found.upper[index]), float(found.lower[index])
            piece = int(found.item[index])
            holds = upper <= asked[index] - room[index]
            if not holds and not lower > asked[index] + room[index]:
                doubtful = rows[(groups == index) & ~(table.high.max(-1) <= asked[index] - room[index])]
                broken = next((r for r in doubtful.tolist() if not exact.nonnegative(left(r, limits[drone]))), None)
                holds = broken is None
                piece = piece if broken is None else int(broken - rows[0])
                upper = min(upper, float(asked[index])) if holds else upper
            result.append((upper, lower, fleet.at(int(rows[piece]), float(found.place[index])), bool(holds)))
    return result


def _blocks(fleet: Fleet) -> list[tuple[int, int]]:
    """Return runs of whole drones of about `BLOCK` pieces."""
    runs: list[tuple[int, int]] = []
    low = 0
    while low < len(fleet):
        high = int(np.searchsorted(fleet.first, fleet.first[low] + BLOCK, side="right")) - 1
        high = min(max(high, low + 1), len(fleet))
        runs.append((low, high))
        low = high
    return runs


def _said(holds: bool) -> Outcome:
    return "holds" if holds else "fails"
