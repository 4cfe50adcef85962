"""Search over how many robots rest where: robots that can do the same and are not named are only counted.

A state is (the conjuncts' states, how many robots of each class); one move of one robot leads to the next, and the team's
letters on the way are read. For n robots of one kind and p places that is at most (n + p over p) times the automata's states,
where their product has p to the power n. Starts of robots that can do the same from there are first one class, at the
cost of the nearest: costs are then lower bounds, and who flies which of the moves is decided afterwards (`team_classes`).

What is left is estimated by conjuncts (`conjunct_bound`) and, where that does not suffice, by goals and where robots are (`cover_bound`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from operator import add, sub

from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.counting.classes import Classes, ClassMove, Numbers
from ltlplan.search.counting.conjunct_bound import ConjunctBound
from ltlplan.search.counting.counting_propositions import States, Sums
from ltlplan.search.counting.cover_bound import CoverBound
from ltlplan.search.label_setting import BestFirst
from ltlplan.search.team_reading import UNREACHABLE

_Left = Callable[[States, Numbers, Sums], float]
"""A lower bound on what is left."""

_Step = tuple[ClassMove, tuple[Sums, ...], tuple[int, ...], Sums]
"""A move, what each of its letters changes, the numbers of the small regions that it enters, and what it changes in the end."""

_WEIGHTS = (2.0, 5.0)
"""Of what is left, where the cheapest course is too far: among small regions, where many orders are cut off late, the dearest ways are not taken first."""
_EASY = 300
"""States up to which conjuncts are looked at by themselves, which is quick; searches for which that does not do take where robots are into account."""


@dataclass(frozen=True, slots=True)
class Course:
    """Moves in an order that does what is asked.

    Attributes:
        moves: One robot's move after another's.
        cost: What they cost.
        bound: No course costs less.
        reached: States that were seen.
        who: The robot that makes each move, where that was looked at.
    """

    moves: tuple[ClassMove, ...]
    cost: float
    bound: float
    reached: int
    who: tuple[int, ...] = ()


class NumberSearch:
    """The search.

    Args:
        classes: What the team can do.

    Attributes:
        ways: For each class the moves from it, with what each of their letters changes in the sums that are there before it.
    """

    def __init__(self, classes: Classes) -> None:
        self.classes, self._marks, self._crowds = classes, classes.marks, classes.crowds
        self.ways = [[(move, self._changes(move)) for move in found] for found in classes.moves]
        self._steps = [[self._step(move, changes) for move, changes in found] for found in self.ways]

    def _step(self, move: ClassMove, changes: tuple[Sums, ...]) -> _Step:
        resting = self.classes.resting
        entered = (k for k, c in enumerate(self._crowds) if move.target in c.classes and move.source not in c.classes)
        return move, changes, tuple(entered), tuple(map(sub, resting[move.target], resting[move.source]))

    def _changes(self, move: ClassMove) -> tuple[Sums, ...]:
        """Return what each letter of a move changes in the sums that are there before it."""
        resting = self.classes.resting[move.source]
        return tuple(tuple(map(sub, marks, resting)) for marks in move.marks)

    def after(self, states: States, sums: Sums, changes: Sequence[Sums]) -> States | None:
        """Return the states after one robot's move while the others rest; None where it loses the task.

        Args:
            states: Before it.
            sums: How many robots make each mark before it.
            changes: What its letters change in them.
        """
        read = self._marks.read
        for change in changes:
            found = read(states, tuple(map(add, sums, change)))
            if found is None:
                return None
            states = found
        return states

    def crowded(self, numbers: Numbers) -> bool:
        """Tell whether a small region holds more robots than it can."""
        return any(crowd.excess(numbers) > 0 for crowd in self._crowds)

    def may_end(self, numbers: Numbers) -> bool:
        """Tell whether flights may end so.

        Args:
            numbers: How many robots rest in each class.
        """
        return all(end or not count for end, count in zip(self.classes.ends, numbers, strict=True)) and not self.crowded(
            numbers
        )

    def leaves(self, numbers: Numbers) -> frozenset[int] | None:
        """Return the classes from which one must leave next, as its region is too full; None where any may.

        Args:
            numbers: How many robots rest in each class.
        """
        return next((crowd.classes for crowd in self._crowds if crowd.excess(numbers) > 0), None)

    def fits(self, numbers: Numbers, move: ClassMove) -> bool:
        """Tell whether a move's target has room: for one more only where that is passed on at once.

        Args:
            numbers: How many robots rest in each class after it.
            move: The move.
        """
        return all(
            crowd.excess(numbers) <= int(crowd.passing)
            for crowd in self._crowds
            if move.target in crowd.classes and move.source not in crowd.classes
        )

    def cheapest(self, budget: Budget) -> Course | None:
        """Return the cheapest course, or any where the budget of states does not suffice for the cheapest; None where there is none.

        Raises:
            UsedUp: The budget was used up before any course was found.
        """
        first = self._marks.begin(self.classes.sums(self.classes.begin))
        if first is None:
            return None
        conjuncts, most = ConjunctBound(self.classes), budget.states // 2

        def by_conjuncts(states: States, _: Numbers, sums: Sums) -> float:
            return conjuncts(states, sums)

        with suppress(UsedUp):
            return self._walk(first, by_conjuncts, min(_EASY, most))
        cover = CoverBound(self.classes)

        def by_both(states: States, numbers: Numbers, sums: Sums) -> float:
            return max(conjuncts(states, sums), cover(states, sums, numbers))

        try:
            return self._walk(first, by_both, most)
        except UsedUp as spent:
            bound = spent.bound
        for weight in _WEIGHTS if self._crowds else _WEIGHTS[-1:]:
            try:
                found = self._walk(first, by_both, most, weight=weight)
            except UsedUp as spent:
                if weight == _WEIGHTS[-1]:
                    raise UsedUp(spent.used, spent.limit, bound) from None
            else:
                return None if found is None else replace(found, bound=bound)
        return None

    def possible(self, budget: Budget) -> bool:
        """Tell whether there may be a course, whatever it costs: sure where there is none, and not where the budget was used up.

        Args:
            budget: Of states.
        """
        sums = self.classes.sums(self.classes.begin)
        first = self._marks.begin(sums)
        if first is None:
            return False
        conjuncts, cover = ConjunctBound(self.classes), CoverBound(self.classes)

        def by_both(states: States, numbers: Numbers, sums: Sums) -> float:
            return max(conjuncts(states, sums), cover(states, sums, numbers))

        try:
            return self._walk(first, by_both, budget.states, weight=_WEIGHTS[-1]) is not None
        except UsedUp:
            return True

    def least(self) -> float:
        """Return a lower bound on the cost of any course, without a search; infinite where there is none."""
        sums = self.classes.sums(self.classes.begin)
        first = self._marks.begin(sums)
        return UNREACHABLE if first is None else CoverBound(self.classes)(first, sums, self.classes.begin)

    def _walk(self, first: States, left: _Left, most: int, *, weight: float = 1.0) -> Course | None:
        nodes: list[tuple[States, Numbers, Sums]] = [(first, self.classes.begin, self.classes.sums(self.classes.begin))]
        index = {nodes[0][:2]: 0}
        came: dict[tuple[int, int], ClassMove] = {}
        steps, crowds = self._steps, self._crowds

        def successors(key: int) -> list[tuple[int, float]]:  # keys are negative: of equal bounds the latest comes first
            at = -key
            states, numbers, sums = nodes[at]
            found: list[tuple[int, float]] = []
            excess = [crowd.excess(numbers) for crowd in crowds]
            leaving = next((crowd.classes for crowd, more in zip(crowds, excess, strict=True) if more > 0), None)
            for place, count in enumerate(numbers):
                for move, changes, entered, turned in steps[place] if count and (leaving is None or place in leaving) else ():
                    if entered and any(excess[crowd] >= int(crowds[crowd].passing) for crowd in entered):
                        continue
                    after = self.after(states, sums, changes)
                    if after is None:
                        continue
                    moved = list(numbers)
                    moved[place] -= 1
                    moved[move.target] += 1
                    place_of = after, tuple(moved)
                    target = index.get(place_of)
                    if target is None:
                        target = index[place_of] = len(nodes)
                        nodes.append((*place_of, tuple(map(add, sums, turned))))
                    known = came.get((at, target))
                    if known is None or move.cost < known.cost:
                        came[at, target] = move
                    found.append((-target, move.cost))
            return found

        bounds: dict[int, float] = {}

        def bound_of(key: int) -> float:
            if key not in bounds:
                bounds[key] = left(*nodes[-key])
            return bounds[key]

        search = BestFirst([0], successors, bound_of, weight=weight)
        for explored, (key, _, bound) in enumerate(search, start=1):
            states, numbers, _ = nodes[-key]
            if self._marks.accepting(states) and self.may_end(numbers):
                path = [-at for at in search.path(key)]
                moves = tuple(came[pair] for pair in itertools.pairwise(path))
                cost = sum(move.cost for move in moves)
                return Course(moves, cost, cost if weight == 1.0 else 0.0, len(nodes))
            if explored > most:
                raise UsedUp(explored, most, bound)
        return None


class UsedUp(TooLarge):
    """The states did not suffice.

    Attributes:
        bound: No course costs less.
    """

    def __init__(self, explored: int, most: int, bound: float) -> None:
        super().__init__("The search for who is where needs", explored, "states", most)
        self.bound = bound
