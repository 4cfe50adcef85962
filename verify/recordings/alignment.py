"""Start of a recording's flight: one shift for the whole team, as it was given or fitted to the plan.

A fit is no proof. Shifts that explain the recording as well as the best one, up to the measurement's error, and half the time
between samples on both sides, make the interval for which claims about times must hold; where all of it is further from the
recording's own beginning than the clocks may differ, the recording does not tell when its flight began.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from verify.recordings.planned_paths import PlannedPath

Floats = NDArray[np.float64]

_MOST = 300
"""Samples of each robot that a fit looks at."""

_STEP = 0.05
"""s between the shifts that are tried first; at least the 2000th part of all that are possible."""


@dataclass(frozen=True, slots=True)
class Alignment:
    """Start of the flight on the recording's clock.

    Attributes:
        low: Earliest, s.
        high: Latest, s; equal to `low` where it was given exactly.
        fitted: The best fit, s; None where the start was given.
        trusted: Whether claims about times may be made at all.
        zero: What the recording's own clock showed at 0, s.
        told: Whether the recording says when the flight began, or somebody did; a fit to the plan is neither.
    """

    low: float
    high: float
    fitted: float | None
    trusted: bool
    zero: float = 0.0
    told: bool = False

    @property
    def sentence(self) -> str:
        """Say it to a person."""
        if self.fitted is None and not self.told:
            return (
                f"Nobody says when the flight began; it is taken to begin with the recording, at {self.low:g} s (`--start` says "
                "otherwise)."
            )
        if self.fitted is None and self.high > self.low:
            return f"The flight began at some time from {self.low:g} to {self.high:g} s of the recording, as was told."
        if self.fitted is None:
            return f"The flight began at {self.low:g} s of the recording, as it says or was told."
        found = f"{self.fitted:.3f} s of the recording (fitted; from {self.low:.3f} to {self.high:.3f} s cannot be told apart)"
        if self.trusted:
            return f"The flight began at {found}, one start for the whole team."
        return (
            f"The plan fits the recording best where the flight began at {found}, which is not its first row: claims about times "
            f"cannot be told. Say when it began (`--start {self.zero + self.fitted:.3f}`)."
        )


def given(low: float, high: float) -> Alignment:
    """Return the alignment that was told.

    Args:
        low: Earliest start, s.
        high: Latest start, s.
    """
    return Alignment(low, high, None, True, told=True)


def with_the_recording(begin: float) -> Alignment:
    """Return the alignment of a recording of which nothing was planned and nobody says when the flight began.

    Args:
        begin: From when on the recording covers anything, s.
    """
    return Alignment(begin, begin, None, True)


def fitted(
    times: Floats, positions: Mapping[str, Floats], paths: Mapping[str, PlannedPath], *, error: float, clock_error: float
) -> Alignment:
    """Fit one shift for the whole team, in plain floats.

    Args:
        times: s. Shape (n,).
        positions: For each robot, m, NaN where it was not seen. Shape (n, 3) each.
        paths: What was planned.
        error: Bound on the measurement's error, m.
        clock_error: How far the recording's beginning and the flight's may lie apart, s.
    """
    index = np.unique(np.linspace(0, len(times) - 1, min(_MOST, len(times))).astype(int))
    some = {name: places[index] for name, places in positions.items()}

    def rms(shift: float) -> float:
        squares, count = 0.0, 0
        for name, places in some.items():
            wanted = paths[name].places(times[index] - shift)
            off = ((places - wanted) ** 2).sum(axis=1)
            seen = ~np.isnan(off)
            squares, count = squares + float(off[seen].sum()), count + int(seen.sum())
        return float(np.sqrt(squares / max(count, 1)))

    end = max(path.end for path in paths.values())
    first, last = float(times[0] - end / 2), float(max(times[-1] - end / 2, times[0]))
    step = max(_STEP, (last - first) / 2000)
    grid = np.r_[float(times[0]), np.arange(first, last + step, step)]
    best = float(grid[int(np.argmin([rms(shift) for shift in grid]))])
    while step > 1e-4:
        step /= 4
        near = best + step * np.arange(-4, 5)
        best = float(near[int(np.argmin([rms(shift) for shift in near]))])
    half = max(_step(times[~np.isnan(places).any(axis=1)]) for places in positions.values()) / 2
    allowed = rms(best) + max(error, 1e-9)
    low, high = best - _room(rms, best, -1, allowed, end) - half, best + _room(rms, best, 1, allowed, end) + half
    off = max(low - float(times[0]), float(times[0]) - high, 0.0)
    trusted = off <= clock_error
    return Alignment(min(low, float(times[0])), max(high, float(times[0])), best, True) if trusted else Alignment(
        low, high, best, False
    )  # fmt: skip


def _step(times: Floats) -> float:
    """Return the usual time between a robot's samples, s."""
    return float(np.median(np.diff(times))) if len(times) > 1 else 0.0


def _room(rms: Callable[[float], float], best: float, sign: int, allowed: float, most: float) -> float:
    """Return how far a shift can go one way until it explains the recording worse than is allowed, s."""
    step = 1e-4
    while step < most and rms(best + sign * step) <= allowed:
        step *= 2
    low = step / 2 if step > 1e-4 else 0.0
    for _ in range(12):
        middle = (low + step) / 2
        low, step = (middle, step) if rms(best + sign * middle) <= allowed else (low, middle)
    return step
