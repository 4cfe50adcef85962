"""Pairs of robots whose braking can meet: each robot's flight in short parts, in boxes with all of the braking that begins there.

Boxes come from Bernstein coefficients, so a robot that brakes from a part is in its box, whatever the instant and the share. Time is cut
into windows. In each window a robot's box holds the parts that begin there, and another box those that may be flown at the same time, by
clocks that differ. Where a robot's box is farther from another's than these two must keep, they cannot come too near in braking that the
first begins there: nothing is sampled. Of the windows that are left single parts are compared with each other in the same way.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.bounds import Indices
from verify.motion.braking.patches import Flags, Patches, patches_of, shortened
from verify.motion.paths import TeamPaths

_LATE = 1e-9
"""Share of the times, and s, by which they are compared too generously: roundings are far smaller."""
_WAIT = 1
"""s that a robot waits before its flight and behind it, at least: longer waits show nothing else."""
_SLACK = 1e-9
"""Relative; the roundings of a few operations on numbers that are not negative are below 1e-15 each."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """Motion of a robot at some time: a segment, or a wait.

    Attributes:
        robot: Index.
        segment: Index of the segment that is flown, or at one end of which it waits.
        start: s, exact.
        stop: s, exact.
        later: How much later than the segment's own times, s, exact: the beginning of another lap.
        still: At which end of the segment, 0 or 1, it waits; None where it flies.
    """

    robot: int
    segment: int
    start: Fraction
    stop: Fraction
    later: Fraction = Fraction(0)
    still: int | None = None


def stretches(paths: TeamPaths, error: Fraction) -> list[Stretch]:
    """Return what robots do, robot by robot in order of time, from before their flights until after them.

    Args:
        paths: What is flown.
        error: By how much clocks may differ, s.
    """
    found: list[Stretch] = []
    for robot, trajectory in enumerate(paths.trajectories):
        rows = [int(i) for i in np.flatnonzero(paths.owner == robot)]
        flown = [(i, paths.segments[i]) for i in rows if paths.segments[i].kind != "step"]
        found.append(Stretch(robot, rows[0], -error - _WAIT, Fraction(0), still=0))
        found += [Stretch(robot, i, s.start, s.stop, still=1 if s.kind == "hover" else None) for i, s in flown]
        if trajectory.cycle is None:
            found.append(Stretch(robot, flown[-1][0], paths.end, paths.end + error + _WAIT, still=1))
            continue
        begin = paths.knots[robot][trajectory.cycle]
        later = paths.end - begin
        for lap in range(1, 2 + int(error / later)):
            again = [(i, s, s.start + lap * later) for i, s in flown if begin <= s.start]
            found += [Stretch(robot, i, t, s.stop + lap * later, lap * later) for i, s, t in again if t <= paths.end + error]
    return found


@dataclass(frozen=True, eq=False)
class Lanes:
    """All robots' flights in short parts.

    Attributes:
        stretches: What robots do.
        parts: Their parts with all of the braking, robot by robot in order of time; items are indices of stretches.
        jumps: Bound on how far braking is moved by each robot's longest step between pieces, m.
        window: Length of a window, and of the longest part, s.
        error: By how much clocks may differ, s, a little generous.
    """

    stretches: tuple[Stretch, ...]
    parts: Patches
    jumps: tuple[float, ...]
    window: float
    error: float

    @classmethod
    def of(cls, paths: TeamPaths, length: Fraction, weight: Fraction, error: Fraction) -> Lanes:
        """Cut a team's flights.

        Args:
            paths: What is flown.
            length: L, s that braking takes.
            weight: By which distances in z are multiplied.
            error: By how much clocks may differ, s.
        """
        whole = patches_of(paths, length).scaled(2, weight)
        done = stretches(paths, error)
        rows = whole[np.array([one.segment for one in done])]
        for k, one in enumerate(done):
            if one.still is not None:
                rows.mid[k] = rows.mid[k][:, :1, -one.still, None]
        parts = replace(rows, item=np.arange(len(done)))
        window = float(length) / 4
        seconds = np.array([float(one.stop - one.start) for one in done])
        parts = shortened(parts, seconds, window)
        starts = np.array([float(one.start) for one in done])
        robots = np.array([one.robot for one in done])
        parts = parts[np.lexsort((starts[parts.item] + parts.place * seconds[parts.item], robots[parts.item]))]
        latest = max(1.0, float(paths.end))
        return cls(tuple(done), parts, _jumps(paths, whole), window, float(error) * (1 + _LATE) + _LATE * (1 + latest))

    @cached_property
    def start(self) -> Floats:
        """Begin of parts, s. Shape (parts,)."""
        return self.times(self.parts)[0]

    @cached_property
    def stop(self) -> Floats:
        """End of parts, s. Shape (parts,)."""
        return self.times(self.parts)[1]

    @cached_property
    def robots(self) -> Indices:
        """Robot of each stretch. Shape (stretches,)."""
        return np.array([one.robot for one in self.stretches], dtype=np.intp)

    def times(self, parts: Patches) -> tuple[Floats, Floats]:
        """Return when parts of these begin and end, s. Shape (n,) each."""
        begins, seconds = self._times
        start = begins[parts.item] + parts.place * seconds[parts.item]
        return start, start + parts.length * seconds[parts.item]

    @cached_property
    def _times(self) -> tuple[Floats, Floats]:
        """Starts and durations of the stretches, s."""
        return (
            np.array([float(one.start) for one in self.stretches]),
            np.array([float(one.stop - one.start) for one in self.stretches]),
        )

    @np.errstate(all="ignore")
    def near(self, asked: Floats) -> Iterator[tuple[Indices, Indices]]:
        """Yield parts that boxes do not keep apart, robot by robot: those of one robot, and for each of them one of a later robot.

        Args:
            asked: How far apart two robots must be, m. Shape (robots, robots).
        """
        low, high = self.parts.low, self.parts.high
        robots = self.robots[self.parts.item]
        ends = np.searchsorted(robots, np.arange(len(self.jumps) + 1))
        window = np.floor((self.start - self.start.min()) / self.window).astype(np.intp)
        own, met = self._windows(low, high, window, ends)
        for robot in range(len(self.jumps) - 1):
            mine, later = np.arange(ends[robot], ends[robot + 1]), slice(robot + 1, None)
            clear = _beyond(own[0][robot], own[1][robot], met[0][later], met[1][later], asked[robot, later, None])
            for other in robot + 1 + np.flatnonzero(~clear.all(axis=1)):
                first = mine[~clear[other - robot - 1, window[mine]]]
                its = slice(ends[other], ends[other + 1])
                begin = np.searchsorted(self.stop[its], self.start[first] - self.error, side="left")
                counts = np.searchsorted(self.start[its], self.stop[first] + self.error, side="right") - begin
                one = np.repeat(first, counts)
                another = np.arange(len(one)) + np.repeat(ends[other] + begin - np.cumsum(counts) + counts, counts)
                kept = ~_beyond(low[one], high[one], low[another], high[another], asked[robot, other])
                yield one[kept], another[kept]

    def _windows(
        self, low: Floats, high: Floats, window: Indices, ends: Indices
    ) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """Return boxes of the parts that begin in each window, and of those that may be flown while these are.

        Args:
            low: Least coordinates of parts, m. Shape (parts, 3).
            high: Greatest ones.
            window: In which each begins. Shape (parts,).
            ends: Where each robot's parts begin, and the last one's end. Shape (robots + 1,).

        Returns:
            Least and greatest coordinates of each kind, m. Shape (robots, windows, 3) each.
        """
        count = int(window.max()) + 1
        begins = self.start.min() + self.window * np.arange(count)
        size = (len(self.jumps), count, 3)
        own, met = ((np.full(size, np.inf), np.full(size, -np.inf)) for _ in range(2))
        for robot, (first, last) in enumerate(itertools.pairwise(ends)):
            rows = slice(first, last)
            np.minimum.at(own[0][robot], window[rows], low[rows])
            np.maximum.at(own[1][robot], window[rows], high[rows])
            since = np.searchsorted(self.stop[rows], begins - self.error, side="left")
            until = np.searchsorted(self.start[rows], begins + 2 * self.window + self.error, side="right")
            turns = np.stack([since, np.maximum(until, since + 1)], axis=1).ravel()
            none = np.full((2, 3), np.inf)
            met[0][robot] = np.minimum.reduceat(np.concatenate([low[rows], none]), turns)[::2]
            met[1][robot] = np.maximum.reduceat(np.concatenate([high[rows], -none]), turns)[::2]
        return own, met


def _beyond(low: Floats, high: Floats, its_low: Floats, its_high: Floats, asked: Floats | float) -> Flags:
    """Return which boxes are farther apart than is asked. Shapes (..., 3) to (...)."""
    gap = np.maximum(np.nextafter(np.maximum(low - its_high, its_low - high), -np.inf), 0.0)
    return (gap * gap).sum(-1) * (1 - _SLACK) > asked * asked


def _jumps(paths: TeamPaths, whole: Patches) -> tuple[float, ...]:
    """Bound each robot's longest step, whatever the share of the braking, m, with heights as they are measured."""
    longest = [0.0] * len(paths.robots)
    for i, segment in enumerate(paths.segments):
        if segment.kind == "step":
            ways = np.abs(whole.mid[i, :, :, -1] - whole.mid[i, :, :, 0]).max(axis=1) + 2 * whole.rad[i]
            longest[segment.robot] = max(longest[segment.robot], float(np.sqrt((ways * ways).sum())) * (1 + 2.0**-40))
    return tuple(longest)
