"""Times at which one robot's nominal path stands still, exactly, read off its coefficients.

A path stands still where x, y and z are constant over a piece, and for an instant where a piece begins with velocity, acceleration and
jerk of exactly zero. Turning in place moves nothing: heading is left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np

from verify.data.trajectory import Trajectory


@dataclass(frozen=True, slots=True)
class Standstill:
    """A time during which a nominal path is at one point.

    Attributes:
        start: Exact, in s.
        stop: Exact, in s; equal to `start` where the path rests for an instant.
    """

    start: Fraction
    stop: Fraction


def first_motion(trajectory: Trajectory, knots: Sequence[Fraction], since: int = 0) -> Fraction | None:
    """Return the first instant at which a path differs from where a piece begins in x, y or z, in s; None where it never does.

    A polynomial that is not constant leaves its value at once, so that this is the beginning of a piece.

    Args:
        trajectory: What is flown.
        knots: Exact start of each piece, in s.
        since: The piece from which on it is looked at.
    """
    places = trajectory.coefficients[since:, :3]
    moves = places[:, :, 1:].any(axis=(1, 2)) | (places[:, :, 0] != places[0, :, 0]).any(axis=1)
    return knots[since + int(np.argmax(moves))] if moves.any() else None


def standstills(trajectory: Trajectory, knots: Sequence[Fraction]) -> Iterator[Standstill]:
    """Yield when a path stands still, in order; pieces that follow each other at one point come one by one.

    Args:
        trajectory: What is flown.
        knots: Exact start of each piece and end of the last, in s.
    """
    places = trajectory.coefficients[:, :3]
    for piece, (start, stop) in enumerate(pairwise(knots)):
        if not places[piece, :, 1:].any():
            yield Standstill(start, stop)
        elif not places[piece, :, 1:4].any():
            yield Standstill(start, start)
