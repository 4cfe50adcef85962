"""Sorting of polynomials: those that are within their thresholds throughout, beyond them, or between; others are halved.

Balls are rounded outwards, so that what is sorted is proved; what is not sorted after so many halvings is left open.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from verify.arithmetic.balls import Balls, Floats, halves, nearest
from verify.arithmetic.bounds import Indices
from verify.data.shapes.conditions import Condition
from verify.motion.membership.bodies import Mark

MAX_OPEN = 64
"""A piece with more open parts than this (it runs along a boundary) is left to exact arithmetic, or to *may*."""

Leaf = tuple[float, float, Mark | None]
"""From one place of a segment to another, with its status; None where nothing could be proved."""

CODES: tuple[Mark | None, ...] = ("no", "may", "must", None)
"""Statuses by the numbers that they have in arrays."""


@dataclass(frozen=True, eq=False, slots=True)
class Thresholds:
    """Of one inequality, between which floats lie its greatest value where the ball is inside, and where it is not outside.

    Attributes:
        inside: The floats beside the first.
        outside: Those beside the second.
    """

    inside: tuple[float, float]
    outside: tuple[float, float]

    @classmethod
    def of(cls, one: Condition, margin: Fraction) -> Thresholds:
        """Return the thresholds of an inequality.

        Args:
            one: The inequality.
            margin: The ball's radius, m, exact.
        """
        within, beyond = one.bounds(margin)
        return cls((-np.inf, -np.inf) if within is None else _bracket(within), _bracket(beyond))


def classified(table: Balls, inside: Floats, outside: Floats, depth: int) -> list[list[Leaf]]:
    """Sort polynomials into no, may and must, halving those that are not one of them throughout.

    Args:
        table: The polynomials. Shape (rows, degree + 1).
        inside: For each row the floats beside its threshold. Shape (rows, 2).
        outside: Likewise. Shape (rows, 2).
        depth: How often a part is halved at the most.

    Returns:
        For each row its leaves in order, neighbours with one status joined.
    """
    count = len(table.mid)
    if count == 0:
        return []
    rows, starts, width = np.arange(count), np.zeros(count), 1.0
    state = table
    leaves: list[tuple[Indices, Floats, Floats, Indices]] = []
    for level in range(depth + 1):
        low, high = state.low.min(-1), state.high.max(-1)
        no = low > outside[rows, 1]
        must = high <= inside[rows, 0]
        may = (low > inside[rows, 1]) & (high <= outside[rows, 0])
        done = no | must | may
        crowded = np.bincount(rows[~done], minlength=count)[rows] > MAX_OPEN
        ended = done | crowded if level < depth else np.ones_like(done)
        code = np.select([no, must, may], [0, 2, 1], 3)[ended]
        leaves.append((rows[ended], starts[ended], starts[ended] + width, code))
        keep = np.flatnonzero(~ended)
        if len(keep) == 0:
            break
        state = halves(state[keep])
        width /= 2
        rows = np.concatenate([rows[keep], rows[keep]])
        starts = np.concatenate([starts[keep], starts[keep] + width])
    row, start, stop, code = (np.concatenate([part[i] for part in leaves]) for i in range(4))
    order = np.lexsort((start, row))
    row, start, stop, code = row[order], start[order], stop[order], code[order]
    first = np.flatnonzero(np.concatenate([[True], (row[1:] != row[:-1]) | (code[1:] != code[:-1])]))
    last = np.append(first[1:], len(row)) - 1
    result: list[list[Leaf]] = [[] for _ in range(count)]
    columns = (row[first].tolist(), start[first].tolist(), stop[last].tolist(), code[first].tolist())
    for where, begin, end, kind in zip(*columns, strict=True):
        result[where].append((begin, end, CODES[kind]))
    return result


def _bracket(value: Fraction) -> tuple[float, float]:
    number, error = nearest(value)
    if error == 0.0:
        return number, number
    return float(np.nextafter(number, -np.inf)), float(np.nextafter(number, np.inf))
