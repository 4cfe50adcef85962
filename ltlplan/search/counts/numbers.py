"""Search over how many robots rest where: robots that can do the same and are not named are only counted.

A state is (the conjuncts' states, how many robots of each class); one move of one robot leads to the next, and the team's
letters on the way are read. For n robots of one kind and p places that is at most (n + p over p) times the automata's states,
where their product has p to the power n. Starts of robots that can do the same from there are one class, at the cost of the
nearest: costs are then lower bounds, and who flies which of the moves is decided afterwards (`roles`).

The estimate of what is left is a sum over conjuncts: each by itself, on the sums of the marks that it sees, where any move
that exists anywhere may be made at its least cost, shared out among the conjuncts whose marks it changes.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from operator import add, sub

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.best_first import BestFirst, distances
from ltlplan.search.bounds.heuristic import UNREACHABLE
from ltlplan.search.counts.marks import Marks, States, Sums

Numbers = tuple[int, ...]
"""How many robots rest in each class of places."""

MOST_ABSTRACT = 5_000
"""States of one conjunct, with the sums that it sees, up to which what is left of it is estimated."""


@dataclass(frozen=True, slots=True)
class ClassMove:
    """A move from one class of places to another.

    Attributes:
        source: The class that a robot leaves.
        target: The one that it comes to.
        marks: What it shows on the way, the target last: marks of each letter.
        cost: The least.
        key: Tells the way from others between the same classes.
    """

    source: int
    target: int
    marks: tuple[Sums, ...]
    cost: float
    key: object


@dataclass(frozen=True, slots=True)
class Crowd:
    """Classes in which robots are in one small region.

    Attributes:
        classes: Their numbers.
        most: How many robots the region holds.
        passing: Whether one more may come while another one leaves.
    """

    classes: frozenset[int]
    most: int
    passing: bool

    def excess(self, numbers: Numbers) -> int:
        """Return by how many robots the region is too small."""
        return sum(numbers[number] for number in self.classes) - self.most


@dataclass(frozen=True, slots=True)
class Course:
    """Moves in an order that does what is asked.

    Attributes:
        moves: One robot's move after another's.
        cost: No plan of such moves costs less, where `exact`.
        exact: Whether cheaper ones were ruled out.
        reached: States that were seen.
    """

    moves: tuple[ClassMove, ...]
    cost: float
    exact: bool
    reached: int


class NumberSearch:
    """The search, over classes that are numbered.

    Args:
        marks: What the formula sees.
        resting: For each class the marks that a robot makes that rests there.
        ends: For each class whether the flight may end there.
        moves: For each class the moves from it.
        begin: How many robots start in each class.
        crowds: Small regions, none of which holds too many robots at rest.
    """

    def __init__(
        self,
        marks: Marks,
        resting: Sequence[Sums],
        ends: Sequence[bool],
        moves: Sequence[Sequence[ClassMove]],
        begin: Numbers,
        crowds: Sequence[Crowd] = (),
    ) -> None:
        self.marks, self.resting, self.ends, self.moves, self.begin = marks, resting, ends, moves, begin
        self._crowds = tuple(crowds)
        self._ways = [[(move, self._changes(move)) for move in found] for found in moves]

    def sums(self, numbers: Numbers) -> Sums:
        """Return how many robots make each mark."""
        total = [0] * len(self.resting[0])
        for marks, count in zip(self.resting, numbers, strict=True):
            if count:
                total = [t + count * m for t, m in zip(total, marks, strict=True)]
        return tuple(total)

    def _changes(self, move: ClassMove) -> tuple[Sums, ...]:
        """Return what each letter of a move changes in the sums that are there before it."""
        resting = self.resting[move.source]
        return tuple(tuple(map(sub, marks, resting)) for marks in move.marks)

    def _after(self, states: States, sums: Sums, changes: Sequence[Sums]) -> States | None:
        """Return the states after one robot's move while the others rest; None where it loses the task."""
        read = self.marks.read
        for change in changes:
            found = read(states, tuple(map(add, sums, change)))
            if found is None:
                return None
            states = found
        return states

    def crowded(self, numbers: Numbers) -> bool:
        """Tell whether a small region holds more robots than it can."""
        return any(crowd.excess(numbers) > 0 for crowd in self._crowds)

    def _leaves(self, numbers: Numbers) -> frozenset[int] | None:
        """Return the classes from which one must leave next, as its region is too full; None where any may."""
        return next((crowd.classes for crowd in self._crowds if crowd.excess(numbers) > 0), None)

    def _fits(self, numbers: Numbers, move: ClassMove) -> bool:
        """Tell whether a move's target has room: for one more only where that is passed on at once."""
        return all(
            crowd.excess(numbers) <= int(crowd.passing)
            for crowd in self._crowds
            if move.target in crowd.classes and move.source not in crowd.classes
        )

    def cheapest(self, budget: Budget) -> Course | None:
        """Return the cheapest course, or any where the budget of states does not suffice for the cheapest; None where there is none.

        Raises:
            TooLarge: The budget was used up before any course was found.
        """
        first = self.marks.begin(self.sums(self.begin))
        if first is None:
            return None
        left = _Left(self)
        try:
            return self._walk(first, left, budget.states // 2, weight=1.0)
        except TooLarge:
            return self._walk(first, left, budget.states // 2, weight=5.0)

    def _walk(self, first: States, left: _Left, most: int, *, weight: float) -> Course | None:
        nodes: list[tuple[States, Numbers, Sums]] = [(first, self.begin, self.sums(self.begin))]
        index = {nodes[0][:2]: 0}
        came: dict[tuple[int, int], ClassMove] = {}

        def successors(key: int) -> list[tuple[int, float]]:  # keys are negative: of equal bounds the latest comes first
            at = -key
            states, numbers, sums = nodes[at]
            found: list[tuple[int, float]] = []
            leaving = self._leaves(numbers)
            for place, count in enumerate(numbers):
                for move, changes in self._ways[place] if count and (leaving is None or place in leaving) else ():
                    after = self._after(states, sums, changes)
                    if after is None:
                        continue
                    moved = list(numbers)
                    moved[place] -= 1
                    moved[move.target] += 1
                    if self._crowds and not self._fits(tuple(moved), move):
                        continue
                    place_of = after, tuple(moved)
                    target = index.get(place_of)
                    if target is None:
                        target = index[place_of] = len(nodes)
                        nodes.append((*place_of, self.sums(place_of[1])))
                    known = came.get((at, target))
                    if known is None or move.cost < known.cost:
                        came[at, target] = move
                    found.append((-target, move.cost))
            return found

        search = BestFirst([0], successors, lambda key: left(nodes[-key][0], nodes[-key][2]), weight=weight)
        for explored, (key, _, _) in enumerate(search, start=1):
            states, numbers, _ = nodes[-key]
            ended = all(end or not count for end, count in zip(self.ends, numbers, strict=True)) and not self.crowded(numbers)
            if ended and self.marks.accepting(states):
                path = [-at for at in search.path(key)]
                moves = tuple(came[pair] for pair in itertools.pairwise(path))
                return Course(moves, sum(move.cost for move in moves), weight == 1.0, len(nodes))
            if explored > most:
                raise TooLarge("The search for who is where needs", explored, "states", most)
        return None


class _Left:
    """Lower bounds on what is left, from each conjunct by itself."""

    def __init__(self, search: NumberSearch) -> None:
        self._marks, self._robots = search.marks, sum(search.begin)
        moves = [move for found in search.moves for move in found]
        seen = search.marks.seen
        kinds: list[dict[tuple[Sums, ...], float]] = [{} for _ in seen]
        for move in moves:
            shown = (search.resting[move.source], *move.marks)
            cut = [tuple(tuple(marks[i] for i in own) for marks in shown) for own in seen]
            changed = [index for index, way in enumerate(cut) if len(set(way)) > 1]
            for index in changed:
                price = move.cost / len(changed)
                kinds[index][cut[index]] = min(price, kinds[index].get(cut[index], UNREACHABLE))
        begin = search.sums(search.begin)
        self._rest = [self._distances(index, kinds[index], tuple(begin[i] for i in seen[index])) for index in range(len(seen))]

    def __call__(self, states: States, sums: Sums) -> float:
        total = 0.0
        for own, state, rest in zip(self._marks.seen, states, self._rest, strict=True):
            if rest is not None:
                total += rest.get((state, tuple(sums[i] for i in own)), UNREACHABLE)
        return total

    def _distances(self, index: int, kinds: dict[tuple[Sums, ...], float], begin: Sums) -> dict[tuple[int, Sums], float] | None:
        """Return the least sum of prices from each state with its sums to acceptance; None where there are too many."""
        part, own = self._marks.parts[index], self._marks.seen[index]
        width = max((max(seen, default=-1) for seen in self._marks.seen), default=-1) + 1

        def letter(sums: Sums) -> int:
            whole = [0] * width
            for mark, total in zip(own, sums, strict=True):
                whole[mark] = total
            return self._marks.letter(tuple(whole))

        first = (part.step(part.initial, letter(begin)), begin)
        order, back = [first], dict[tuple[int, Sums], list[tuple[tuple[int, Sums], float]]]()
        known = {first}
        for state, sums in order:
            for way, price in kinds.items():
                others = tuple(s - m for s, m in zip(sums, way[0], strict=True))
                if any(total < 0 for total in others):
                    continue
                after, at = state, sums
                for marks in way[1:]:
                    at = tuple(o + m for o, m in zip(others, marks, strict=True))
                    after = part.step(after, letter(at))
                if after == DEAD or max(at, default=0) > self._robots:
                    continue
                target = after, at
                back.setdefault(target, []).append(((state, sums), price))
                if target not in known:
                    known.add(target)
                    order.append(target)
            if len(order) > MOST_ABSTRACT:
                return None
        accepting = [node for node in order if part.accepting(node[0])]
        return distances(accepting, lambda node: back.get(node, ()))


def numbers_of(classes: Sequence[int], count: int) -> Numbers:
    """Return how many robots are in each of some classes.

    Args:
        classes: Each robot's class.
        count: How many classes there are.
    """
    found = Counter(classes)
    return tuple(found[index] for index in range(count))
