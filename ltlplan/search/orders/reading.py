"""Events of a team as a search for plans walks them: a course of steps of single robots all of whose team words satisfy the formula.

A state is the node of every robot's system and what is possible: one event of one robot leads to the next. Words that satisfy under a strict
partial order of their events do so under each total order that it leaves open, so where no course is found there are no words and no
precedences. For n robots this is the product of all their systems, which the search for plans that hold in every order does without;
so it is asked only where there is none, and within a budget of its own.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import add

from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.label_setting import Costs, Label
from ltlplan.search.numbering import Numbers
from ltlplan.search.orders.state_sets import Known, Reading, Shown, shown_at
from ltlplan.search.team_reading import Found, PaidApart, Step, complete, least_highest, least_sum
from ltlplan.systems.transition_systems import TransitionSystem

Nodes = tuple[int, ...]
Place = tuple[Nodes, Known]

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


class Events:
    """Single events of a team: where they begin, and what is known of the formula after each.

    Args:
        systems: One for each robot.
        shown: For each of them what it shows at each node.
        reading: How the formula reads their events.
    """

    def __init__(self, systems: Sequence[TransitionSystem], shown: Sequence[Sequence[Shown]], reading: Reading) -> None:
        self.systems, self.shown, self.reading = systems, shown, reading

    def begin(self) -> Place | None:
        """Return where all robots start; None where the formula is lost there."""
        nodes = tuple(system.initial for system in self.systems)
        first = self.reading.begin(self._letters(nodes))
        return None if first is None else (nodes, first)

    def steps(self, robot: int, place: Place) -> Iterator[tuple[Place, float]]:
        """Yield where steps of one robot lead after which the formula is not lost, and what they cost.

        Args:
            robot: By index.
            place: The nodes of all robots, and what is known there.
        """
        nodes, known = place
        system, here = self.systems[robot], nodes[robot]
        for target, cost in system.edges[here]:
            moved = (*nodes[:robot], target, *nodes[robot + 1 :])
            after: Known | None = known
            if is_event(system, here, target):
                after = self.reading.after(known, self._letters(moved), robot)
            if after is not None and target != here:
                yield (moved, after), cost

    def _letters(self, nodes: Nodes) -> tuple[Shown, ...]:
        return tuple(own[node] for own, node in zip(self.shown, nodes, strict=True))


class EventReading(PaidApart):
    """The states that courses of events go through: the nodes of all robots, and what is known of the formula there.

    Args:
        systems: One for each robot.
        shown: For each of them what it shows at each node.
        reading: How the formula reads their events.
    """

    def __init__(self, systems: Sequence[TransitionSystem], shown: Sequence[Sequence[Shown]], reading: Reading) -> None:
        self._events, self.kept_apart = Events(systems, shown, reading), len(systems)
        self._places: Numbers[Place] = Numbers()

    def cheapest(self, budget: Budget) -> Course | None:
        """Return a cheapest course, or None where there is none.

        Args:
            budget: Bound on the states that may be expanded.

        Raises:
            TooLarge: The budget was used up; nothing is known.
        """
        found = least_sum(self, budget)
        if found.stopped is not None:
            hint = "Simplify the formula, or use fewer robots."
            raise TooLarge("Whether precedences between robots help takes", found.explored, "states", budget.states, hint)
        return self._course(found)

    def of_least_highest(self, budget: Budget, below: float) -> tuple[Course | None, float]:
        """Return a course whose robot with the highest cost pays least, if that is below a limit.

        Args:
            budget: Bound on the paths to states that may be gone on with.
            below: The highest cost is to be less.

        Returns:
            None where no such course was found; and a lower bound on the highest cost, where that is below the limit.
        """
        found = least_highest(self, budget, below=below, rounding=_ROUNDING)
        return self._course(found), found.bound

    def begin(self) -> int | None:
        """Return where all robots start; None where the formula is lost there."""
        first = self._events.begin()
        return None if first is None else self._places[first]

    def steps(self, state: int) -> Iterator[Step]:
        """Yield where a step of one robot leads, its cost, and who makes it; first what ending there costs each robot, where all may."""
        place = nodes, known = self._places.known[state]
        if self._events.reading.accepting(known):
            ends = [s.ending(n) for s, n in zip(self._events.systems, nodes, strict=True)]
            if None not in ends:
                yield complete(state), sum(end for end in ends if end is not None), tuple(ends)
        for robot in range(len(nodes)):
            for after, cost in self._events.steps(robot, place):
                yield self._places[after], cost, robot

    def pay(self, label: Label[int], cost: float, who: object) -> Iterator[tuple[Costs, object]]:
        """Yield what each robot has paid after a step.

        Args:
            label: Of the state before the step.
            cost: Of the step.
            who: The robot; where all end, what that costs each of them.
        """
        each = who if isinstance(who, tuple) else [cost * (robot == who) for robot in range(len(label.paid))]
        yield tuple(map(add, label.paid, each)), who

    def rank(self, _: int, paid: Costs, total: float) -> tuple[float, ...]:
        """Return the highest cost, then the sum.

        Args:
            _: The state, of which nothing is known.
            paid: What each robot has paid.
            total: The sum.
        """
        return max(paid), total

    def _course(self, found: Found) -> Course | None:
        if not found.states:
            return None
        path = [self._places.known[state][0] for state in found.states]
        return Course(steps_along(path), found.total, len(self._places))


def shown_by(marks: Marks, systems: Sequence[TransitionSystem]) -> list[list[Shown]]:
    """Return what each robot shows at each node of its system."""
    return [[shown_at(marks, system, node) for node in range(len(system.labels))] for system in systems]


def is_event(system: TransitionSystem, here: int, target: int) -> bool:
    """Tell whether a robot that goes from one node to another comes to another letter.

    Args:
        system: The robot's.
        here: The node that it leaves.
        target: The one that it comes to.
    """
    return system.labels[target] != system.labels[here]


def steps_along(path: Sequence[Nodes]) -> tuple[tuple[int, int], ...]:
    """Return who moves, and where to, along what all robots are at.

    Args:
        path: Nodes of all robots, one after another; one of them differs at the most.
    """
    pairs = itertools.pairwise(path)
    return tuple((robot, b) for old, new in pairs for robot, (a, b) in enumerate(zip(old, new, strict=True)) if a != b)
