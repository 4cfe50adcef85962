"""Team words of robots that give fixed words and keep precedences: an event is over before another one happens.

An event is a robot's coming to a letter of its word. What is not ordered happens in any order, or at one instant.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Hashable, Iterator, Mapping, Sequence

from verify.data.language.word import Letter
from verify.logic.progression import OutOfBudget
from verify.logic.team_letters import Together
from verify.model_checking.team_graph import MAX_TOGETHER, Observation, Step

Event = tuple[int, int]
"""A robot, by number, and the index of the letter that it comes to; a letter that a word begins with is none."""

Before = Mapping[Event, Sequence[Event]]
"""For an event those that must be over."""


class _Ordered:
    """Next moves that the precedences permit.

    Args:
        words: Each robot's letters.
        before: What each event waits for.
    """

    def __init__(self, words: Sequence[Sequence[Letter]], before: Before) -> None:
        self.words, self.before = tuple(map(tuple, words)), before
        self.ends = tuple(len(word) - 1 for word in self.words)

    def ready(self, nodes: tuple[int, ...], robot: int) -> bool:
        """Return whether a robot may come to its next letter while all are where they are."""
        node = nodes[robot] + 1
        if node > self.ends[robot]:
            return False
        return all(nodes[other] >= index for other, index in self.before.get((robot, node), ()))


class OrderedTurns(_Ordered):
    """One robot's letter at a time: a letter is read at least once before its robot goes on, and as often as one likes.

    A state is (index of every robot's letter, bits): bit r says that robot r's letter has been read. Of robots that are alike the first ones
    are never behind the others: those can change places from where they are equally far.

    Args:
        words: Each robot's letters.
        before: What each event waits for.
    """

    def __init__(self, words: Sequence[Sequence[Letter]], before: Before) -> None:
        super().__init__(words, before)
        self.ahead = {after: robot for alike in alike_robots(self.words, before) for robot, after in itertools.pairwise(alike)}

    def initial(self) -> Iterator[Step]:
        """Yield the beginning, when nobody has been read."""
        yield None, ((0,) * len(self.words), 0)

    def steps(self, state: tuple[tuple[int, ...], int]) -> Iterator[Step]:
        """Read any robot, or let one go on."""
        nodes, bits = state
        for robot, word in enumerate(self.words):
            bit, may_go_on = 1 << robot, self._is_behind(state, robot)
            if bits & bit or may_go_on:
                yield Observation(robot, word[nodes[robot]], nodes), (nodes, bits | bit)
            if bits & bit and may_go_on and self.ready(nodes, robot):
                yield None, ((*nodes[:robot], nodes[robot] + 1, *nodes[robot + 1 :]), bits & ~bit)

    def _is_behind(self, state: tuple[tuple[int, ...], int], robot: int) -> bool:
        """Tell whether a robot is not as far as the one before it of those that are alike, if there is one."""
        (nodes, bits), other = state, self.ahead.get(robot)
        return other is None or (nodes[robot], bits >> robot & 1) < (nodes[other], bits >> other & 1)

    def is_final(self, state: tuple[tuple[int, ...], int]) -> bool:
        """Return whether all have been read in their last letters."""
        nodes, bits = state
        return nodes == self.ends and bits == (1 << len(self.words)) - 1

    def stronger(self, state: tuple[tuple[int, ...], int]) -> tuple[Hashable, int]:
        """Return the positions, and the robots that have been read, which alone may go on."""
        return state


class OrderedTogether(_Ordered):
    """The union of all letters as time passes; events of different robots that are not ordered may share an instant.

    Args:
        words: Each robot's letters.
        before: What each event waits for.
        together: Puts letters together where their union is not all that is asked.
    """

    def __init__(self, words: Sequence[Sequence[Letter]], before: Before, together: Together | None = None) -> None:
        super().__init__(words, before)
        self.together = together
        self.alike = alike_robots(self.words, before)
        self._read: dict[tuple[int, ...], Observation] = {}

    def _observation(self, nodes: tuple[int, ...]) -> Observation:
        known = self._read.get(nodes)
        if known is None:
            known = self._read[nodes] = self._reading(nodes)
        return known

    def _reading(self, nodes: tuple[int, ...]) -> Observation:
        letters = [word[node] for word, node in zip(self.words, nodes, strict=True)]
        if self.together is not None:
            return Observation(None, self.together((letter, 1) for letter in letters), nodes)
        return Observation(None, frozenset[str]().union(*letters), nodes)

    def initial(self) -> Iterator[Step]:
        """Yield the beginning, when all hold their first letters."""
        nodes = (0,) * len(self.words)
        yield self._observation(nodes), nodes

    def steps(self, state: tuple[int, ...]) -> Iterator[Step]:
        """Read again, or let robots go on together, each by one letter; of those that are alike and at one letter it matters how many.

        Raises:
            OutOfBudget: More robots than `MAX_TOGETHER` may change their letters at one instant, or so many kinds of them.
        """
        options = [list(self._further(alike, state)) for alike in self.alike]
        if math.prod(map(len, options)) > 2**MAX_TOGETHER:
            raise OutOfBudget(f"more than {MAX_TOGETHER} robots can change their letters at one instant")
        for chosen in itertools.product(*options):
            nodes = list(state)
            for alike, places in zip(self.alike, chosen, strict=True):
                for robot, node in zip(alike, places, strict=True):
                    nodes[robot] = node
            after = tuple(nodes)
            yield self._observation(after), after

    def _further(self, alike: Sequence[int], state: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
        """Yield where robots that are alike may be next, in order of their letters: so the same robots are further on all the time."""
        groups: list[list[tuple[int, ...]]] = []
        for node, at_it in itertools.groupby(alike, key=lambda robot: state[robot]):
            robots = list(at_it)
            going = len(robots) if self.ready(state, robots[0]) else 0
            groups.append([(*(node,) * (len(robots) - more), *(node + 1,) * more) for more in range(going + 1)])
        for places in itertools.product(*groups):
            yield tuple(sorted(itertools.chain(*places)))

    def is_final(self, state: tuple[int, ...]) -> bool:
        """Return whether all hold their last letters."""
        return state == self.ends

    def stronger(self, state: Hashable) -> tuple[Hashable, int]:
        """Return no bits, as no state can do more than another."""
        return state, 0


def alike_robots(words: Sequence[Sequence[Letter]], before: Before) -> list[list[int]]:
    """Return robots in groups whose members can change places: they give the same word, and wait and are waited for alike.

    Args:
        words: Each robot's letters.
        before: What each event waits for.
    """
    pairs = {(first, then) for then, events in before.items() for first in events}
    of_robot: list[set[tuple[Event, Event]]] = [set() for _ in words]
    for pair in pairs:
        for robot, _ in pair:
            of_robot[robot].add(pair)

    def alike(a: int, b: int) -> bool:
        change = {a: b, b: a}
        return all(((change.get(r, r), i), (change.get(s, s), j)) in pairs for (r, i), (s, j) in of_robot[a] | of_robot[b])

    groups: list[list[int]] = []
    for robot, word in enumerate(words):
        same = (group for group in groups if tuple(words[group[0]]) == tuple(word) and alike(group[0], robot))
        found = next(same, None)
        if found is None:
            groups.append([robot])
        else:
            found.append(robot)
    return groups
