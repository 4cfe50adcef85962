"""Ways made shorter and, where there is room, led wider around corners.

A shortest way on a roadmap turns at points that were chosen beforehand. Each is slid along its edge to where the way is shortest, left out
where it is not needed, and moved away from its body as far as there is room, up to half of a gap.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_SWEEPS = 3
_GAIN = 1e-4
"""m; a point is moved or left out only where the way becomes shorter by so much."""
_STEPS = 6
"""Distances from a corner that are tried."""


@dataclass(frozen=True, eq=False, slots=True)
class Turn:
    """A point at which a way turns.

    Attributes:
        point: m. Shape (3,).
        outward: Unit vector away from the body. Shape (3,).
        start: One end of the line on which it may be moved, m. Shape (3,).
        end: The other end, m. Shape (3,).
    """

    point: Floats
    outward: Floats
    start: Floats
    end: Floats


def straightened(start: Floats, turns: list[Turn], end: Floats, clear: Callable[[Floats], bool], room: float) -> Floats:
    """Return a shorter way between two points with room at its corners.

    Args:
        start: m. Shape (3,).
        turns: Where it turns, in order.
        end: m. Shape (3,).
        clear: Tells whether the lines from point to point are free. Takes m, shape (points, 3).
        room: m by which corners are passed more widely, where there is so much room.

    Returns:
        m. Shape (points, 3).
    """
    places = [start, *(turn.point for turn in turns), end]
    kept: list[Turn | None] = [None, *turns, None]
    for _ in range(_SWEEPS):
        _leave_out(places, kept, clear)
        if not _slide(places, kept, clear):
            break
    _leave_out(places, kept, clear)
    for k in range(1, len(places) - 1):
        turn = kept[k]
        assert turn is not None
        places[k] = _widened(places, k, turn, clear, room)
    return np.array(places)


def _leave_out(places: list[Floats], kept: list[Turn | None], clear: Callable[[Floats], bool]) -> None:
    k = 1
    while k < len(places) - 1:
        if clear(np.stack([places[k - 1], places[k + 1]])):
            del places[k], kept[k]
        else:
            k += 1


def _slide(places: list[Floats], kept: list[Turn | None], clear: Callable[[Floats], bool]) -> bool:
    """Move each point along its line to where the way is shortest; tell whether any was moved."""
    moved = False
    for k in range(1, len(places) - 1):
        turn = kept[k]
        assert turn is not None
        before, after = places[k - 1], places[k + 1]
        best = _nearest_on(turn, before, after)
        gain = _length(before, places[k], after) - _length(before, best, after)
        if gain > _GAIN and clear(np.stack([before, best, after])):
            places[k], moved = best, True
    return moved


def _nearest_on(turn: Turn, before: Floats, after: Floats) -> Floats:
    """Return the point of a line by which the way between two points is shortest: where it is straight once unfolded."""
    step = turn.end - turn.start
    square = float(step @ step)
    if square < 1e-12:
        return turn.point
    one, other = float((before - turn.start) @ step) / square, float((after - turn.start) @ step) / square
    away = float(np.linalg.norm(before - turn.start - one * step))
    beyond = float(np.linalg.norm(after - turn.start - other * step))
    share = one if away + beyond < 1e-12 else one + (other - one) * away / (away + beyond)
    return turn.start + min(max(share, 0.0), 1.0) * step


def _widened(places: list[Floats], k: int, turn: Turn, clear: Callable[[Floats], bool], room: float) -> Floats:
    """Return a corner moved away from its body: by `room`, or to the middle of a gap that is narrower than twice that."""
    farthest = 0.0
    for step in np.linspace(0.0, 2.0 * room, _STEPS + 1)[1:]:
        if not clear(np.stack([places[k - 1], places[k] + step * turn.outward, places[k + 1]])):
            break
        farthest = float(step)
    return places[k] + min(room, farthest / 2.0) * turn.outward


def _length(*places: Floats) -> float:
    return float(np.linalg.norm(np.diff(np.stack(places), axis=0), axis=1).sum())
