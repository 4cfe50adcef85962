"""Earliest times of robots on their paths, where some of one robot's times come after others of another one's: longest paths."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

GAP = 0.05
"""s by which whoever follows stays behind the border of a zone."""
_LATEST = 2.0
"""How many times longer than all flights one after another earliest times may become: then robots wait for each other in a circle."""


@dataclass(frozen=True, eq=False, slots=True)
class Line:
    """One robot's path by its own time, in cells.

    Attributes:
        times: Own times between which cells lie, s. Where a robot rests (at its start, halts and end) a cell lasts no time. Shape (cells + 1,).
        places: About the middle of each cell, m, z scaled. Shape (cells, 3).
        reach: How far it may be from there within the cell, and in the clocks' error, m. Shape (cells,).
        earliest: Least departure, s.
    """

    times: Floats
    places: Floats
    reach: Floats
    earliest: float


@dataclass(frozen=True, eq=False, slots=True)
class After:
    """Differences of times: a robot comes to some of its times no sooner than another one to others, and a gap.

    Attributes:
        first: The other robot.
        done: Which of its times.
        then: The robot.
        due: Which of its times.
        gap: s.
    """

    first: int
    done: Indices
    then: int
    due: Indices
    gap: float = GAP


class Times:
    """Earliest times of all cells under differences that are added one after the other."""

    def __init__(self, lines: Sequence[Line]) -> None:
        self._lines = lines
        self._most = _LATEST * sum(float(line.times[-1]) + line.earliest for line in lines)
        self.times = [line.earliest + line.times for line in lines]
        self._known: list[list[After]] = [[] for _ in lines]
        self._refused: tuple[int, int] | None = None  # a robot, and which of its times gets later without end

    @property
    def arrivals(self) -> tuple[float, float]:
        """The last arrival, and the sum of all arrivals, s."""
        ends = [float(times[-1]) for times in self.times]
        return max(ends), sum(ends)

    def copy(self) -> Times:
        """Return the same times, to be changed apart."""
        other = Times.__new__(Times)
        other._lines, other._most = self._lines, self._most
        other.times, other._known = list(self.times), [list(known) for known in self._known]
        other._refused = None
        return other

    def add(self, more: Sequence[After]) -> bool:
        """Take more differences; return whether any times keep all of them."""
        for after in more:
            self._known[after.first].append(after)
        most = 1 + sum(
            len(after.done) for after in more
        )  # each of the new ones may be the cause of later ones, but not of itself
        waiting, rounds = deque(more), dict.fromkeys(map(id, more), 0)
        while waiting:
            after = waiting.popleft()
            times, due = self.times[after.then], self.times[after.first][after.done] + after.gap
            late = times[after.due] < due - 1e-9
            if not late.any():
                continue
            self._refused = after.first, int(after.done[np.argmax(late)])  # until the times keep all differences
            if id(after) in rounds:
                rounds[id(after)] += 1
                if rounds[id(after)] > most:
                    return False
            own = self._lines[after.then].times
            late = times - own
            np.maximum.at(late, after.due, due - own[after.due])
            times = own + np.maximum.accumulate(late)
            if times[-1] > self._most:
                return False
            self.times[after.then] = times
            waiting += self._known[after.then]
        self._refused = None
        return True

    def causes(self, differences: Sequence[After]) -> list[After]:
        """Return the differences because of which the last arrival is not sooner: the critical path, from its end."""
        robot = max(range(len(self.times)), key=lambda each: float(self.times[each][-1]))
        return self._causes(differences, robot, len(self.times[robot]) - 1)

    @property
    def circle(self) -> list[After]:
        """The differences that go round in a circle where adding some was refused, and others that delay them."""
        if self._refused is None:
            return []
        robot, at = self._refused
        return self._causes([after for known in self._known for after in known], robot, at)

    def _causes(self, differences: Sequence[After], robot: int, at: int) -> list[After]:
        """Return the differences because of which a robot does not come sooner to one of its times, the last one first."""
        found: list[After] = []
        while True:
            late = self.times[robot][: at + 1] - self._lines[robot].times[: at + 1]
            if late[-1] <= self._lines[robot].earliest + 1e-9:
                return found
            at = int(np.argmax(late >= late[-1] - 1e-9))
            for after in differences:
                if after.then == robot and after not in found:
                    here = np.flatnonzero(after.due == at)
                    if len(here) and self.times[after.first][after.done[here[0]]] + after.gap >= self.times[robot][at] - 1e-7:
                        found.append(after)
                        robot, at = after.first, int(after.done[here[0]])
                        break
            else:
                return found

    def keeps(self, after: After | None) -> bool:
        """Return whether the times keep differences."""
        if after is None:
            return False
        return bool(np.all(self.times[after.then][after.due] >= self.times[after.first][after.done] + after.gap - 1e-9))
