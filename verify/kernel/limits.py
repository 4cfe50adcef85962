"""Limits of a robot's nominal flight that are polynomials: speed, acceleration, thrust, tilt and the rates of roll and pitch.

With f = r'' + g e3 the thrust is m |f| and the body's z axis f / |f|; roll and pitch turn it at |r''' x f| / |f|^2. All are asked
squared, and multiplied out, so that nothing is divided.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from .bodies import ZERO
from .bounds import Interval, cosine_and_sine
from .flights import Path, Piece
from .polynomials import Bernstein, square
from .trees import Marks, at_least, require

Row = tuple[Bernstein, Fraction]
"""A polynomial, and what it must not be below."""

Window = tuple[Fraction, Fraction]


def motion_row(piece: Piece, name: str, limit: Fraction, part: Window | None = None) -> Row:
    """Return what keeps speed or acceleration within a limit, on a part of a piece's time or all of it.

    Args:
        piece: The piece.
        name: Which of the two.
        limit: m/s or m/s^2.
        part: From when to when, s.
    """
    low, high = part or (ZERO, piece.length)
    squared = square(piece.derivatives[1 if name == "speed" else 2][:3])
    return (-squared.moved(low) if low else -squared).stretched(high - low).bernstein(), -limit * limit


def _rows(path: Path, piece: Piece, name: str) -> list[Row]:
    """Return what keeps a limit on a piece."""
    limits, mass = path.robot.limits, path.robot.mass
    limit: Fraction = getattr(limits, name)
    if name in ("speed", "acceleration"):
        return [motion_row(piece, name, limit)]
    f, size = piece.force, piece.size
    thrust = size.times(mass * mass)
    enough = piece.bernstein(thrust), limits.thrust_min**2  # so that f has a direction
    if name == "thrust_max":
        return [(piece.bernstein(-thrust), -limit * limit)]
    if name == "thrust_min":
        return [enough]
    if name == "tilt":  # below a quarter turn
        cosine = Fraction(max(cosine_and_sine(Interval.of(limit))[0].high, 0), 1 << 64)
        upright = f[2] * f[2] - size.times(cosine * cosine)
        return [enough, (piece.bernstein(f[2]), ZERO), (piece.bernstein(upright), ZERO)]
    j = piece.derivatives[3]
    turning = [j[i] * f[k] - j[k] * f[i] for i, k in ((1, 2), (2, 0), (0, 1))]
    return [enough, (piece.bernstein((size * size).times(limit * limit) - square(turning)), ZERO)]


def check_limit(path: Path, name: str, marks: Marks) -> None:
    """Check one limit for all times.

    Args:
        path: Of whom.
        name: Which limit.
        marks: Evidence.

    Raises:
        Refused: It is not proved to be kept.
    """
    for piece in path.pieces:
        require(at_least(_rows(path, piece, name)), marks, f"it keeps its limit of {name}")


def check_motion(path: Path, name: str, limit: Fraction, marks: Marks, times: Sequence[Window] | None = None) -> None:
    """Check speed or acceleration for all times, or for some.

    Args:
        path: Of whom.
        name: Which of the two.
        limit: m/s or m/s^2.
        marks: Evidence.
        times: From when to when, s.

    Raises:
        Refused: They are not proved to keep the limit.
    """
    for piece, start, stop in zip(path.pieces, path.knots, path.knots[1:], strict=False):
        for low, high in times if times is not None else [(start, stop)]:
            if low < stop and start < high:
                part = max(low, start) - start, min(high, stop) - start
                require(at_least([motion_row(piece, name, limit, part)]), marks, f"it keeps its {name}")
