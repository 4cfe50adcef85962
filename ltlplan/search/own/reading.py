"""The states of the search for `team: own`: the state of the task and, for tracked conjuncts, what the robots' words do."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Sequence
from functools import reduce

from ltlplan.logic.automaton import DEAD, Automaton
from ltlplan.logic.conjunct_automata import Deterministic, Part
from ltlplan.logic.product_automaton import Task
from ltlplan.logic.transition_monoid import Element, OrderCheck, TransitionMonoid
from ltlplan.search.bounds.conjunct_bounds import ConjunctBounds
from ltlplan.search.bounds.conjunct_graph import ConjunctGraph
from ltlplan.search.bounds.order_bounds import OrderBounds
from ltlplan.search.memoization import memoized
from ltlplan.search.reduced_graph import MAX_TABLE, ReducedGraph, letter_classes
from ltlplan.search.sequential_reading import SLACK, Objective, SequentialReading
from ltlplan.search.team_planning import PlanningOutcome, TeamRun, TeamTask
from ltlplan.search.team_reading import UNREACHABLE
from ltlplan.search.tours.shared_tours import least_highest
from ltlplan.search.tours.task_kinds import TaskKinds
from ltlplan.search.tours.task_tours import Tours
from ltlplan.systems.transition_systems import TransitionSystem

Progress = tuple[int, Element, tuple[Element, ...]]
"""The state of the task; for the tracked conjuncts, what the word of the robot that flies does so far, and what the words before it do."""


class OwnTask(TeamTask):
    """A team and the conjuncts that its robots' words keep (see `team_planning.TeamTask`).

    Args:
        systems: One for each robot.
        automata: One for each conjunct.

    Attributes:
        graph: The team's graph.
        task: What is to be done.
        bounds: On what is left of each conjunct.
        share: Of the budget, one in so many states is spent on a search by sums.
        shapes: For each conjunct its automaton without names.
    """

    share = 1
    alike = True

    def __init__(self, systems: Sequence[TransitionSystem], automata: Sequence[Automaton]) -> None:
        super().__init__(systems, automata)
        self.task = Task(automata, self._team.letters, self._team.walls)
        self.graph = ReducedGraph(self._team, *letter_classes(self.task))
        shown = sorted({letter for label in self.graph.label for letter in label})
        graphs = [_backwards(part, self._bit, self.masks, shown) for part in self.task.parts]
        self.bounds = ConjunctBounds(graphs, self.masks, self.graph)
        self._everything, self._check = TransitionMonoid(self.task), OrderCheck(self.task)
        self.shapes = [part.automaton.shape if isinstance(part, Deterministic) else k for k, part in enumerate(self.task.parts)]

    def reading(self, tracked: Collection[int] = (), objective: Objective = Objective()) -> OwnReading:  # noqa: B008 - frozen
        """Return what a search walks over.

        Args:
            tracked: Conjuncts, by index, that words must keep in every order.
            objective: The order on plans, and limits on robots.
        """
        return OwnReading(self, sorted(tracked), objective)

    def failing_orders(self, paths: Sequence[Sequence[int]]) -> dict[int, tuple[int, ...]]:
        """Return, for each conjunct that some order of the robots breaks, such an order.

        Args:
            paths: The nodes of each robot's system.

        Raises:
            TooLarge: There are too many different orders.
        """
        return self._check.failing_orders([self._everything.of(letters) for letters in self.graph.team.letters_of(paths)])

    @memoized
    def left(self, state: int) -> tuple[float, int]:
        """Return a lower bound on the cost that is left, and what must still be shown, as bits.

        Args:
            state: The product's, by number.
        """
        return self.bounds(self.task.state(state))

    def shared_out(self, objective: Objective) -> PlanningOutcome | None:
        """Return the plan that tasks shared in tours make, with a bound on its highest cost; None where it does not hold in every order.

        Args:
            objective: Limits on robots.
        """
        graph, kinds = self.graph, self.kinds()
        most = None if objective.most is None else [limit + SLACK for limit in objective.most]
        tours = Tours(graph, self.task, kinds, most)
        flown = least_highest(tours) if kinds.free else None
        cost = max((tour.cost for tour in flown or ()), default=UNREACHABLE)
        if flown is None or cost == UNREACHABLE:
            return None
        run = TeamRun(tuple(graph.expand(robot, tour.nodes) for robot, tour in enumerate(flown)), cost, tours.priced)
        if self.failing_orders(run.paths):
            return None
        free = None if kinds.own or kinds.kept else tours
        return PlanningOutcome(run, run, 1, bound=self.least(longest=True, free=free) - SLACK)

    def kinds(self, lost: frozenset[int] = frozenset()) -> TaskKinds:
        """Return the conjuncts by what robots have to do about them.

        Args:
            lost: Those that are not to be free: some order of the robots was seen to break them.
        """
        return TaskKinds(self.task, [self.graph.label[robot][node] for robot, node in enumerate(self.graph.start)], lost=lost)

    def least(self, *, longest: bool, free: Tours | None = None) -> float:
        """Return what no plan costs less than, in sum or by the robot with the highest cost, as far as it is known without a search.

        Args:
            longest: Whether the highest cost counts.
            free: Tours of the free tasks alone, where there are some already.
        """
        reading = self.reading()
        begin = reading.begin()
        total = 0.0 if begin is None else reading.left(begin)
        if not longest:
            return total
        free = free or Tours(self.graph, self.task, self.kinds().free_alone())
        return max(total / len(self.graph.start), free.dearest_alone())


class OwnReading(SequentialReading[Progress]):
    """Progress of a team whose robots' words are read one after another.

    Args:
        own: The team and its task.
        tracked: The conjuncts, by index, for which the words must also keep the task in every order.
        objective: The order on plans, and limits on robots.
    """

    def __init__(self, own: OwnTask, tracked: Sequence[int], objective: Objective) -> None:
        self._own, self._task = own, own.task
        self._orders = [
            (place, _Orders(part, index, own.bounds))
            for place, index in enumerate(tracked)
            if isinstance(part := own.task.parts[index], Deterministic) and own.bounds.rest[index] is not None
        ]
        self._monoid, self._check = TransitionMonoid(own.task, tracked), OrderCheck(own.task, tracked)
        super().__init__(own.graph, own.bounds.tree, (own.task.initial, self._monoid.identity, ()), objective)
        if own.bounds.tree.one_way:  # on a grid many ways are as short
            self.ties = "farthest"

    def read(self, progress: Progress, letter: int) -> int:
        """Return the progress, by number, after a letter; `DEAD` where the task is lost, for this order of the robots or for another."""
        state, own, done = progress
        after = self._task.row(state)[letter]
        if after == DEAD or self._own.left(after)[0] == UNREACHABLE:
            return DEAD
        element = self._monoid.read(own, letter)
        return DEAD if self._monoid.is_dead(element) else self._numbered((after, element, done))

    def hand_over(self, progress: Progress, *_: object) -> int:
        """Return the progress, by number, between two words; `DEAD` where some order of the robots is lost."""
        state, own, done = progress
        if own != self._monoid.identity:
            done = tuple(sorted((*done, own)))
        if self._check.failing_order(done, finished=False) is not None:
            return DEAD
        return self._numbered((state, self._monoid.identity, done))

    def is_accepting(self, progress: Progress) -> bool:
        """Tell whether everything is done, in the order in which the robots were followed."""
        return self._task.is_accepting(progress[0])

    def holds_in_every_order(self, progress: Progress) -> bool:
        """Tell whether the words keep the tracked conjuncts in every order of the robots."""
        return self._check.failing_order([*progress[2], progress[1]]) is None

    def _numbered(self, progress: Progress) -> int:
        known = self._numbers.get(progress)
        if known is not None:
            return known
        state, own, done = progress
        rest, missing = self._own.left(state)
        for place, bound in self._orders:
            effects = tuple([each[place] for each in done])
            more, needed = bound.more(own[place], effects, 0, self._task.state(state)[bound.index])
            rest, missing = rest + more, missing | needed
        return DEAD if rest == UNREACHABLE else self._number(progress, rest, missing)


_Effect = tuple[int, ...]


class _Orders(OrderBounds[_Effect, int, int]):
    """Bounds for a conjunct whose words take each state to another one."""

    def __init__(self, part: Deterministic, index: int, bounds: ConjunctBounds[int]) -> None:
        super().__init__(index, bounds)
        self._part = part

    def moves(self, word: _Effect) -> bool:
        return word != self._part.identity

    def first(self, _own: _Effect, /) -> int:
        return 0

    def begin(self, _first: int, before: Sequence[_Effect], after: Sequence[_Effect], *_: object) -> tuple[int, frozenset[int]]:
        part = self._part
        state = part.initial
        for effect in before:
            state = DEAD if state == DEAD else effect[state]
        then = reduce(part.compose, after, part.identity)
        return state, frozenset(state for state in part.identity if then[state] != DEAD and part.accepting(then[state]))

    def read(self, own: _Effect, begin: int, /) -> int | None:
        after = DEAD if begin == DEAD else own[begin]
        return None if after == DEAD else after


def _backwards(part: Part, bit: dict[str, int], masks: Sequence[int], shown: Sequence[int]) -> ConjunctGraph[int] | None:
    """Return a small conjunct's graph; None of a large one, or one that walls leave open."""
    if not isinstance(part, Deterministic) or len(part.identity) * len(part.views) > MAX_TABLE:
        return None
    mask = sum(bit[name] for name in part.automaton.propositions)
    seen = {masks[letter] & mask: letter for letter in shown}
    back: dict[int, list[tuple[int, int]]] = defaultdict(list)
    priced: set[int] = set()
    for state in part.identity:
        row = part.row(state)
        for view, letter in seen.items():
            if row[letter] != DEAD:
                back[row[letter]].append((state, view))
                priced |= {view} if row[letter] != state else set[int]()
    goals = frozenset(state for state in part.identity if part.accepting(state))
    return ConjunctGraph(part.identity, back, goals, mask, priced)
