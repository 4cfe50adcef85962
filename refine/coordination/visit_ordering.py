"""An order in which robots fly to their visits so that nobody rests where another one comes to rest, and few rest where others pass.

Robots that share a small region, or a way, cannot all fly when they please; departures alone find no order of their visits. Here it is looked
for among straight ways between the places of visits, one robot flying at a time while the others rest at theirs (a search over how
far each of them has come). Visits of which neither way comes near the other may then be made at the same time.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from verify.data import Plan, RobotPlan
from verify.data.plan import Meeting, Precedence

Floats = NDArray[np.float64]
Turn = tuple[str, int]
"""A robot and one of its visits: it flies to it."""

_STEP = 0.05
"""m between samples of a way."""
_ASIDE = 0.15
"""m beyond what robots keep that ways which are flown at the same time are apart: smooth paths leave straight ones."""
_STATES = 20_000
"""Of the search."""


@dataclass(frozen=True, slots=True)
class _Way:
    """Way of a robot to a visit: the robot and the visit, and samples of the way; the last is where it rests. Shape (samples, 3)."""

    turn: Turn
    points: Floats


class Turns:
    """The visits of a team, and which of them are in each other's way.

    Args:
        plan: Its visits lie where they will be made.
        distance: m that robots keep.
        z_scale: Distances in z count this many times.
    """

    def __init__(self, plan: Plan, distance: float, z_scale: float) -> None:
        self._plan, self._distance = plan, distance
        scale = np.array([1.0, 1.0, z_scale])
        self._ways = {name: _ways(name, robot, scale) for name, robot in plan.robots.items()}
        self._starts = {name: np.array(robot.waypoints[0].position) * scale for name, robot in plan.robots.items()}
        self._names = [name for name, ways in self._ways.items() if ways]
        self._before = {name: _waits(plan, name) for name in plan.robots}
        self._near: dict[tuple[str, int, str, int], tuple[bool, bool]] = {}

    def order(self) -> list[Turn] | None:
        """Return an order of all visits that keeps the plan's waits, in which as few robots as can be rest in another one's way; None where none is found."""
        first = tuple(0 for _ in self._names)
        last = tuple(len(self._ways[name]) for name in self._names)
        heap: list[tuple[int, tuple[int, ...], tuple[int, ...]]] = [(0, (), first)]
        seen: set[tuple[int, ...]] = set()
        while heap and len(seen) < _STATES:
            blocked, moved, at = heapq.heappop(heap)
            if at in seen:
                continue
            seen.add(at)
            if at == last:
                done = dict.fromkeys(self._names, 0)
                order: list[Turn] = []
                for who in moved:
                    name = self._names[who]
                    order.append(self._ways[name][done[name]].turn)
                    done[name] += 1
                return order
            for who, name in enumerate(self._names):
                if at[who] == last[who] or not self._may(name, at):
                    continue
                in_the_way = self._in_the_way(who, at)
                after = (*at[:who], at[who] + 1, *at[who + 1 :])
                if in_the_way is not None and after not in seen:
                    heapq.heappush(heap, (blocked + in_the_way, (*moved, who), after))
        return None

    def share_places(self) -> bool:
        """Return whether two robots make visits at places that are too near each other to be made at one time."""
        ends = {name: np.array([way.points[-1] for way in self._ways[name]]) for name in self._names}
        return any(_apart(ends[one], ends[other]) < self._distance for one, other in itertools.combinations(self._names, 2))

    def meetings(self, order: Sequence[Turn]) -> tuple[Meeting, ...]:
        """Return the plan's meetings and those that keep an order where the ways of two visits come near each other.

        Args:
            order: Of all visits.
        """
        import networkx as nx  # here: it takes long to load, and few plans need it

        ways = {way.turn: way for each in self._ways.values() for way in each}
        starts = {
            each[i].turn: each[i - 1].points[-1:] if i else self._starts[name][None]
            for name, each in self._ways.items()
            for i in range(len(each))
        }
        flown = {turn: np.concatenate([starts[turn], way.points]) for turn, way in ways.items()}
        graph: nx.DiGraph[Turn] = nx.DiGraph()
        graph.add_nodes_from(order)
        graph.add_edges_from(pair for name in self._names for pair in itertools.pairwise(way.turn for way in self._ways[name]))
        own = set(graph.edges)
        for one, other in itertools.combinations(order, 2):
            if one[0] != other[0] and _apart(flown[one], flown[other]) < self._distance + _ASIDE:
                graph.add_edge(one, other)
        more = [pair for pair in nx.transitive_reduction(graph).edges if pair not in own and pair[0][0] != pair[1][0]]
        place = {turn: number for number, turn in enumerate(order)}
        more.sort(key=lambda pair: (place[pair[0]], place[pair[1]]))
        return tuple(dict.fromkeys((*self._plan.meetings, *(Meeting(first=first, then=then) for first, then in more))))

    def _may(self, name: str, at: tuple[int, ...]) -> bool:
        """Return whether all that a robot waits for has happened."""
        who = self._names.index(name)
        visit = self._ways[name][at[who]].turn[1]
        for other, reached in self._before[name].get(visit, ()):
            if other in self._names:
                ways, come = self._ways[other], at[self._names.index(other)]
                if come < len(ways) and ways[come].turn[1] <= reached:
                    return False
        return True

    def _in_the_way(self, who: int, at: tuple[int, ...]) -> int | None:
        """Return how many robots rest near a robot's next way; None where one rests where it comes to."""
        count = 0
        name = self._names[who]
        for other in self._plan.robots:
            if other == name:
                continue
            place = at[self._names.index(other)] if other in self._names else 0
            near, met = self._meets(name, at[who], other, place)
            if met:
                return None
            count += near
        return count

    def _meets(self, name: str, way: int, other: str, place: int) -> tuple[bool, bool]:
        """Return whether a way comes too near where another robot rests, and whether it ends there."""
        key = name, way, other, place
        if key not in self._near:
            rests = self._ways[other][place - 1].points[-1] if place else self._starts[other]
            gaps = np.linalg.norm(self._ways[name][way].points - rests, axis=1)
            self._near[key] = bool(gaps.min() < self._distance), bool(gaps[-1] < self._distance)
        return self._near[key]


def _ways(name: str, robot: RobotPlan, scale: Floats) -> list[_Way]:
    """Return a robot's ways from visit to visit; the last one leads on to where it ends. None to a visit that it starts in."""
    points = [np.array(waypoint.position) * scale for waypoint in robot.waypoints]
    found: list[_Way] = []
    at = 0
    for visit in range(len(robot.visits)):
        reached = max((i for i, waypoint in enumerate(robot.waypoints) if waypoint.visit == visit), default=at)
        reached = max(at, reached)
        if visit == len(robot.visits) - 1:
            reached = len(points) - 1
        if reached > at or found:
            found.append(_Way((name, visit), _sampled(points[at : reached + 1])))
        at = reached
    return found


def _sampled(points: Sequence[Floats]) -> Floats:
    """Return points along straight legs, those at their ends included, but for the first. Shape (samples, 3)."""
    parts = [points[-1][None]]
    for a, b in reversed(list(itertools.pairwise(points))):
        count = max(1, int(np.ceil(float(np.linalg.norm(b - a)) / _STEP)))
        parts.append(a + np.arange(1, count + 1)[:, None] / count * (b - a))
    return np.concatenate(parts[::-1])


def _apart(one: Floats, other: Floats) -> float:
    return float(np.sqrt(((one[:, None] - other[None]) ** 2).sum(axis=2).min()))


def _waits(plan: Plan, name: str) -> Mapping[int, list[Turn]]:
    """Return for a robot's visits what is to be reached before it sets out for them: other robots' visits."""
    found: dict[int, list[Turn]] = {}
    for meeting in plan.meetings:
        if meeting.then[0] == name:
            found.setdefault(meeting.then[1], []).append(meeting.first)
    for wait in plan.precedences:
        if wait.then[0] == name:
            (other, visit), then = wait.first, wait.then[1] + (wait.due == "leaves")
            found.setdefault(then, []).append((other, _gone(plan, wait) if wait.done == "left" else visit))
    return found


def _gone(plan: Plan, wait: Precedence) -> int:
    """Return the visit at which a robot has left another one."""
    other, visit = wait.first
    return min(visit + 1, len(plan.robots[other].visits) - 1)
