"""The cheapest course of events all of whose team words satisfy the formula.

A state is (node of every robot's system, what is possible): one event of one robot leads to the next. Words that satisfy under a strict
partial order of their events do so under each total order that it leaves open, so where no course is found there are no words and no
precedences. For n robots this is the product of all their systems, which the search for plans that hold in every order does without;
so it is asked only where there is none, and within a budget of its own.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ltlplan.logic.budget import TooLarge
from ltlplan.search.best_first import BestFirst
from ltlplan.search.partial_orders.reachable_state_sets import Known, Reading, Shown
from ltlplan.systems.transition_systems import TransitionSystem

Nodes = tuple[int, ...]
Place = tuple[Nodes, Known]

_END = -1
_ROUNDING = 1e-9  # by which sums of the same costs may differ


@dataclass(frozen=True, slots=True)
class Course:
    """Steps of robots, one after another.

    Attributes:
        steps: (robot, node that it comes to).
        cost: The sum of all steps.
        reached: States that were seen.
    """

    steps: tuple[tuple[int, int], ...]
    cost: float
    reached: int


def cheapest_course(
    systems: Sequence[TransitionSystem], shown: Sequence[Sequence[Shown]], reading: Reading, most: int
) -> Course | None:
    """Return a cheapest course all of whose team words satisfy the formula, or None where there is none.

    Args:
        systems: One for each robot.
        shown: For each of them what it shows at each node.
        reading: How the formula reads their events.
        most: States that may be expanded.

    Raises:
        TooLarge: More states would have to be expanded; nothing is known.
    """
    walk = Walk(systems, shown, reading)
    begin = walk.begin()
    if begin is None:
        return None
    places: list[Place] = [begin]
    index = {begin: 0}

    def successors(key: int) -> Iterator[tuple[int, float]]:
        if key == _END:
            return
        ends = walk.ends(places[key])
        if ends is not None:
            yield _END, sum(ends)
        for _, cost, place in walk.steps(places[key]):
            target = index.get(place)
            if target is None:
                target = index[place] = len(places)
                places.append(place)
            yield target, cost

    search = BestFirst([0], successors, ties="first")
    for expanded, (key, cost, _) in enumerate(search, start=1):
        if key == _END:
            path = [places[at][0] for at in search.path(key)[:-1]]
            return Course(tuple(_steps(path)), cost, len(places))
        if expanded > most:
            raise TooLarge(
                "Whether precedences between robots help takes",
                expanded,
                "states",
                most,
                "Simplify the formula, or use fewer robots.",
            )
    return None


@dataclass(frozen=True, slots=True)
class DearestCourse:
    """What a search for a course whose dearest robot pays least found.

    Attributes:
        course: The course; None where there is none below the limit, or none was found.
        bound: In no course does the dearest robot pay less, where that is below the limit; infinite where there is none below it.
    """

    course: Course | None
    bound: float


def course_of_least_dearest(  # as `cheapest_course`, and the limit
    systems: Sequence[TransitionSystem], shown: Sequence[Sequence[Shown]], reading: Reading, most: int, below: float
) -> DearestCourse:
    """Return a course all of whose team words satisfy the formula and whose dearest robot pays least, if that is below a limit.

    What each robot has paid is kept apart. Of two ways to a place only one that is cheaper for some robot is gone on with (a search with several
    objectives: Martins 1984).

    Args:
        systems: One for each robot.
        shown: For each of them what it shows at each node.
        reading: How the formula reads their events.
        most: Ways to places that may be gone on with.
        below: What the dearest robot is to pay less than.
    """
    walk = Walk(systems, shown, reading)
    begin = walk.begin()
    if begin is None:
        return DearestCourse(None, math.inf)
    paid = (0.0,) * len(systems)
    ways: list[tuple[Place | None, int]] = [(begin, -1)]  # None for the end; the way before
    fronts: dict[Place, list[tuple[float, ...]]] = {}
    heap: list[tuple[float, float, int, tuple[float, ...]]] = [(0.0, 0.0, 0, paid)]
    expanded = 0
    while heap:
        dearest, total, way, paid = heapq.heappop(heap)
        place, _ = ways[way]
        if place is None:
            return DearestCourse(Course(tuple(_steps(_nodes_along(ways, way))), total, len(ways)), dearest)
        front = fronts.setdefault(place, [])
        if any(all(a <= b + _ROUNDING for a, b in zip(known, paid, strict=True)) for known in front):
            continue
        front.append(paid)
        expanded += 1
        if expanded > most:
            return DearestCourse(None, dearest)
        following: list[tuple[Place | None, tuple[float, ...]]] = [
            (after, _paying(paid, robot, cost)) for robot, cost, after in walk.steps(place)
        ]
        ends = walk.ends(place)
        if ends is not None:
            following.append((None, tuple(a + b for a, b in zip(paid, ends, strict=True))))
        for after, then in following:
            if max(then) < below:
                ways.append((after, way))
                heapq.heappush(heap, (max(then), sum(then), len(ways) - 1, then))
    return DearestCourse(None, math.inf)


def _paying(paid: tuple[float, ...], robot: int, cost: float) -> tuple[float, ...]:
    return (*paid[:robot], paid[robot] + cost, *paid[robot + 1 :])


def _nodes_along(ways: Sequence[tuple[Place | None, int]], end: int) -> list[Nodes]:
    """Return the nodes of all robots along a way that has come to the end."""
    found: list[Nodes] = []
    way = ways[end][1]
    while way >= 0:
        place, way = ways[way]
        assert place is not None  # only the last one is the end
        found.append(place[0])
    return found[::-1]


class Walk:
    """The places that courses go through: the nodes of all robots, and what is known of the formula there.

    Args:
        systems: One for each robot.
        shown: For each of them what it shows at each node.
        reading: How the formula reads their events.
    """

    def __init__(self, systems: Sequence[TransitionSystem], shown: Sequence[Sequence[Shown]], reading: Reading) -> None:
        self._systems, self._shown, self._reading = systems, shown, reading

    def begin(self) -> Place | None:
        """Return where all robots start; None where the formula is lost there."""
        nodes = tuple(system.initial for system in self._systems)
        first = self._reading.begin(self._letters(nodes))
        return None if first is None else (nodes, first)

    def steps(self, place: Place) -> Iterator[tuple[int, float, Place]]:
        """Yield who may go on, at what cost, and where that leads."""
        nodes, known = place
        for robot, system in enumerate(self._systems):
            here = nodes[robot]
            for target, cost in system.edges[here]:
                moved = (*nodes[:robot], target, *nodes[robot + 1 :])
                if not is_event(system, here, target):
                    if target != here:
                        yield robot, cost, (moved, known)
                    continue
                after = self._reading.after(known, self._letters(moved), robot)
                if after is not None:
                    yield robot, cost, (moved, after)

    def ends(self, place: Place) -> tuple[float, ...] | None:
        """Return what it costs each robot to end there; None where some may not, or the formula is not kept."""
        nodes, known = place
        if not self._reading.accepting(known):
            return None
        ends = [0.0 if s.final is None else s.final.get(n) for s, n in zip(self._systems, nodes, strict=True)]
        return None if None in ends else tuple(end for end in ends if end is not None)

    def _letters(self, nodes: Nodes) -> tuple[Shown, ...]:
        return tuple(own[node] for own, node in zip(self._shown, nodes, strict=True))


def is_event(system: TransitionSystem, here: int, target: int) -> bool:
    """Tell whether a robot that goes from one node to another comes to another letter.

    Args:
        system: The robot's.
        here: The node that it leaves.
        target: The one that it comes to.
    """
    return system.labels[target] != system.labels[here]


def _steps(path: Sequence[Nodes]) -> Iterator[tuple[int, int]]:
    for before, after in itertools.pairwise(path):
        yield next((robot, b) for robot, (a, b) in enumerate(zip(before, after, strict=True)) if a != b)
