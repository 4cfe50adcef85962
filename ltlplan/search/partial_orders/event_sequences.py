"""The cheapest course of events all of whose team words satisfy the formula.

A state is (node of every robot's system, what is possible): one event of one robot leads to the next. Words that satisfy under a strict
partial order of their events do so under each total order that it leaves open, so where no course is found there are no words and no
precedences. For n robots this is the product of all their systems, which the search for plans that hold in every order does without;
so it is asked only where there is none, and within a budget of its own.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import add

from ltlplan.logic.budget import TooLarge
from ltlplan.search.label_setting import Costs, Label
from ltlplan.search.partial_orders.reachable_state_sets import Known, Reading, Shown
from ltlplan.search.team_reading import Found, Step, complete, least_highest, least_sum
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


def cheapest_course(
    systems: Sequence[TransitionSystem], shown: Sequence[Sequence[Shown]], reading: Reading, most: int
) -> Course | None:
    """Return a cheapest course all of whose team words satisfy the formula, or None where there is none.

    Args:
        systems: One for each robot.
        shown: For each of them what it shows at each node.
        reading: How the formula reads their events.
        most: Places that may be expanded.

    Raises:
        TooLarge: The budget was used up; nothing is known.
    """
    events = EventReading(systems, shown, reading)
    found = least_sum(events, most)
    if found.stopped is not None:
        hint = "Simplify the formula, or use fewer robots."
        raise TooLarge("Whether precedences between robots help takes", found.explored, "states", most, hint)
    return events.course(found)


def course_of_least_dearest(  # as `cheapest_course`, and the limit
    systems: Sequence[TransitionSystem], shown: Sequence[Sequence[Shown]], reading: Reading, most: int, below: float
) -> tuple[Course | None, float]:
    """Return a course all of whose team words satisfy the formula and whose robot with the highest cost pays least, if that is below a limit.

    Args:
        systems: One for each robot.
        shown: For each of them what it shows at each node.
        reading: How the formula reads their events.
        most: Paths to places that may be gone on with.
        below: The highest cost is to be less.

    Returns:
        None where no such course was found; and a lower bound on the highest cost, where that is below the limit.
    """
    events = EventReading(systems, shown, reading)
    found = least_highest(events, most, below=below, rounding=_ROUNDING)
    return events.course(found), found.bound


class EventReading:
    """The states that courses of events go through: the nodes of all robots, and what is known of the formula there.

    Args:
        systems: One for each robot.
        shown: For each of them what it shows at each node.
        reading: How the formula reads their events.
    """

    def __init__(self, systems: Sequence[TransitionSystem], shown: Sequence[Sequence[Shown]], reading: Reading) -> None:
        self._systems, self._shown, self._reading = systems, shown, reading
        self._places: list[Place] = []
        self._numbers: dict[Place, int] = {}

    def begin(self) -> int | None:
        """Return where all robots start; None where the formula is lost there."""
        nodes = tuple(system.initial for system in self._systems)
        first = self._reading.begin(self._letters(nodes))
        return None if first is None else self._number(nodes, first)

    def steps(self, state: int) -> Iterator[Step]:
        """Yield where a step of one robot leads, its cost, and who makes it; first what ending there costs each robot, where all may."""
        nodes, known = self._places[state]
        if self._reading.accepting(known):
            ends = [0.0 if s.final is None else s.final.get(n) for s, n in zip(self._systems, nodes, strict=True)]
            if None not in ends:
                yield complete(state), sum(end for end in ends if end is not None), tuple(ends)
        for robot, system in enumerate(self._systems):
            here = nodes[robot]
            for target, cost in system.edges[here]:
                moved = (*nodes[:robot], target, *nodes[robot + 1 :])
                if not is_event(system, here, target):
                    if target != here:
                        yield self._number(moved, known), cost, robot
                    continue
                after = self._reading.after(known, self._letters(moved), robot)
                if after is not None:
                    yield self._number(moved, after), cost, robot

    def left(self, _: int) -> float:
        """Return 0: nothing is known of what is left."""
        return 0.0

    def holds(self, _: int) -> bool:
        """Tell that every complete course satisfies the formula."""
        return True

    def nothing_paid(self) -> Costs:
        """Return no cost for any robot."""
        return (0.0,) * len(self._systems)

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

    def course(self, found: Found) -> Course | None:
        """Return the course that a search found; None where there is none."""
        if not found.states:
            return None
        path = [self._places[state][0] for state in found.states]
        return Course(tuple(_steps(path)), found.total, len(self._places))

    def _number(self, nodes: Nodes, known: Known) -> int:
        number = self._numbers.setdefault((nodes, known), len(self._places))
        if number == len(self._places):
            self._places.append((nodes, known))
        return number

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
