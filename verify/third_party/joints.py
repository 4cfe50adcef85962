"""Joints of pieces: jumps of positions and velocities, and the begin of a flight beside that in its file."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.exact import fraction
from verify.third_party.fleet import Fleet

BLOCK = 65_536
"""Pieces that are looked at at once, which bounds the memory."""


@dataclass(frozen=True, eq=False, slots=True)
class Joints:
    """The greatest jump of each drone.

    Attributes:
        jumps: Upper bound, in m (order 0) or m/s (order 1); exactly 0 where there is none. Shape (drones,).
        sure: Proved to be at least this. Shape (drones,).
        times: When, in s. Shape (drones,).
    """

    jumps: Floats
    sure: Floats
    times: Floats


@np.errstate(all="ignore")
def jumps(fleet: Fleet, order: int) -> Joints:
    """Bound each drone's greatest jump between its pieces.

    Args:
        fleet: The drones.
        order: 0 for positions, 1 for velocities; before the start and after the end a drone rests.
    """
    count = len(fleet)
    found = Joints(np.zeros(count), np.zeros(count), np.zeros(count))
    rows = len(fleet.values)
    for low in range(0, rows, BLOCK):
        part = np.arange(low, min(low + BLOCK + 1, rows))  # the last one of a block is the next one's first
        table = fleet.positions(part) if order == 0 else fleet.derivative(part, order)
        ends, starts = table[:-1, :, -1:], table[1:, :, :1]
        _raise(fleet, found, part[1:], _size((starts - ends).low[..., 0], (starts - ends).high[..., 0]), within=True)
        if order:
            for edge, place in ((fleet.first[:-1], 0), (fleet.first[1:] - 1, -1)):
                own = edge[(edge >= low) & (edge <= part[-1])]
                rest = table[own - low][..., place]
                _raise(fleet, found, own, _size(rest.low, rest.high), within=False, after=place)
    if order == 0:
        _exactly(fleet, found)
    return found


def home_jumps(fleet: Fleet) -> Iterator[tuple[int, str, int, float]]:
    """Yield how far drones' paths begin or end from where they must stand: index, what says so, at which end (0 or 1), and m."""
    for drone, homes in enumerate(fleet.homes):
        for what, end, place in homes:
            points = fleet.exactly(int(fleet.first[drone + end]) - end)
            square = sum((fraction(p(end)) - Fraction(at)) ** 2 for p, at in zip(points, place, strict=True))
            yield drone, what, end, math.sqrt(square)


def _raise(
    fleet: Fleet, found: Joints, rows: np.ndarray, sizes: tuple[Floats, Floats], *, within: bool, after: int = 0
) -> None:
    """Take over the greatest jumps before (or after) pieces, whose sizes are known as from `_size`, each for its drone."""
    upper, lower = sizes
    owner = fleet.owner[rows]
    kept = fleet.owner[rows - 1] == owner if within else np.ones(len(rows), dtype=bool)
    times = fleet.knots[fleet.knot[rows] - after, 0]
    owner, upper, lower, times = owner[kept], upper[kept], lower[kept], times[kept]
    order = np.argsort(upper, kind="stable")  # the greatest of each drone is written last
    owner, upper, lower, times = owner[order], upper[order], lower[order], times[order]
    last = np.zeros(len(found.jumps))
    last[owner] = upper
    better = last > found.jumps
    when, least = np.zeros_like(last), np.zeros_like(last)
    when[owner], least[owner] = times, lower
    found.jumps[better], found.sure[better], found.times[better] = last[better], least[better], when[better]


def _size(low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Return bounds on the lengths of vectors whose coordinates are known between bounds. Shape (k, 3) to (k,)."""
    most, least = np.maximum(np.abs(low), np.abs(high)), np.maximum(np.maximum(low, -high), 0.0)
    upper = np.sqrt((most * most).sum(-1)) * (1 + 2.0**-40)
    return np.where(np.isnan(upper), np.inf, upper), np.sqrt((least * least).sum(-1)) * (1 - 2.0**-40)


def _exactly(fleet: Fleet, found: Joints) -> None:
    """Set to exactly 0 what joins exactly: curves do by construction, of others it is asked."""
    if fleet.basis == "bernstein":
        starts, ends = fleet.values[..., 0], fleet.values[np.arange(len(fleet.values)), :, fleet.degrees]
        apart = (ends[:-1] != starts[1:]).any(-1) & (fleet.owner[:-1] == fleet.owner[1:])
        joined = np.ones(len(fleet), dtype=bool)
        joined[fleet.owner[:-1][apart]] = False
    else:
        joined = np.array([_joined(fleet, drone) for drone in range(len(fleet))])
    found.jumps[joined] = found.sure[joined] = 0.0


def _joined(fleet: Fleet, drone: int) -> bool:
    rows = range(int(fleet.first[drone]), int(fleet.first[drone + 1]))
    pieces = [fleet.exactly(row) for row in rows]
    return all(a(1) == b(0) for one, then in pairwise(pieces) for a, b in zip(one, then, strict=True))
