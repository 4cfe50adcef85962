"""The reading of formulas that count robots: a state is how many robots rest in each class of places (counter abstraction: Pnueli, Xu and Zuck 2002).

For n robots of one kind and p places there are at most (n + p over p) times the automata's states, where the product of the robots has p to the
power n. One robot moves at a time, and the conjuncts read the team's letters on its way. Starts of robots that can do the same from there are first
one class, at the cost of the nearest: costs are then lower bounds, and `symmetry_classes` assigns moves to robots afterwards.

For the highest cost, each robot's payments are kept in the order of its class, then of its cost: robots of one class that have paid the same are
interchangeable.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import add

from ltlplan.search import numbering
from ltlplan.search.bounds.goal_cover import GoalCover
from ltlplan.search.counting.classes import Classes, ClassMove, Numbers
from ltlplan.search.counting.counting_propositions import States, Sums
from ltlplan.search.label_setting import Costs, Label
from ltlplan.search.memoization import memoized
from ltlplan.search.team_reading import UNREACHABLE, Found, PaidApart, Step, complete, is_complete

_Place = tuple[States, Numbers, Sums]


@dataclass(frozen=True, slots=True)
class Course:
    """Moves in an order that satisfies the formula.

    Attributes:
        moves: One robot's move after another's.
        cost: The objective: their sum, or the highest cost of a robot.
        robots: The robot that makes each move, where the search kept that apart.
    """

    moves: tuple[ClassMove, ...]
    cost: float
    robots: tuple[int, ...] = ()


class CountReading(PaidApart):
    """A team whose robots are counted, for `least_sum` and `least_highest`.

    Of equal bounds the state comes first at which most was paid, then the latest one, as states are negative: robots that have nothing to do
    with each other finish one after another, and not in all orders.

    Args:
        classes: The team's abilities.
        cover: Lower bounds of these classes.
        below: The highest cost is to be less.
        greed: Weight of what is left for each robot, beside the bound on the highest cost; above 0 any cheaper course is found sooner.
    """

    ties = "farthest"

    def __init__(self, classes: Classes, cover: GoalCover, *, below: float = UNREACHABLE, greed: float = 0.0) -> None:
        self._classes, self._marks, self._crowds = classes, classes.marks, classes.crowds
        self._cover, self._below, self._greed = cover, below, greed
        self.kept_apart = sum(classes.begin)
        self._places = numbering.Numbers[_Place]()

    @property
    def reached(self) -> int:
        """Number of states that were seen."""
        return len(self._places)

    def begin(self) -> int | None:
        """Return the state in which all robots are at their starts; None where the formula is violated there."""
        sums = self._classes.sums(self._classes.begin)
        first = self._marks.read(self._marks.initial, sums)
        return None if first is None else -self._places[first, self._classes.begin, sums]

    def steps(self, state: int) -> Iterator[Step]:
        """Yield the states after one robot's move, its cost and the `ClassMove`; first the end of the plan, where it may end."""
        states, numbers, sums = self._places.known[-state]
        excess = [sum(numbers[number] for number in crowd.classes) - crowd.most for crowd in self._crowds]
        crowded = next((crowd.classes for crowd, more in zip(self._crowds, excess, strict=True) if more > 0), None)
        if crowded is None and self._marks.accepting(states) and self._classes.may_end(numbers):
            yield complete(state), 0.0, None
        for place, count in enumerate(numbers):
            for change in self._classes.changes[place] if count and (crowded is None or place in crowded) else ():
                if change.entered and any(excess[k] >= int(self._crowds[k].passing) for k in change.entered):
                    continue
                after = self._after(states, sums, change.letters)
                if after is not None:
                    moved = list(numbers)
                    moved[place] -= 1
                    moved[change.move.target] += 1
                    target = self._places[after, tuple(moved), tuple(map(add, sums, change.letters[-1]))]
                    yield -target, change.move.cost, change.move

    @memoized
    def left(self, state: int) -> float:
        """Return a lower bound on the sum of the costs that are left."""
        states, numbers, sums = self._places.known[-state]
        return self._cover(states, sums, numbers)

    def pay(self, label: Label[int], cost: float, who: object) -> Iterator[tuple[Costs, object]]:
        """Yield the robots' costs after a move, for each robot of the class that can make it, and that robot's place among them.

        Args:
            label: Of the state before the move.
            cost: Of the move.
            who: The `ClassMove`; None where the plan ends.
        """
        if not isinstance(who, ClassMove):
            yield label.paid, None
            return
        robots = list(zip(self._robots(label.state), label.paid, strict=True))
        for slot, robot in enumerate(robots):
            if robot[0] == who.source and (slot == 0 or robots[slot - 1] != robot):
                after = sorted([*robots[:slot], *robots[slot + 1 :], (who.target, robot[1] + cost)])
                yield tuple([paid for _, paid in after]), (slot, who)

    def rank(self, state: int, paid: Costs, total: float) -> tuple[float, ...]:
        """Return a lower bound on the highest cost in the end, then on the sum that is left; `UNREACHABLE` where it is too high.

        Args:
            state: Where the course has come to.
            paid: What each robot has paid.
            total: The sum.
        """
        left, highest = 0.0, max(paid)
        if not is_complete(state):
            left = self.left(state)
            if left == UNREACHABLE:
                return (UNREACHABLE,)
            states, _, sums = self._places.known[-state]
            robots = list(zip(self._robots(state), paid, strict=True))
            highest = max(highest, self._cover.highest(states, sums, robots), (total + left) / len(paid))
        return (highest + self._greed * left / len(paid) if highest < self._below else UNREACHABLE, left)

    def course(self, found: Found, starts: Sequence[int] = ()) -> Course | None:
        """Return the course that a search found; None where there is none.

        Args:
            found: By `least_sum` or `least_highest`.
            starts: The class of each robot, for the highest cost.
        """
        if not found.states:
            return None
        if not starts:
            return Course(tuple(itertools.starmap(self._cheapest, itertools.pairwise(found.states))), found.cost)
        team = sorted((place, 0.0, robot) for robot, place in enumerate(starts))
        made: list[tuple[ClassMove, int]] = []
        for step in found.steps[:-1]:
            assert isinstance(step, tuple)
            slot, move = step
            _, paid, robot = team.pop(slot)
            made.append((move, robot))
            team = sorted([*team, (move.target, paid + move.cost, robot)])
        return Course(tuple(move for move, _ in made), found.cost, tuple(robot for _, robot in made))

    def _cheapest(self, state: int, after: int) -> ClassMove:
        moves = (who for target, _, who in self.steps(state) if target == after and isinstance(who, ClassMove))
        return min(moves, key=lambda move: move.cost)

    def _robots(self, state: int) -> list[int]:
        """Return the class of each robot, in order."""
        return [place for place, count in enumerate(self._places.known[-state][1]) if count for _ in range(count)]

    def _after(self, states: States, sums: Sums, letters: Sequence[Sums]) -> States | None:
        """Return the conjuncts' states after one robot's move while the others rest; None where it violates the formula."""
        read = self._marks.read
        for change in letters:
            found = read(states, tuple(map(add, sums, change)))
            if found is None:
                return None
            states = found
        return states
