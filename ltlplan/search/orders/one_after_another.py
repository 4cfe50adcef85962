"""Courses of events in which one robot after another flies its whole word, and then rests, for teams whose product is too large to be searched.

Such courses are a few of all, so that none of them proves nothing. A robot that has landed shows one letter for good; of nodes whose letters
do the same to the formula one stands for all, so that what is told apart is one robot and what the others hold.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

from ltlplan.logic.budget import Budget
from ltlplan.search.numbering import Numbers
from ltlplan.search.orders.helped_robots import HelpedRobots
from ltlplan.search.orders.reading import Course, Events, Nodes
from ltlplan.search.orders.state_sets import Known, Reading, Shown
from ltlplan.search.reduced_graph import staying
from ltlplan.search.team_reading import UNREACHABLE, Step, TeamReading, complete, least_sum
from ltlplan.systems.transition_systems import TransitionSystem

_Place = tuple[int, bool, Nodes, Known]
"""How many robots have taken off, whether the last of them flies, the nodes of all, and what is known of the formula."""


class OneAfterAnother(TeamReading):
    """Robots that fly in one order, each after the one before has landed; under `own`.

    Args:
        systems: One for each robot.
        shown: For each of them what it shows at each node.
        reading: How the formula reads their events.
    """

    ties = "farthest"

    def __init__(self, systems: Sequence[TransitionSystem], shown: Sequence[Sequence[Shown]], reading: Reading) -> None:
        self._events = Events(systems, shown, reading)
        self._flying = HelpedRobots(systems, shown, reading)
        self._landed = HelpedRobots([staying(system) for system in systems], shown, reading)
        self._standing: list[dict[object, int]] = [{} for _ in systems]
        self._order: Sequence[int] = ()
        self._places: Numbers[_Place] = Numbers()

    def cheapest(self, order: Sequence[int], budget: Budget) -> Course | None:
        """Return a cheapest course in one order of the robots, or None where none was found.

        Args:
            order: All robots, by index.
            budget: Bound on the states that may be expanded.
        """
        self._order, self._places = order, Numbers()
        found = least_sum(self, budget)
        if not found.states:
            return None
        path = [self._places.known[state] for state in found.states]
        steps = [
            (self._order[now[0] - 1], now[2][self._order[now[0] - 1]])
            for before, now in itertools.pairwise(path)
            if before[1] and now[1]
        ]
        return Course(tuple(steps), found.total, len(self._places))

    def begin(self) -> int | None:
        """Return where all robots start; None where the formula is lost there."""
        first = self._events.begin()
        return None if first is None else self._places[0, False, *first]

    def steps(self, state: int) -> Iterator[Step]:
        """Yield where a step of the robot that flies leads, its landing, or the next one's taking off; and its cost."""
        begun, flies, nodes, known = self._places.known[state]
        if not flies:
            ends = [self._events.systems[robot].ending(nodes[robot]) for robot in self._order[begun:]]
            if None not in ends and self._events.reading.accepting(known):
                yield complete(state), sum(end for end in ends if end is not None), None
            if begun < len(self._order):
                yield self._places[begun + 1, True, nodes, known], 0.0, None
            return
        robot = self._order[begun - 1]
        here = nodes[robot]
        end = self._events.systems[robot].ending(here)
        if end is not None:
            stands = self._standing[robot].setdefault(self._events.reading.effect(self._events.shown[robot][here]), here)
            yield self._places[begun, False, (*nodes[:robot], stands, *nodes[robot + 1 :]), known], end, None
        for after, cost in self._events.steps(robot, (nodes, known)):
            yield self._places[begun, True, *after], cost, robot

    def left(self, state: int) -> float:
        """Return what robots that have not landed pay at the least; `UNREACHABLE` where one that has can not stay as it is."""
        begun, flies, nodes, known = self._places.known[state]
        landed = self._order[: begun - flies]
        if any(self._landed.left(robot, nodes[robot], known) == UNREACHABLE for robot in landed):
            return UNREACHABLE
        return sum(self._flying.left(robot, nodes[robot], known) for robot in self._order[begun - flies :])
