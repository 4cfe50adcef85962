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


Free = Callable[[Floats, Floats], NDArray[np.bool_]]
"""Tells of straight lines, given by both ends in m, shapes (n, 3), which enter nothing that stops them. Shape (n,)."""


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


def straightened(start: Floats, turns: list[Turn], end: Floats, free: Free, room: float) -> Floats:
    """Return a shorter way between two points with room at its corners.

    Args:
        start: m. Shape (3,).
        turns: Where it turns, in order.
        end: m. Shape (3,).
        free: Tells which straight lines are free, many at a time.
        room: m by which corners are passed more widely, where there is so much room.

    Returns:
        m. Shape (points, 3).
    """
    way = _Way([start, *(turn.point for turn in turns), end], [None, *turns, None], free)
    for _ in range(_SWEEPS):
        way.leave_out()
        if not way.slide():
            break
    way.leave_out()
    if room > 0:
        way.widen(room)
    return np.array(way.places)


class _Way:
    """A way while it is straightened; every other point at a time, so that those between stay where they are."""

    def __init__(self, places: list[Floats], turns: list[Turn | None], free: Free) -> None:
        self.places, self.turns, self.free = places, turns, free

    def leave_out(self) -> None:
        """Leave out points whose neighbours see each other."""
        while len(self.places) > 2:
            places = np.array(self.places)
            needless = np.flatnonzero(self.free(places[:-2], places[2:])) + 1
            gone = [int(k) for i, k in enumerate(needless) if i == 0 or k - needless[i - 1] > 1 or (k - needless[0]) % 2 == 0]
            gone = [k for i, k in enumerate(gone) if i == 0 or k - gone[i - 1] > 1]
            if not gone:
                return
            for k in reversed(gone):
                del self.places[k], self.turns[k]

    def slide(self) -> bool:
        """Move each point along its line to where the way is shortest; tell whether any was moved."""
        moved = False
        for own in self._halves():
            before, after, old = self._around(own)
            new = np.array([_nearest_on(self._turn(k), self.places[k - 1], self.places[k + 1]) for k in own])
            gains = _lengths(before, old, after) - _lengths(before, new, after) > _GAIN
            taken = gains & self.free(before, new) & self.free(new, after)
            for k in np.flatnonzero(taken).tolist():
                self.places[own[k]], moved = new[k], True
        return moved

    def widen(self, room: float) -> None:
        """Move corners away from their bodies: by `room`, or to the middle of a gap that is narrower than twice that."""
        steps = np.linspace(0.0, 2.0 * room, _STEPS + 1)[1:]
        for own in self._halves():
            before, after, old = (np.repeat(part, _STEPS, axis=0) for part in self._around(own))
            outward = np.repeat(np.array([self._turn(k).outward for k in own]), _STEPS, axis=0)
            tried = old + np.tile(steps, len(own))[:, None] * outward
            free = (self.free(before, tried) & self.free(tried, after)).reshape(len(own), _STEPS)
            farthest = np.where(free.all(axis=1), _STEPS, free.argmin(axis=1))
            for k, count in zip(own, farthest.tolist(), strict=True):
                far = float(steps[count - 1]) if count else 0.0
                self.places[k] = self.places[k] + min(room, far / 2.0) * self._turn(k).outward

    def _halves(self) -> list[list[int]]:
        inner = range(1, len(self.places) - 1)
        return [list(inner[parity::2]) for parity in (0, 1) if len(inner) > parity]

    def _around(self, own: list[int]) -> tuple[Floats, Floats, Floats]:
        before, after = [self.places[k - 1] for k in own], [self.places[k + 1] for k in own]
        return np.array(before), np.array(after), np.array([self.places[k] for k in own])

    def _turn(self, k: int) -> Turn:
        turn = self.turns[k]
        assert turn is not None
        return turn


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


def _lengths(before: Floats, at: Floats, after: Floats) -> Floats:
    return np.linalg.norm(at - before, axis=1) + np.linalg.norm(after - at, axis=1)
