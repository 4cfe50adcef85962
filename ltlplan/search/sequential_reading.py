"""A team whose robots are followed one after another: the walk that formulas read robot by robot and joint formulas have in common.

The team automaton T (2022 paper, Defs. 4.6 and 4.7) is walked in one fixed order of the robots and made as it is walked, over the nodes
that matter (`reduced_graph`). Every plan whose words keep the task in all orders is a path of T in the fixed order too, if robots may be
switched in every state. So a cheapest path is a lower bound, and it is the optimum as soon as its words pass in all orders.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Generic, TypeVar

from ltlplan.logic.automaton import DEAD
from ltlplan.search.label_setting import Costs, Label
from ltlplan.search.memoization import memoized
from ltlplan.search.numbering import Numbers
from ltlplan.search.reduced_graph import ReducedGraph
from ltlplan.search.team_reading import PaidApart, Step, complete, is_complete

SLACK = 1e-6
"""What the tiny amounts that break ties may add to a robot's cost."""

Progress = TypeVar("Progress", bound=Hashable)


@dataclass(frozen=True, slots=True)
class Objective:
    """The order on plans, and the limits on robots.

    Attributes:
        longest: Whether the highest cost of a robot counts, not the sum.
        most: What each robot may cost at most; None for no limit.
    """

    longest: bool = False
    most: Sequence[float] | None = None

    def allows(self, robot: int, own: float) -> bool:
        """Tell whether a robot may cost that much.

        Args:
            robot: Which one.
            own: What it costs.
        """
        return self.most is None or own <= self.most[robot] + SLACK


class SequentialReading(PaidApart, Generic[Progress]):
    """A mission whose robots are followed one after another (see `team_reading.PaidApart`): a state says who flies, where, and the progress.

    Progress is numbered; a subclass says what it is.

    Args:
        graph: The team's graph.
        tree: Lower bound on the cost to show what must still be shown, as bits, with a robot at a node.
        first: The progress before anything was read.
        objective: The order on plans, and limits on robots.

    Attributes:
        graph: The team's graph.
    """

    kept_apart = 2  # the objective, and the cost of the robot that flies

    def __init__(
        self, graph: ReducedGraph, tree: Callable[[int, int, int], float], first: Progress, objective: Objective
    ) -> None:
        self.graph, self._tree, self._objective = graph, tree, objective
        self._robots, self._width = len(graph.start), graph.width
        self._numbers = Numbers[Progress]()
        self._progress = self._numbers.known
        self._read: list[dict[int, int]] = []
        self._first, self._landed = first, cache(self._after_landing)
        self._rest: list[float] = []
        self._missing: list[int] = []

    @abstractmethod
    def read(self, progress: Progress, letter: int) -> int:
        """Return the progress, by number, after a letter of the robot that flies; `DEAD` where the task is lost."""

    @abstractmethod
    def hand_over(self, progress: Progress, rest: float, missing: int, /) -> int:
        """Return the progress, by number, between a robot's word and the next one's; `DEAD` where some order of the robots is lost.

        Args:
            progress: When the robot has landed.
            rest: A lower bound on what is left then.
            missing: What must still be shown, as bits.
        """

    @abstractmethod
    def is_accepting(self, progress: Progress) -> bool:
        """Tell whether everything is done, in the order in which the robots were followed."""

    @abstractmethod
    def holds_in_every_order(self, progress: Progress) -> bool:
        """Tell whether the words keep the tracked conjuncts in every order of the robots."""

    def begin(self) -> int | None:
        """Return the state in which the first robot is at its start; None where the task is lost there."""
        return self._started(self._first, 0)

    def steps(self, state: int) -> Iterator[Step]:
        """Yield what may follow, its cost, and whether the robot has finished."""
        graph = self.graph
        at, robot, node = self._parted(state)
        label, read, here = graph.label[robot], self._read[at], graph.successors(robot, node)
        for target, cost in here.edges:
            letter = label[target]
            after = read.get(letter)
            if after is None:
                after = read[letter] = self.read(self._progress[at], letter)
            if after != DEAD:
                yield (after * self._robots + robot) * self._width + target, cost, False
        if here.ending is None:
            return
        if robot + 1 == self._robots:
            if self.is_accepting(self._progress[at]):
                yield complete(state), here.ending, True
            return
        following = self._landed(at, robot)
        if following is not None:
            yield following, here.ending, True

    @memoized
    def left(self, state: int) -> float:
        """Return a lower bound on the cost that is left; it falls by no more than a step costs."""
        place, node = divmod(state, self._width)
        at, robot = divmod(place, self._robots)
        rest, tree = self._rest[at], self._tree(self._missing[at], robot, node)
        return rest if rest > tree else tree

    def holds(self, state: int) -> bool:
        """Tell whether the words keep the tracked conjuncts in every order of the robots."""
        return self.holds_in_every_order(self._progress[self._parted(state)[0]])

    def pay(self, label: Label[int], cost: float, who: object) -> Iterable[tuple[Costs, object]]:
        """Return the objective so far, without the robot that flies where the highest cost counts, and what that robot has paid.

        Args:
            label: Of the state before the step.
            cost: Of the step.
            who: Whether the robot has finished.
        """
        reached, own = label.paid[0], label.paid[1] + cost
        if self._objective.most is not None and not self._objective.allows(self._parted(label.state)[1], own):
            return ()
        if not self._objective.longest:
            reached += cost
        elif who and own > reached:
            reached = own
        return (((reached, 0.0 if who else own), None),)

    def rank(self, state: int, paid: Costs, total: float) -> tuple[float, ...]:
        """Return a lower bound on the objective, then the sum.

        Args:
            state: Where the plan has come to.
            paid: The objective so far, and what the robot that flies has paid.
            total: The sum.
        """
        reached, own = paid
        if is_complete(state):
            return reached, total
        rest = self.left(state)
        if not self._objective.longest:
            return reached + rest, total
        return max(reached, own, (own + rest) / (self._robots - state // self._width % self._robots)), total

    def paths(self, states: Sequence[int]) -> tuple[tuple[int, ...], ...]:
        """Return the nodes of each robot's system along the states of a plan."""
        paths: list[list[int]] = [[] for _ in range(self._robots)]
        for state in states:
            _, robot, node = self._parted(state)
            paths[robot].append(node)
        return tuple(self.graph.expand(robot, path) for robot, path in enumerate(paths))

    def _parted(self, state: int) -> tuple[int, int, int]:
        """Return the number of the progress, the robot that flies and its node."""
        place, node = divmod(state, self._width)
        at, robot = divmod(place, self._robots)
        return at, robot, node

    def _after_landing(self, at: int, robot: int) -> int | None:
        """Return the state in which the next robot is at its start; None where the task is lost."""
        between = self.hand_over(self._progress[at], self._rest[at], self._missing[at])
        return None if between == DEAD else self._started(self._progress[between], robot + 1)

    def _started(self, before: Progress, robot: int) -> int | None:
        """Return the state in which a robot is at its start; None where the task is lost there."""
        node = self.graph.start[robot]
        after = self.read(before, self.graph.label[robot][node])
        return None if after == DEAD else (after * self._robots + robot) * self._width + node

    def _number(self, progress: Progress, rest: float, missing: int) -> int:
        found = self._numbers[progress]
        if found == len(self._rest):
            self._read.append({})
            self._rest.append(rest)
            self._missing.append(missing)
        return found
