"""Bounds on cost and duration of teams in rooms that owe nothing to the planner.

A visibility graph in the plane over the rooms' inflated walls has the least length from any start to any place: inflated corners are cut inwards,
so that a length is below the least one of a flight. Tours are found over all subsets and orders, shared tasks over all ways to share them.
A door that is the only one of its wall, and too narrow for two, is passed by one robot after another, in the best order.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import shortest_path

from tests.helpers.missions.room_teams import APART, CLEARANCE, HALF_HEIGHT, MARGIN, Box, Door, Point, RoomTeam

Floats = NDArray[np.float64]

_ARC = 5
"""Points on each rounded corner."""
_SIDE = 0.06
"""m between points at which a place may be touched: what is lost by that is about a millimetre."""
_ROUNDING = 1e-6


class RoomBounds:
    """Least lengths and times of a mission in rooms.

    Args:
        team: The mission.
        speed: At which robots fly, m/s.
        beside: Regions that nobody may enter besides.
    """

    def __init__(self, team: RoomTeam, speed: float, beside: Collection[Box] = ()) -> None:
        self.team, self.speed, self.beside = team, speed, beside
        self.robots = list(team.starts)
        self.shared = team.tasks.get("", ())

    @cached_property
    def cost(self) -> float:
        """Least length that all robots fly together, m."""
        team = self.team
        if team.kind == "gather":
            return float(sum(sorted(self.length(robot, self.shared) for robot in self.robots)[: team.meeting]))
        if not self.shared:
            own = sum(self.length(robot, team.tasks[robot]) for robot in self.robots)
            return own + (2 * MARGIN * (len(self.robots) - 1) if team.kind == "turns" else 0.0)  # all but one go out again
        least = {frozenset[str](): 0.0}
        for robot in self.robots:
            several = [frozenset(some) for n in range(len(self.shared) + 1) for some in itertools.combinations(self.shared, n)]
            least = {
                done: min(
                    least[before] + self.length(robot, tuple(sorted(done - before))) for before in least if before <= done
                )
                for done in several
                if any(before <= done for before in least)
            }
        return least[frozenset(self.shared)]

    def duration(self, visited: Mapping[str, Sequence[str]]) -> float:
        """Return the least duration of a flight in which each robot comes to what it has to, s.

        Args:
            visited: The places that each robot comes to.
        """
        alone = max(self.length(robot, tuple(sorted(set(visited.get(robot, ()))))) for robot in self.robots)
        waits = [self._through(door, visited) for door in self.team.doors]
        if self.team.kind == "turns":  # in and out by the margin on both sides of the edge, before the next one is in
            turns = [(self.length(robot, ("a",)), 0.0) for robot in self.robots]
            waits.append(min(_in_order(order, 4 * MARGIN) for order in itertools.permutations(turns)))
        return max([alone, *waits]) / self.speed

    def length(self, robot: str, places: tuple[str, ...]) -> float:
        """Return the least length of a robot's way through some places in any order, to its end where it has one, m."""
        return self._lengths(robot, places)

    @cached_property
    def _lengths(self) -> Callable[[str, tuple[str, ...]], float]:
        @cache
        def lengths(robot: str, places: tuple[str, ...]) -> float:
            orders = itertools.permutations(places)
            if self.team.kind == "until":  # words hold in every order of the robots, so that who enters b has been in a
                orders = (order for order in orders if "b" not in order or "a" in order[: order.index("b")])
            return min((self._along(robot, order) for order in orders), default=np.inf)

        return lengths

    def _along(self, robot: str, order: Iterable[str]) -> float:
        far, stops = self._far, [*order, *([f"end {robot}"] if robot in self.team.ends else [])]
        here, so_far = self._index[f"start {robot}"], np.zeros(1)
        for stop in stops:
            there = self._index[stop]
            so_far = np.min(so_far[:, None] + far[np.ix_(here, there)], axis=0)
            here = there
        return float(so_far.min())

    def _through(self, door: Door, visited: Mapping[str, Sequence[str]]) -> float:
        """Return the least length in time of a team of which some have to pass a narrow door one after another; 0 where two pass abreast."""
        wide = float(np.hypot(door.side[1] - door.side[0] - 2 * CLEARANCE, 2 * (HALF_HEIGHT[self.team.height] - MARGIN)))
        if wide >= APART:
            return 0.0
        gap = max(APART - wide, min((door.wall[1] - door.wall[0]) / 2, float(np.sqrt(APART**2 - wide**2))))
        middle = sum(door.wall) / 2
        at = self._index[f"door {door.wall}"]
        passing: list[tuple[float, float]] = []
        for robot in self.robots:
            left = self.team.starts[robot][0] < middle
            goals = [*visited.get(robot, ()), *([f"end {robot}"] if robot in self.team.ends else [])]
            beyond = [goal for goal in goals if (self._points[self._index[goal]][:, 0].mean() < middle) != left]
            if beyond:
                to = float(self._far[np.ix_(self._index[f"start {robot}"], at)].min())
                passing.append((to, max(float(self._far[np.ix_(at, self._index[goal])].min()) for goal in beyond)))
        return min((_in_order(order, gap) for order in itertools.permutations(passing)), default=0.0)

    @cached_property
    def _index(self) -> dict[str, NDArray[np.intp]]:
        groups = {name: len(points) for name, points in self._groups.items()}
        ends = np.cumsum(list(groups.values()))
        return {name: np.arange(end - count, end) for (name, count), end in zip(groups.items(), ends, strict=True)}

    @cached_property
    def _groups(self) -> dict[str, Floats]:
        team = self.team
        groups = {f"start {name}": np.array([point]) for name, point in team.starts.items()}
        groups |= {f"end {name}": np.array([point]) for name, point in team.ends.items()}
        groups |= {name: _rim(box.grown(-MARGIN)) for name, box in team.places.items()}
        for door in team.doors:
            low, high = door.side[0] + CLEARANCE, door.side[1] - CLEARANCE
            ys = np.linspace(low, high, 2 + int((high - low) / _SIDE))
            groups[f"door {door.wall}"] = np.column_stack([np.full(len(ys), sum(door.wall) / 2), ys])
        return groups

    @cached_property
    def _points(self) -> Floats:
        return np.concatenate([*self._groups.values(), *(_rounded(box, by) for box, by in self._bodies)])

    @cached_property
    def _bodies(self) -> list[tuple[Box, float]]:
        """Boxes to keep out of, and by how much, m."""
        bodies = [(box, CLEARANCE) for box in self.team.solid] + [(box, MARGIN) for box in self.beside]
        if self.team.kind == "avoid":
            kept_out = next(iter(set(self.team.places) - set(self.shared)))
            bodies.append((self.team.places[kept_out], MARGIN))
        return bodies

    @cached_property
    def _far(self) -> Floats:
        """Least lengths between all points, m."""
        points, hall = self._points, self.team.hall.grown(-MARGIN)
        inside = np.all((points >= np.array(hall.low) - _ROUNDING) & (points <= np.array(hall.high) + _ROUNDING), axis=1)
        one, other = np.triu_indices(len(points), 1)
        free = inside[one] & inside[other]
        one, other = one[free], other[free]
        for box, by in self._bodies:
            clear = ~_crosses(points[one], points[other], _rounded(box, by))
            one, other = one[clear], other[clear]
        lengths = np.full((len(points), len(points)), np.inf)
        lengths[one, other] = lengths[other, one] = np.linalg.norm(points[one] - points[other], axis=1)
        np.fill_diagonal(lengths, 0.0)
        return shortest_path(np.where(lengths == 0.0, _ROUNDING**2, lengths), directed=False)


def _in_order(order: Sequence[tuple[float, float]], gap: float) -> float:
    """Return when the last of some robots arrives that pass a door in an order, a length apart."""
    passed, latest = -np.inf, 0.0
    for to, after in order:
        passed = max(to, passed + gap)
        latest = max(latest, passed + after)
    return latest


def _rim(box: Box) -> Floats:
    """Return points around a box. Shape (n, 2)."""
    (a, b), (c, d) = box.low, box.high
    xs, ys = (np.linspace(p, q, 2 + int((q - p) / _SIDE)) for p, q in ((a, c), (b, d)))
    sides = [(xs, np.full_like(xs, b)), (xs, np.full_like(xs, d)), (np.full_like(ys, a), ys), (np.full_like(ys, c), ys)]
    return np.unique(np.concatenate([np.column_stack(side) for side in sides]), axis=0)


def _rounded(box: Box, by: float) -> Floats:
    """Return the corners of a polygon within a box that is grown by a radius, against the clock. Shape (n, 2)."""
    corners: list[Point] = [(box.high[0], box.high[1]), (box.low[0], box.high[1]), box.low, (box.high[0], box.low[1])]
    arcs = np.linspace(0.0, np.pi / 2, _ARC)
    return np.concatenate(
        [
            np.array(corner) + by * np.column_stack([np.cos(turn + arcs), np.sin(turn + arcs)])
            for corner, turn in zip(corners, np.arange(4) * np.pi / 2, strict=True)
        ]
    )


def _crosses(starts: Floats, ends: Floats, corners: Floats) -> NDArray[np.bool_]:
    """Tell which segments have an inner point of a convex polygon, by Cyrus and Beck. Shapes (n, 2), (n, 2), (corners, 2)."""
    along = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]  # outwards
    levels = np.sum(normals * corners, axis=1) - _ROUNDING
    before, ways = starts @ normals.T - levels, (ends - starts) @ normals.T
    with np.errstate(divide="ignore", invalid="ignore"):
        at = -before / ways
    first = np.max(np.where(ways < 0, at, np.where((ways == 0) & (before > 0), np.inf, 0.0)), axis=1).clip(0.0)
    last = np.min(np.where(ways > 0, at, 1.0), axis=1).clip(max=1.0)
    return first < last
