"""The visits that a robot makes, read off the regions that it is in one after another, with the actions made there."""

from __future__ import annotations

import math
from collections.abc import Iterable

from verify.data import Visit
from verify.data.sections import Action


class VisitLog:
    """The visits of a way, in the order in which they begin. It grows as the way is followed.

    Regions in which the way begins are visited from the same instant on; of these the one that is left first is listed first, as
    the checker lists stays, and those that are never left by name.
    """

    def __init__(self, way: Iterable[frozenset[str]] = ()) -> None:
        """Begin a log; the first regions that it takes note of are where the robot begins.

        Args:
            way: Regions that hold the robot one after another.
        """
        self._visits: list[Visit] = []
        self._stops: list[int] = []
        self._current: dict[str, int] = {}
        """The visit of each region that the robot is in."""
        self._begun: int | None = None
        """How many visits begin at the start."""
        self._left: dict[int, int] = {}
        """For each of those that is over, how many were before it."""
        for regions in way:
            self.enter(regions)

    def enter(self, regions: frozenset[str]) -> tuple[str, ...]:
        """Take note of the regions that hold the robot now; return those that are new."""
        new = tuple(sorted(regions - self._current.keys()))
        for region in new:
            self._current[region] = len(self._visits)
            self._visits.append(Visit(region=region))
        if self._begun is None:
            self._begun = len(new)
        for region in sorted(self._current.keys() - regions):
            visit = self._current.pop(region)
            if visit < self._begun:
                self._left[visit] = len(self._left)
        return new

    def current(self, region: str) -> int:
        """Return which visit of the way, as begun, the robot is making in a region; `numbers` says its place among all."""
        return self._current[region]

    def stop(self, region: str) -> None:
        """Take note that the robot rests in a region that it is in: where it starts, or in its middle."""
        self._stops.append(self._current[region])

    def act(self, action: Action) -> None:
        """Take note of an action, in the region that permits it, where the robot is."""
        visit = self._current[action.at]
        self._visits[visit] = Visit(region=action.at, actions=(*self._visits[visit].actions, action))

    @property
    def visits(self) -> tuple[Visit, ...]:
        """Visits so far."""
        return tuple(self._visits[visit] for visit in self._order)

    @property
    def stops(self) -> tuple[int, ...]:
        """Index of the visit that each stop belongs to, in order; a start inside regions is the first stop."""
        place = self.numbers
        return tuple(place[visit] for visit in self._stops)

    @property
    def numbers(self) -> dict[int, int]:
        """For each visit, as begun, its index among the visits."""
        return {visit: index for index, visit in enumerate(self._order)}

    @property
    def _order(self) -> list[int]:
        begun = self._begun or 0
        first = sorted(range(begun), key=lambda visit: (self._left.get(visit, math.inf), visit))
        return [*first, *range(begun, len(self._visits))]
