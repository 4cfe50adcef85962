"""Uniform stretching in time: the simplest way to keep every limit, and an upper bound on the time that better ones take."""

from __future__ import annotations

import numpy as np

from refine.limits.limits import Limits
from refine.limits.usage import Peak, peaks, worst
from refine.spline.spline import Spline
from verify.data import Infeasible, Witness

SAFETY = 2e-3
"""Share of each limit kept back when only samples are looked at."""

_ROUNDS = 60
_MOST = 1e3
_FINE = 801
_CLOSER = 10


def stretch_to_limits(
    path: Spline, yaw: Spline | None, limits: Limits, *, safety: float = SAFETY, faster: bool = False
) -> float:
    """Return the least factor by which the flight must be slowed for all sampled limits to hold.

    Slower flight keeps the path and moves every thrust towards hovering, so the factor is found by stepping up where a
    limit breaks (a rate falls with the factor, a force with its square) and bisecting.

    Args:
        path: Three axes.
        yaw: One axis; None for constant yaw.
        limits: What must hold.
        safety: Share of each limit kept back.
        faster: Whether a factor below 1 may be returned.

    Raises:
        Infeasible: No factor up to 1000 helps; says which limit is in the way.
    """

    def breaks(factor: float) -> Peak | None:
        slower = path.stretched(factor), None if yaw is None else yaw.stretched(factor)
        peak = worst(peaks(*slower, limits))
        return peak if peak is not None and peak.share > 1.0 - safety else None

    low, high = (1e-2, 1.0) if faster else (1.0, 1.0)
    peak = breaks(high)
    if peak is None and not faster:
        return _between_samples(path, yaw, limits, 1.0, safety)
    while peak is not None:
        low, high = high, high * 1.25
        if high > _MOST:
            raise _cannot(peak)
        peak = breaks(high)
    for _ in range(_ROUNDS):
        if high - low <= 1e-5 * high:
            break
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if breaks(middle) is not None else (low, middle)
    return _between_samples(path, yaw, limits, high, safety)


def _between_samples(path: Spline, yaw: Spline | None, limits: Limits, factor: float, safety: float) -> float:
    """Return the factor, raised a little where samples set much closer see more: extremes can be narrow."""
    for _ in range(_CLOSER):
        peak = worst(peaks(path.stretched(factor), None if yaw is None else yaw.stretched(factor), limits, _FINE))
        if peak is None or peak.share <= 1.0 - safety:
            break
        factor *= min(peak.share / (1.0 - safety), 1.01) + 1e-7
    return factor


def _cannot(peak: Peak) -> Infeasible:
    sentence = (
        f"{peak.name} is {peak.value:.4g} at {peak.time:.3f} s against its limit {peak.limit:.4g}, "
        f"and even flying {_MOST:g} times slower does not mend it."
    )
    return Infeasible(
        sentence, Witness(claim=f"limits.{peak.name}", sentence=sentence, time=peak.time, bound=peak.value, limit=peak.limit)
    )
