"""Uniform stretching in time: the simplest way to keep every limit, and an upper bound on the time that better ones take."""

from __future__ import annotations

import numpy as np

from refine.limits.limits import Limits
from refine.limits.usage import Peak, Samples, peaks, peaks_of, shares_used, worst
from refine.spline.spline import Spline
from verify.data import Infeasible, Witness

SAFETY = 2e-3
"""Share of each limit kept back when only samples are looked at."""

_ROUNDS = 60
_LEAST, _MOST = 1e-2, 1e3
_FINE = 801
_CLOSER = 10
_NEARLY = 0.9
"""Share of the greatest use of a limit from which on a piece is looked at closely."""
_WORTH = 0.5
"""Share of the greatest use of a limit from which on a sample may decide a flight's pace."""


def stretch_to_limits(
    path: Spline, yaw: Spline | None, limits: Limits, *, safety: float = SAFETY, faster: bool = False
) -> float:
    """Return the least factor by which the flight must be slowed for all sampled limits to hold.

    Slower flight keeps the path and moves every thrust towards hovering, so the factor is found by stepping up where a
    limit breaks (a rate falls with the factor, a force with its square) and bisecting.

    Args:
        path: Three axes.
        yaw: One axis; None for a yaw of 0 throughout.
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

    if faster and (factor := _fastest(Samples.of(path, yaw), limits, safety)) is not None:
        return _between_samples(path, yaw, limits, factor, safety)
    low = high = 1.0
    peak = breaks(high)
    if peak is None:
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


def _fastest(samples: Samples, limits: Limits, safety: float) -> float | None:
    """Return the least factor at which the samples keep all limits, above or below 1; None where none up to 1000 does.

    Shares are nearly powers of the factor, so that regula falsi on logarithms (the Illinois rule) takes a handful of looks, and
    samples that use little of each limit as it is flown use little of it at any pace: they are looked at once.
    """
    every = [share for _, _, share in samples.shares(limits).values()]
    if every:
        samples = samples.where(np.any([share >= _WORTH * share.max() for share in every], axis=0))

    def over(log_factor: float) -> float:
        shares = samples.stretched(float(np.exp(log_factor))).shares(limits)
        most = max((float(share.max()) for _, _, share in shares.values()), default=0.0)
        return float(np.log(max(most, 1e-12) / (1.0 - safety)))

    low = high = 0.0
    below = above = over(0.0)
    while above > 0.0:
        low, below = high, above
        high += max(0.5 * above, 0.05)
        if high > np.log(_MOST):
            return None
        above = over(high)
    while below <= 0.0:
        high, above = low, below
        low -= max(-0.5 * below, 0.05)
        if low < np.log(_LEAST):
            return _LEAST
        below = over(low)
    for _ in range(_ROUNDS):
        if high - low <= 1e-5:
            break
        middle = low + (high - low) * np.clip(below / (below - above), 0.02, 0.98)
        found = over(float(middle))
        if found > 0.0:
            low, below, above = float(middle), found, above / 2.0
        else:
            high, above, below = float(middle), found, below / 2.0
    return float(np.exp(high))


def _between_samples(path: Spline, yaw: Spline | None, limits: Limits, factor: float, safety: float) -> float:
    """Return the factor, raised a little where samples set much closer see more: extremes can be narrow.

    Only pieces that use nearly as much of a limit as any are looked at closely.
    """
    used = [share.max(axis=1) for _, _, share in shares_used(path.stretched(factor), _slower(yaw, factor), limits).values()]
    if not used:
        return factor
    most = np.max(used, axis=0)
    near = np.flatnonzero(most >= _NEARLY * most.max())
    for _ in range(_CLOSER):
        samples = Samples.of(path.stretched(factor), _slower(yaw, factor), _FINE, near)
        peak = worst(peaks_of(samples.shares(limits)))
        if peak is None or peak.share <= 1.0 - safety:
            break
        factor *= min(peak.share / (1.0 - safety), 1.01) + 1e-7
    return factor


def _slower(yaw: Spline | None, factor: float) -> Spline | None:
    return None if yaw is None else yaw.stretched(factor)


def _cannot(peak: Peak) -> Infeasible:
    sentence = (
        f"{peak.name} is {peak.value:.4g} at {peak.time:.3f} s against its limit {peak.limit:.4g}, "
        f"and even flying {_MOST:g} times slower does not mend it."
    )
    return Infeasible(
        sentence, Witness(claim=f"limits.{peak.name}", sentence=sentence, time=peak.time, bound=peak.value, limit=peak.limit)
    )
