"""A team's systems as one graph, in which only the places that matter to a task are left.

On a grid of a hundred places a formula speaks of five. The others, and the free flight between them, show letters that
change nothing: either they leave every state of every conjunct as it is, or they act like the letter shown before and
reading that once more changes nothing. A search need not stop there. So each place that matters gets direct edges to the
places that can be next to matter, as long as the shortest way between them, and the search walks over these: the same
words up to letters that change nothing, the same smallest costs, far fewer states.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

from ltlplan.logic.product_automaton import Task
from ltlplan.logic.transition_monoid import Element, TransitionMonoid
from ltlplan.search.label_setting import BestFirst
from ltlplan.search.numbering import closure
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Letter

TIE = 1e-10
"""Added to every edge, so that of equally long ways the one with the fewest steps is taken."""

MAX_TABLE = 50_000
"""States times letters of a conjunct's automaton up to which letters are compared by what they do to every state."""

START = -1
"""In place of the node from which ways begin: it is another one to come back to."""


class Team:
    """The systems of all robots, with their letters numbered.

    Attributes:
        systems: One for each robot.
        letters: All letters that any robot can show; one that is shown at a wall between two rooms is one of its own.
        walls: For such letters, by number: the room that is left, and the one that is entered.
        label: For each robot and node, the number of its letter.
        common: How many nodes, the first ones, all robots share: same letters, edges and preferences.
    """

    def __init__(self, systems: Sequence[TransitionSystem]) -> None:
        numbers: dict[tuple[Letter, tuple[str, str] | None], int] = {}
        self.systems = tuple(systems)
        self.label = [
            [numbers.setdefault((label, system.walls.get(node)), len(numbers)) for node, label in enumerate(system.labels)]
            for system in systems
        ]
        self.letters: tuple[Letter, ...] = tuple(letter for letter, _ in numbers)
        self.walls = {number: rooms for number, (_, rooms) in enumerate(numbers) if rooms is not None}
        self.common = _common(self.systems, self.label)

    def letters_of(self, paths: Sequence[Sequence[int]]) -> list[list[int]]:
        """Return each robot's letters along its path, by number."""
        return [[label[node] for node in path] for label, path in zip(self.label, paths, strict=True)]


def staying(system: TransitionSystem) -> TransitionSystem:
    """Return what a robot can do that never leaves its start."""
    return replace(system, edges=((),) * len(system.edges))


@dataclass(slots=True)
class Successors:
    """Successors of a node that matters.

    Attributes:
        edges: Pairs (next node that matters, cost of the shortest way there).
        ending: What it costs to end the word before anything else matters; None where the robot may not end.
        before: The node before each one on the shortest ways; `START` before the first.
        last: Where to end most cheaply; `START` for where the robot is.
    """

    edges: tuple[tuple[int, float], ...]
    ending: float | None
    before: dict[int, int] = field(repr=False)
    last: int = START


class ReducedGraph:
    """A team's graph with the nodes that matter to a task, joined by shortest ways.

    Args:
        team: Whose graph.
        silent: For each letter: True where it never changes anything, False where repeating it does not, None where it may.
        classes: For each letter, the first one that acts like it (see `letter_classes`).

    Attributes:
        team: Whose graph.
        start: Each robot's first node.
        label: For each robot and node, the first letter that acts like its letter.
        width: More than any node's number.
        entering: For each letter, the smallest cost of any edge to a node that shows it; 0 where a robot begins with it.
    """

    def __init__(self, team: Team, silent: Sequence[bool | None], classes: Sequence[int]) -> None:
        self.team = team
        self.start = [system.initial for system in team.systems]
        self.width = max(len(system.labels) for system in team.systems)
        self._silent, self._classes = silent, classes
        self._changing_nothing = frozenset(letter for letter, changes_nothing in enumerate(silent) if changes_nothing)
        self.label = [[classes[letter] for letter in label] for label in team.label]
        self._shared: dict[int, Successors] = {}
        self._own: list[dict[int, Successors]] = [{} for _ in team.systems]
        self.entering = self._entering()

    def successors(self, robot: int, node: int) -> Successors:
        """Return what can follow a robot's node."""
        known = self._shared if node < self.team.common else self._own[robot]
        found = known.get(node)
        if found is None:
            found = known[node] = self._walk(robot, node)
        return found

    def expand(self, robot: int, nodes: Sequence[int]) -> tuple[int, ...]:
        """Return a robot's whole path through these nodes that matter, up to the cheapest place to end at."""
        path = [nodes[0]]
        for node, after in itertools.zip_longest(nodes, nodes[1:]):
            here = self.successors(robot, node)
            at = here.last if after is None else after
            way: list[int] = []
            while at != START:
                way.append(at)
                at = here.before[at]
            path += reversed(way)
        return tuple(path)

    def key(self, robot: int, node: int) -> tuple[int, int]:
        """Return a node's name in the whole team: nodes that all robots share belong to robot -1."""
        return (-1 if node < self.team.common else robot, node)

    def reached(self) -> list[tuple[int, int]]:
        """Return all nodes that matter and can be reached, by their names in the whole team."""

        def onwards(key: tuple[int, int]) -> Iterator[tuple[int, int]]:
            robot = max(key[0], 0)
            return (self.key(robot, target) for target, _ in self.successors(robot, key[1]).edges)

        return list(closure([self.key(robot, start) for robot, start in enumerate(self.start)], onwards))

    def _entering(self) -> list[float]:
        entering = [float("inf")] * len(self.team.letters)
        for robot, node in self.reached():
            label = self.label[max(robot, 0)]
            for target, cost in self.successors(max(robot, 0), node).edges:
                entering[label[target]] = min(entering[label[target]], cost)
        for label, start in zip(self.label, self.start, strict=True):
            entering[label[start]] = 0.0
        return entering

    def _walk(self, robot: int, source: int) -> Successors:
        """Find the shortest ways from one node, over nodes that change nothing after it."""
        system, label = self.team.systems[robot], self.label[robot]
        edges, own = system.edges, label[source]
        through = self._changing_nothing if self._silent[own] is None else self._changing_nothing | {own}
        found: dict[int, float] = {}
        unreachable = float("inf")

        def successors(node: int) -> Iterator[tuple[int, float]]:
            cost = search.costs[node]
            for target, step in edges[source if node == START else node]:
                if label[target] in through:
                    if target != source:
                        yield target, step + TIE
                elif (total := cost + step + TIE) < found.get(target, unreachable):
                    found[target] = total
                    search.parents[target] = node

        search = BestFirst([START], successors)
        ending, last = None, START
        for node, cost, _ in search:
            extra = system.ending(source if node == START else node)
            if extra is not None and (ending is None or cost + extra < ending):
                ending, last = cost + extra, node
        return Successors(tuple(found.items()), ending, search.parents, last)


def letter_classes(task: Task) -> tuple[list[bool | None], list[int]]:
    """Return what repeating letters does, and for each letter the first one that acts like it on every state.

    Returns:
        For each letter: True where it changes no state at all, False where reading it twice is the same as reading it
        once, None where it is not; then, for each letter, the number of the first letter like it.
    """
    monoid = TransitionMonoid(
        task, [i for i, part in enumerate(task.parts) if len(part.identity) * len(part.views) <= MAX_TABLE]
    )
    large = [part.view for part in task.parts if len(part.identity) * len(part.views) > MAX_TABLE]
    numbers: dict[tuple[Element, tuple[int, ...]], int] = {}
    classes: list[int] = []
    silent: list[bool | None] = []
    for letter in range(len(task.letters)):
        element = monoid.read(monoid.identity, letter)
        classes.append(numbers.setdefault((element, tuple(view[letter] for view in large)), letter))
        if large:
            silent.append(None)  # of a large automaton only that letters alike to it are alike is known
        elif element == monoid.identity:
            silent.append(True)
        else:
            silent.append(False if monoid.compose(element, element) == element else None)
    return silent, classes


def _common(systems: Sequence[TransitionSystem], label: Sequence[Sequence[int]]) -> int:
    """Return how many of the first nodes are the same for all robots, with no edge to later ones."""
    if len(systems) == 1:
        return 0
    first = systems[0]
    count = min(len(system.labels) for system in systems)
    for system, letters in zip(systems[1:], label[1:], strict=True):
        same = (
            letters[node] == label[0][node]
            and system.edges[node] == first.edges[node]
            and system.ending(node) == first.ending(node)
            for node in range(count)
        )
        count = next((node for node, is_same in enumerate(same) if not is_same), count)
    return count if all(target < count for node in range(count) for target, _ in first.edges[node]) else 0
