"""Infinite words of one robot that flies laps, checked against an LTL formula.

Our own answer: a tableau for the negated formula (obligations for the rest of the word, and which eventualities were
put off) is multiplied with the robot's graph, and a run is sought that begins laps for ever and puts nothing off for
ever. Each lap chooses anew what its labels leave open. Spot answers the same question from the same graph.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from verify.data.errors import InternalError
from verify.data.language.word import Letter, Word
from verify.logic.normal_form import Normal, normal_form, to_formula
from verify.logic.progression import OutOfBudget
from verify.logic.spot_opinion import LetterGraph, some_run_breaks
from verify.model_checking.robot_letters import RobotBehaviour

Clause = tuple[int, int]
"""Obligations for the next position, and eventualities put off to it, both as bits over entries."""


MAX_CLAUSES = 5_000
"""Ways to meet the formula that one letter may leave."""

MAX_STEPS = 10_000_000
"""Pairs of ways that may be joined or compared."""


@dataclass(frozen=True, slots=True)
class BrokenRun:
    """A lasso that breaks the formula.

    Attributes:
        word: Its letters.
        nodes: The robot's node at each letter of `word.letters`.
    """

    word: Word
    nodes: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class _Edge:
    source: int
    target: int
    node: int
    marks: int


def find_broken_run(robot: RobotBehaviour, normal: Normal, budget: int) -> BrokenRun | None:
    """Return a lasso of the robot that breaks the formula, or None; Spot must agree.

    Args:
        robot: All that the robot may do, with the steps that begin a lap.
        normal: The formula, in normal form.
        budget: Configurations of robot and formula that may be met.

    Raises:
        OutOfBudget: More than `budget` configurations were met.
        InternalError: The two answers differ.
        MissingEngine: Spot is absent.
    """
    run = search_run(robot, normal, budget)
    theirs = some_run_breaks(_letters(robot, normal), normal)
    if theirs != (run is not None):
        raise InternalError(
            "Two independent answers about one formula disagree: the tableau says that it "
            f"{'fails' if run else 'holds'}, Spot that it {'fails' if theirs else 'holds'}. This is a bug of ltlplan's."
        )
    return run


def _letters(robot: RobotBehaviour, normal: Normal) -> LetterGraph:
    """Number nodes from 1; an edge reads the letter of the node that it enters."""
    seen = normal.propositions
    edges: list[tuple[int, Letter, int]] = [(0, robot.letters[n] & seen, n + 1) for n in robot.initial]
    marked: set[int] = set()
    for node, targets in enumerate(robot.following):
        for target in targets:
            if (node, target) in robot.laps:
                marked.add(len(edges))
            edges.append((node + 1, robot.letters[target] & seen, target + 1))
    return LetterGraph(len(robot) + 1, tuple(edges), marked=frozenset(marked))


def search_run(robot: RobotBehaviour, normal: Normal, budget: int) -> BrokenRun | None:
    """Return a lasso of the robot that breaks the formula, or None, by our own search alone.

    Args:
        robot: All that the robot may do, with the steps that begin a lap.
        normal: The formula, in normal form.
        budget: Configurations of robot and formula that may be met.

    Raises:
        OutOfBudget: More than `budget` configurations were met.
        InternalError: What was found cannot be put together to a lasso: a bug of ours.
    """
    tableau = Tableau(normal_form(to_formula(normal), negated=True))
    lap_mark = 1 << len(tableau.eventualities)
    every = lap_mark * 2 - 1
    index: dict[tuple[int, int], int] = {}
    order: list[tuple[int, int]] = []
    edges: list[list[_Edge]] = []

    def number(node: int, obligations: int) -> int:
        key = (node, obligations)
        if key not in index:
            if len(order) >= budget:
                raise OutOfBudget(f"more than {budget} configurations of robot and formula")
            index[key] = len(order)
            order.append(key)
            edges.append([])
        return index[key]

    starts: list[tuple[int, int]] = []  # (state, node read)
    for node in robot.initial:
        for obligations, _ in tableau.read(tableau.initial, robot.letters[node]):
            starts.append((number(node, obligations), node))
    position = 0
    while position < len(order):
        node, obligations = order[position]
        for target in robot.following[node]:
            lap = lap_mark if (node, target) in robot.laps else 0
            for after, put_off in tableau.read(obligations, robot.letters[target]):
                edges[position].append(_Edge(position, number(target, after), target, tableau.kept(put_off) | lap))
        position += 1
    for component in _components(edges):
        marks = 0
        inside = set(component)
        for state in component:
            for edge in edges[state]:
                if edge.target in inside:
                    marks |= edge.marks
        if marks == every:
            return _lasso(robot, starts, edges, inside, every)
    return None


class Tableau:
    """Nondeterministic reading of an LTL formula: obligations in, letter, obligations out.

    Attributes:
        initial: The obligations before the first letter, as bits over entries.
        eventualities: Entries (F, U, M) that must not be put off for ever.
    """

    def __init__(self, normal: Normal) -> None:
        self.normal = normal
        self.propositions = normal.propositions
        self.initial = 1 << normal.root
        self.eventualities = [i for i, kind in enumerate(normal.kinds) if kind in ("F", "U", "M")]
        self._known: dict[tuple[int, Letter], tuple[Clause, ...]] = {}
        self._rewritten: dict[Letter, list[tuple[Clause, ...]]] = {}
        self._steps = 0

    def kept(self, put_off: int) -> int:
        """Return marks for the eventualities that were not put off."""
        return sum(1 << mark for mark, entry in enumerate(self.eventualities) if not put_off >> entry & 1)

    def read(self, obligations: int, letter: Letter) -> tuple[Clause, ...]:
        """Return every way to meet the obligations at this letter."""
        letter = letter & self.propositions
        key = (obligations, letter)
        if key not in self._known:
            ways = self._rewritten.get(letter)
            if ways is None:
                ways = self._rewritten[letter] = self._ways(letter)
            clauses: tuple[Clause, ...] = ((0, 0),)
            for entry, options in enumerate(ways):
                if obligations >> entry & 1:
                    clauses = self._both(clauses, options)
            self._known[key] = clauses
        return self._known[key]

    def _ways(self, letter: Letter) -> list[tuple[Clause, ...]]:
        ways: list[tuple[Clause, ...]] = []
        yes: tuple[Clause, ...] = ((0, 0),)
        for i, (kind, arguments, name) in enumerate(
            zip(self.normal.kinds, self.normal.arguments, self.normal.names, strict=True)
        ):
            again: tuple[Clause, ...] = ((1 << i, 0),)
            put_off: tuple[Clause, ...] = ((1 << i, 1 << i),)
            match kind:
                case "true" | "false":
                    way = yes if kind == "true" else ()
                case "name" | "not":
                    way = yes if (name in letter) == (kind == "name") else ()
                case "and":
                    way = yes
                    for argument in arguments:
                        way = self._both(way, ways[argument])
                case "or":
                    way = self._smallest([clause for argument in arguments for clause in ways[argument]])
                case "X" | "X[!]":
                    way = ((1 << arguments[0], 0),)
                case "F":
                    way = self._smallest([*ways[arguments[0]], *put_off])
                case "G":
                    way = self._both(ways[arguments[0]], again)
                case "U":
                    way = self._smallest([*ways[arguments[1]], *self._both(ways[arguments[0]], put_off)])
                case "W":
                    way = self._smallest([*ways[arguments[1]], *self._both(ways[arguments[0]], again)])
                case "R":
                    way = self._both(ways[arguments[1]], self._smallest([*ways[arguments[0]], *again]))
                case "M":
                    way = self._both(ways[arguments[1]], self._smallest([*ways[arguments[0]], *put_off]))
            ways.append(way)
        return ways

    def _both(self, first: Iterable[Clause], second: Iterable[Clause]) -> tuple[Clause, ...]:
        first, second = tuple(first), tuple(second)
        self._count(len(first) * len(second))
        return self._smallest([(a | c, b | d) for a, b in first for c, d in second])

    def _smallest(self, clauses: list[Clause]) -> tuple[Clause, ...]:
        """Drop clauses that ask for all that another asks for, and more."""
        kept: list[Clause] = []
        for clause in sorted(set(clauses), key=lambda c: (c[0].bit_count() + c[1].bit_count(), c)):
            self._count(len(kept))
            if not any(a & clause[0] == a and b & clause[1] == b for a, b in kept):
                kept.append(clause)
                if len(kept) > MAX_CLAUSES:
                    raise OutOfBudget(f"one letter leaves more than {MAX_CLAUSES} ways to meet the formula")
        return tuple(kept)

    def _count(self, steps: int) -> None:
        self._steps += steps
        if self._steps > MAX_STEPS:
            raise OutOfBudget(f"reading the formula takes more than {MAX_STEPS} steps")


def _components(edges: list[list[_Edge]]) -> list[list[int]]:
    """Return the strongly connected components (Tarjan), without recursion."""
    low: dict[int, int] = {}
    number: dict[int, int] = {}
    on_stack: set[int] = set()
    stack: list[int] = []
    found: list[list[int]] = []
    for root in range(len(edges)):
        if root in number:
            continue
        work: list[tuple[int, int]] = [(root, 0)]
        while work:
            state, position = work.pop()
            if position == 0:
                number[state] = low[state] = len(number)
                stack.append(state)
                on_stack.add(state)
            descended = False
            for offset in range(position, len(edges[state])):
                target = edges[state][offset].target
                if target not in number:
                    work.append((state, offset + 1))
                    work.append((target, 0))
                    descended = True
                    break
                if target in on_stack:
                    low[state] = min(low[state], number[target])
            if descended:
                continue
            if low[state] == number[state]:
                component: list[int] = []
                while True:
                    member = stack.pop()
                    on_stack.discard(member)
                    component.append(member)
                    if member == state:
                        break
                found.append(component)
            if work:
                parent = work[-1][0]
                low[parent] = min(low[parent], low[state])
    return found


def _lasso(
    robot: RobotBehaviour, starts: list[tuple[int, int]], edges: list[list[_Edge]], inside: set[int], every: int
) -> BrokenRun:
    """Return a short prefix into the component and a short way round it that collects every mark."""
    node_of = dict(starts)
    prefix = _shortest(list(node_of), edges, lambda state: state in inside, None)
    entry = prefix[-1].target if prefix else next(state for state in node_of if state in inside)
    begin = prefix[0].source if prefix else entry
    # readings: the start's node, then the node of each edge
    head = [node_of[begin], *(edge.node for edge in prefix)]
    cycle: list[_Edge] = []
    at, marks = entry, 0
    while marks != every:
        way = _shortest_edge(at, edges, inside, every & ~marks)
        cycle.extend(way)
        for edge in way:
            marks |= edge.marks
        at = cycle[-1].target
    if at != entry:
        cycle.extend(_shortest([at], edges, lambda state: state == entry, inside))
    nodes = [*head, *(edge.node for edge in cycle)]
    letters = [robot.letters[node] for node in nodes]
    return BrokenRun(Word(tuple(letters[: len(head)]), tuple(letters[len(head) :])), tuple(nodes))


def _shortest(
    starts: list[int], edges: list[list[_Edge]], wanted: Callable[[int], bool], inside: set[int] | None
) -> list[_Edge]:
    came: dict[int, _Edge | None] = dict.fromkeys(starts)
    queue = deque(starts)
    while queue:
        state = queue.popleft()
        if wanted(state):
            return _back(came, state)
        for edge in edges[state]:
            if edge.target not in came and (inside is None or edge.target in inside):
                came[edge.target] = edge
                queue.append(edge.target)
    raise InternalError("A component of the search cannot be reached. This is a bug of ltlplan's.")


def _shortest_edge(start: int, edges: list[list[_Edge]], inside: set[int], missing: int) -> list[_Edge]:
    """Return a shortest way within the component whose last edge has a mark that is still missing."""
    came: dict[int, _Edge | None] = {start: None}
    queue = deque([start])
    while queue:
        state = queue.popleft()
        for edge in edges[state]:
            if edge.target not in inside:
                continue
            if edge.marks & missing:
                return [*_back(came, state), edge]
            if edge.target not in came:
                came[edge.target] = edge
                queue.append(edge.target)
    raise InternalError("A mark of a component was lost. This is a bug of ltlplan's.")


def _back(came: dict[int, _Edge | None], state: int) -> list[_Edge]:
    way: list[_Edge] = []
    edge = came[state]
    while edge is not None:
        way.append(edge)
        edge = came[edge.source]
    return way[::-1]
