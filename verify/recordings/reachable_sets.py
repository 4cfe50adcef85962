"""Reachable sets between samples: a ball for every instant, given a bound on the robot's speed.

Two samples a and b, taken dt apart, of a robot that is never faster than v and whose measured positions are off by at most e:
after a share s of the time it is within s D + e of a and (1 - s) D + e of b, where D = v dt. So by Stewart's theorem its
distance h from the point of the chord at share s obeys

    h^2 <= s (1 - s) (D^2 + 4 D e - c^2) + e^2,    c = |b - a|,

which is at most a quarter of (D + 2 e)^2 - c^2, the ellipsoid's. Where its acceleration is bounded by A as well, h is also at most
e + A s (1 - s) dt^2 / 2. Before its first sample and after its last one it is in a ball
that grows at v; a second sample at the same place, twice as far away in time, says exactly that.

What is asked of all times is asked of cells: parts of a gap between samples, each in one ball. A cell that is too large to answer
is halved, until its middle alone shows that halving is no use.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from verify.arithmetic.intervals import Interval
from verify.data.errors import BadInput

Floats = NDArray[np.float64]

DEPTH = 12
"""How often a cell is halved at most."""

MOST_CELLS = 2_000_000
"""More cells than these are not looked at; then the samples cannot tell."""

_SLACK = 1e-12
"""Relative; what floats lose in this module is below a thousandth of it."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """Bounds on every robot and on the measurement.

    Attributes:
        speed: Bound on the speed at all times, m/s.
        error: Bound on the distance between measured and true position, m.
        acceleration: Bound on the acceleration at all times, m/s^2; infinite where there is none.
    """

    speed: float
    error: float
    acceleration: float = np.inf


@dataclass(frozen=True, eq=False)
class Track:
    """One robot's samples, and the time over which it is checked.

    Attributes:
        robot: Name.
        times: s, increasing; where the robot was not seen at an end of the checked time, that of a sample that stands for it.
            Shape (n,), n >= 2.
        positions: m. Shape (n, 3).
        real: Which of them are samples. Shape (n,).
        bounds: What is known between samples.
        start: From when it is checked, s; not before the first of `times`.
        stop: Until when, s; not after the last.
    """

    robot: str
    times: Floats
    positions: Floats
    real: NDArray[np.bool_]
    bounds: Bounds
    start: float
    stop: float

    def over(self, start: float, stop: float) -> Track:
        """Return the same samples, checked over a part of the time only."""
        return replace(self, start=max(start, self.start), stop=min(stop, self.stop))

    @property
    def samples(self) -> NDArray[np.intp]:
        """Indices of the samples within the checked time."""
        return np.flatnonzero(self.real & (self.times >= self.start) & (self.times <= self.stop))

    @property
    def gaps(self) -> Floats:
        """Upper bounds on the times between samples, s. Shape (n - 1,)."""
        return np.nextafter(np.diff(self.times), np.inf) + np.spacing(np.abs(self.times[1:]))

    @property
    def chords(self) -> Floats:
        """Distances between samples that follow each other, m. Shape (n - 1,)."""
        return np.linalg.norm(np.diff(self.positions, axis=0), axis=1)

    def spread(self, gap: NDArray[np.intp], low: Floats, high: Floats) -> Floats:
        """Bound the distance from the chord's point at the same instant, between two shares of gaps, m.

        Args:
            gap: Indices of gaps; gap i is between samples i and i + 1. Shape (m,).
            low: Where in each gap the stretch begins, 0 to 1. Shape (m,).
            high: Where it ends, 0 to 1. Shape (m,).

        Returns:
            Shape (m,), m.
        """
        reach, chord = self.bounds.speed * self.gaps[gap] * (1 + _SLACK), self.chords[gap] * (1 - _SLACK)
        open_ = np.maximum(reach * reach + 4 * reach * self.bounds.error - chord * chord, 0.0) + _SLACK * reach * reach
        nearest = np.clip(0.5, low, high)
        most = nearest * (1 - nearest)
        slow = np.sqrt(most * open_ + self.bounds.error**2)
        if not np.isfinite(self.bounds.acceleration):
            return slow * (1 + _SLACK)
        seen = self.real[gap] & self.real[gap + 1]  # what stands for a sample is no place where the robot was
        smooth = self.bounds.error + self.bounds.acceleration * most * self.gaps[gap] ** 2 / 2
        return np.where(seen, np.minimum(slow, smooth), slow) * (1 + _SLACK)

    def places(self, gap: NDArray[np.intp], share: Floats) -> Floats:
        """Return points of the chords. Shape (len(gap), 3), m."""
        first = self.positions[gap]
        return first + share[:, None] * (self.positions[gap + 1] - first)

    def rounding(self, gap: NDArray[np.intp]) -> Floats:
        """Bound what floats lose of points of chords, m."""
        size = np.abs(self.positions).max(axis=1)
        return _SLACK * (np.maximum(size[gap], size[gap + 1]) + 1e-3)

    def cells(self) -> Cells:
        """Return one cell for each gap, as far as it is within the checked time."""
        gap = np.arange(len(self.times) - 1)
        gap = gap[(self.times[1:] >= self.start) & (self.times[:-1] <= self.stop)]
        begin, length = self.times[gap], np.diff(self.times)[gap]
        low = np.clip((self.start - begin) / length - _SLACK, 0.0, 1.0)
        high = np.clip((self.stop - begin) / length + _SLACK, 0.0, 1.0)
        return Cells(self, gap, low, high)


def track(robot: str, times: Floats, positions: Floats, bounds: Bounds, *, start: float, stop: float) -> Track:
    """Make a track of samples, with what stands for them where the checked time begins before them or ends after them.

    Args:
        robot: Name.
        times: s, increasing. Shape (n,).
        positions: m; NaN where the robot was not seen. Shape (n, 3).
        bounds: What is known between samples.
        start: From when the robot is checked, s.
        stop: Until when, s.

    Raises:
        BadInput: The robot was never seen, or is further from one sample to the next than the bounds allow.
    """
    seen = ~np.isnan(positions).any(axis=1)
    if not seen.any():
        raise BadInput(f"{robot} has no sample in the recording.")
    times, positions = times[seen], positions[seen]
    first = max(int(np.searchsorted(times, start, side="right")) - 1, 0)
    last = min(int(np.searchsorted(times, stop, side="left")), len(times) - 1)
    first, last = min(first, last), max(first, last)
    times, positions = times[first : last + 1], positions[first : last + 1]
    real = np.ones(len(times), dtype=np.bool_)
    if times[0] > start or len(times) == 1:
        before = np.nextafter(times[0] - 2 * max(times[0] - start, 1e-9), -np.inf)
        times, positions = np.r_[before, times], np.r_[positions[:1], positions]
        real = np.r_[False, real]
    if times[-1] < stop or len(times) == 1:
        after = np.nextafter(times[-1] + 2 * max(stop - times[-1], 1e-9), np.inf)
        times, positions = np.r_[times, after], np.r_[positions, positions[-1:]]
        real = np.r_[real, False]
    made = Track(robot, times, positions, real, bounds, start, stop)
    allowed = (bounds.speed * made.gaps + 2 * bounds.error) * (1 + 1e-9)
    if np.any(made.chords > allowed):
        k = int(np.argmax(made.chords > allowed))
        raise BadInput(
            f"{robot} is {made.chords[k]:.4g} m away from {times[k]:.4f} s to {times[k + 1]:.4f} s; at most {bounds.speed:g} m/s and "
            f"{bounds.error:g} m of error allow {allowed[k]:.4g} m."
        )
    return made


@dataclass(frozen=True, eq=False)
class Cells:
    """Parts of gaps between samples. All shapes are (cells,) unless said.

    Attributes:
        track: Whose.
        gap: Index of each cell's gap.
        low: Share of the gap at which the cell begins, 0 to 1.
        high: At which it ends.
    """

    track: Track
    gap: NDArray[np.intp]
    low: Floats
    high: Floats

    def __len__(self) -> int:
        return len(self.gap)

    @property
    def middle(self) -> Floats:
        """Share in the middle."""
        return (self.low + self.high) / 2

    @property
    def centres(self) -> Floats:
        """Point of the chord in the middle, m. Shape (cells, 3)."""
        return self.track.places(self.gap, self.middle)

    @property
    def half(self) -> Floats:
        """Half the time that each cell takes, rounded up, s."""
        return (self.high - self.low) / 2 * self.track.gaps[self.gap] * (1 + _SLACK)

    @property
    def along(self) -> Floats:
        """Half the length of the chord in the cell, rounded up, m."""
        return (self.high - self.low) / 2 * self.track.chords[self.gap] * (1 + _SLACK)

    @property
    def spread(self) -> Floats:
        """Bound on the distance from the chord's point at the same instant, anywhere in the cell, m."""
        return self.track.spread(self.gap, self.low, self.high) + self.track.rounding(self.gap)

    @property
    def reach(self) -> Floats:
        """Bound on the distance from `centres` at any time of the cell, m."""
        return (self.along + self.spread) * (1 + _SLACK)

    @property
    def instant(self) -> Floats:
        """Bound on the distance from `centres` in the very middle, m."""
        return self.track.spread(self.gap, self.middle, self.middle)

    def times(self, share: Floats) -> Floats:
        """Return the times at shares of the gaps, s."""
        begin = self.track.times[self.gap]
        return begin + share * (self.track.times[self.gap + 1] - begin)

    def at(self, index: NDArray[np.intp]) -> Cells:
        """Return some of the cells."""
        return Cells(self.track, self.gap[index], self.low[index], self.high[index])

    def halved(self) -> Cells:
        """Return both halves of every cell, in order."""
        middle = self.middle
        low, high = np.stack([self.low, middle], axis=1), np.stack([middle, self.high], axis=1)
        return Cells(self.track, np.repeat(self.gap, 2), low.ravel(), high.ravel())


@dataclass(frozen=True, slots=True)
class Least:
    """Least value of a quantity over a track.

    Attributes:
        proved: Whether it provably never falls below what was asked.
        low: Proved of all times.
        time: When it is tightest, or first cannot be proved, s.
    """

    proved: bool
    low: float
    time: float


Value = Callable[[Cells], tuple[Interval, Floats, Floats | float]]
"""Encloses a quantity for the cells' centres in the middle, with how much less it may be elsewhere in the cell, and which part of
that is left however small the cell."""


def least(track: Track, value: Value, limit: float) -> Least:
    """Bound from below how small a quantity gets, whatever the robot did between its samples.

    Args:
        track: Where it was.
        value: The quantity; at one instant it changes by at most 1 where the position moves by 1 m.
        limit: Halving goes on until the bound is above this, or cannot be.
    """
    cells = track.cells()
    best, when, doubt = np.inf, track.start, (np.inf, np.inf)
    for level in range(DEPTH + 1):
        if not len(cells):
            break
        found, change, left = value(cells)
        low = found.low - cells.spread - change
        low = np.where(np.isnan(low), -np.inf, low)
        good = low > limit
        hopeless = ~good & ((found.high - cells.instant - left <= limit) | (level == DEPTH) | (len(cells) > MOST_CELLS))
        if np.any(good) and low[good].min() < best:
            at = np.flatnonzero(good)[int(np.argmin(low[good]))]
            best, when = float(low[at]), float(cells.times(cells.middle)[at])
        if np.any(hopeless):
            at = np.flatnonzero(hopeless)[int(np.argmin(low[hopeless]))]
            doubt = min(doubt, (float(low[at]), float(cells.times(cells.middle)[at])))
        cells = cells.at(np.flatnonzero(~good & ~hopeless)).halved()
    if doubt[0] < np.inf:
        return Least(False, min(doubt[0], best), doubt[1])
    return Least(True, best, when)
