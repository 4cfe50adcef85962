"""Tilt of the vehicle: the angle between its thrust and the vertical, from 0 to 180 degrees, for all times.

Below 90 degrees the squared tangent, (fx^2 + fy^2) / fz^2 with f = r'' + g e3, says it most sharply. Where fz > 0 is not
proved the angle may be anything: there cos |cos| = fz |fz| / |f|^2 does, which falls from 1 to -1 as the tilt grows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from flint import arb

from verify.arithmetic.balls import Balls, Floats, dot
from verify.arithmetic.bounds import Indices, Peaks, quotient_bounds, search
from verify.arithmetic.intervals import Interval
from verify.motion.paths import TeamPaths

_SHARE = 1e-5
"""How near to the true extreme a bound is driven, as a share of the limit's squared tangent, and of 1 for the cosine."""


def tilt_peaks(paths: TeamPaths, force: Balls, limits: Sequence[float]) -> Peaks:
    """Bound the tilt, robot by robot, in rad.

    Args:
        paths: The team.
        force: f on each piece. Shape (pieces, 3, n + 1).
        limits: Each robot's limit, in rad, below a quarter turn; it sets how tight the bounds are made.
    """
    count = len(paths.robots)
    upward = force[:, 2]
    state = (dot(force[:, :2], force[:, :2]), upward * upward, upward)
    critical = np.array([math.tan(limit) ** 2 for limit in limits])
    steep = search(state, _tangents, paths.piece_owner, count, slack=_SHARE * critical, critical=critical)
    upper = np.array([_from_tangent(value, up=True) for value in steep.upper])
    lower = np.array([_from_tangent(value, up=False) for value in steep.lower])
    item, place = steep.item.copy(), steep.place.copy()
    for robot in np.flatnonzero(~(steep.upper < math.inf)):
        rows = np.flatnonzero(paths.piece_owner == robot)
        over = search(
            (upward[rows], dot(force, force)[rows]), _cosines, np.zeros(len(rows), dtype=np.intp), 1,
            slack=np.array([_SHARE]), critical=np.array([-(math.cos(limits[int(robot)]) ** 2)]),
        )  # fmt: skip
        upper[robot] = _from_cosine(float(over.upper[0]), up=True)
        lower[robot] = _from_cosine(float(over.lower[0]), up=False)
        item[robot], place[robot] = rows[over.item[0]], over.place[0]
    return Peaks(upper, lower, item, place)


def _tangents(state: tuple[Balls, ...], items: Indices) -> tuple[Floats, Floats, Floats]:
    """Bound the squared tangent; it counts as infinite where fz > 0 is not proved."""
    del items
    high, first, last = quotient_bounds(state[0], state[1])
    return np.where(state[2].low.min(-1) > 0, high, np.inf), first, last


def _cosines(state: tuple[Balls, ...], items: Indices) -> tuple[Floats, Floats, Floats]:
    """Bound -cos |cos|, which grows with the tilt; it counts as 1 where |f| > 0 is not proved."""
    del items

    def enclosed(upward: Interval, size: Interval) -> Interval:
        signed = Interval(
            np.nextafter(upward.low * np.abs(upward.low), -np.inf), np.nextafter(upward.high * np.abs(upward.high), np.inf)
        )
        found = -signed / size
        low, high = np.where(found.low > -1.0, found.low, -1.0), np.where(found.high < 1.0, found.high, 1.0)
        return Interval(low, high)

    low, high = (part.low for part in state), (part.high for part in state)
    (up_low, size_low), (up_high, size_high) = low, high
    over = enclosed(Interval(up_low.min(-1), up_high.max(-1)), Interval(size_low.min(-1), size_high.max(-1)))
    first, last = (enclosed(Interval(up_low[:, k], up_high[:, k]), Interval(size_low[:, k], size_high[:, k])) for k in (0, -1))
    return over.high, first.low, last.low


def _from_tangent(value: float, *, up: bool) -> float:
    """Return the angle in rad whose squared tangent is `value`, rounded up or down."""
    if not value < math.inf:
        return math.pi / 2 if not math.isnan(value) else value
    return 0.0 if value <= 0 else _rounded(arb(value).sqrt().atan(), up=up)


def _from_cosine(value: float, *, up: bool) -> float:
    """Return the angle in rad for which -cos |cos| is `value`, rounded up or down."""
    if not -1.0 < value < 1.0:
        return 0.0 if value <= -1.0 else math.nextafter(math.pi, math.inf) if up else math.pi
    if value == 0.0:
        return math.nextafter(math.pi / 2, math.inf) if up else math.pi / 2
    size = abs(arb(value))
    sharp = ((1 - size) / size).sqrt().atan()
    return _rounded(sharp if value < 0 else arb.pi() - sharp, up=up)


def _rounded(angle: arb, *, up: bool) -> float:
    return math.nextafter(float(angle.upper() if up else angle.lower()), math.inf if up else -math.inf)
