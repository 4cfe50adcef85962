"""Team words that precedences leave open: one that breaks the formula, or none.

From one order of all events that satisfies the formula `needed_orders` takes few precedences under which every team word does. They are added for as long as some team word that keeps them breaks the formula: of those that the order has and that word has
not, the one that is easiest to fly and asks least. Then each that can be done without is left out again.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.budget import TooLarge
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.label_setting import Label, ParetoSearch
from ltlplan.search.memoization import memoized
from ltlplan.search.orders.event_names import Event, Names, Pair, unlikeness
from ltlplan.search.orders.state_sets import Reading, Shown
from verify.data.plan import Precedence

At = tuple[int, ...]
"""For each robot the index of its letter."""
MOST_STEPS = 400_000
"""Steps of looking for a team word that breaks one conjunct."""


@dataclass(frozen=True, slots=True)
class BreakingWord:
    """A team word that keeps some precedences and breaks a conjunct.

    Attributes:
        part: Which conjunct, by index.
        way: Where robots are, one event after another or several at once.
        reader: Whose letter was read last: a robot, or 0 for the whole team under `joint`.
    """

    part: int
    way: tuple[At, ...]
    reader: int


_Node = tuple[At, int, int]
"""Where robots are, the conjunct's state, and the readers (robots, or the team) not yet read, as bits."""


class Linearisations:
    """The team words of robots that give fixed words.

    Args:
        marks: What the formula sees.
        words: For each robot what it shows, letter by letter.
        joint: Whether the letter of the whole team is read, or each robot's by itself.
    """

    def __init__(self, marks: Marks, words: Sequence[Sequence[Shown]], *, joint: bool) -> None:
        self.marks, self.words, self.joint = marks, tuple(map(tuple, words)), joint
        self._reading = Reading(marks, joint=joint)

    def broken(self, pairs: Sequence[Pair]) -> BreakingWord | None:
        """Return a team word that keeps precedences and breaks the formula; None where all of them satisfy it.

        Args:
            pairs: The precedences that are kept.

        Raises:
            TooLarge: There are too many team words.
        """
        found = (self.breaking(index, pairs) for index in range(len(self.marks.parts)))
        return next((word for word in found if word is not None), None)

    @memoized
    def robots(self, index: int) -> frozenset[int]:
        """Return the robots whose letters can matter to one conjunct, by its index."""
        return frozenset(robot for robot, word in enumerate(self.words) if self._reading.matters(index, word))

    def breaking(self, index: int, pairs: Sequence[Pair] = ()) -> BreakingWord | None:
        """Return a team word that keeps precedences and breaks one conjunct; None where all of them satisfy it.

        Robots that neither matter to it nor are in a precedence stay at their first letters, which show it the same as all others of theirs.
        Of robots that are alike to it, the first one is never behind the others.

        Args:
            index: The conjunct's.
            pairs: The precedences that are kept.

        Raises:
            TooLarge: There are too many team words.
        """
        part, before = self.marks.parts[index], dict[Event, list[Event]]()
        movers = self.robots(index).union(robot for pair in pairs for robot, _ in pair)
        named = {event for pair in pairs for event in pair}
        places = [self._told_apart(index, robot, named) if robot in movers else [0] for robot in range(len(self.words))]
        words = [[word[place] for place in own] for word, own in zip(self.words, places, strict=True)]
        for first, then in (((robot, places[robot].index(place)) for robot, place in pair) for pair in pairs):
            before.setdefault(then, []).append(first)
        ends = tuple(len(word) - 1 for word in words)
        readers = [0] if self.joint else sorted(movers)
        start, unread = (0,) * len(words), sum(1 << reader for reader in readers)
        ahead = {} if self.joint else self._ahead(index, words, before)

        def is_behind(robot: int, at: At, unread: int) -> bool:
            other = ahead.get(robot)
            return other is None or (at[robot], unread >> other & 1) < (at[other], unread >> robot & 1)

        def following(node: _Node) -> Iterator[tuple[int | None, _Node]]:
            at, state, unread = node
            letters = self._reading.letters(tuple(word[place] for word, place in zip(words, at, strict=True)))
            for reader, letter in ((who, own) for who in readers for own in letters[who]):
                if not unread >> reader & 1 or is_behind(reader, at, unread):
                    yield reader, (at, part.step(state, letter), unread & ~(1 << reader))
            ready = [
                robot
                for robot, place in enumerate(at)
                if place < ends[robot]
                and not unread >> (0 if self.joint else robot) & 1
                and all(at[other] >= index for other, index in before.get((robot, place + 1), ()))
            ]
            if not self.joint:
                for robot in ready:
                    if is_behind(robot, at, unread):
                        place = at[robot] + 1
                        bit = 0 if self._reading.is_idle(words[robot][place], index) else 1 << robot
                        yield None, ((*at[:robot], place, *at[robot + 1 :]), state, unread | bit)
                return
            for choice in itertools.product((0, 1), repeat=len(ready)):  # any of them at one instant
                if any(choice):
                    moved = list(at)
                    for robot, moves in zip(ready, choice, strict=True):
                        moved[robot] += moves
                    yield None, (tuple(moved), state, 1)

        def successors(label: Label[_Node]) -> Iterator[Label[_Node]]:
            for reader, node in () if part.finished(label.state[1]) else following(label.state):
                yield Label(node, (), 0.0, (-sum(node[0]),), label, reader)

        first = (
            Label[_Node]((start, part.step(part.initial, letter), unread & ~(1 << reader)), (), 0.0, (0,), None, reader)
            for reader, own in enumerate(self._reading.letters(tuple(word[0] for word in words)))
            for letter in own
        )
        search = ParetoSearch(first, successors)  # nothing is paid: each node comes once, those near the end first
        for label in search:
            at, state, unread = label.state
            if state == DEAD or (at == ends and not unread and not part.accepting(state)):
                path = label.path()
                read = [each.step for each in path if isinstance(each.step, int)]
                way = [tuple(own[place] for own, place in zip(places, each.state[0], strict=True)) for each in path]
                return BreakingWord(index, tuple(at for at, _ in itertools.groupby(way)), (read or [0])[-1])
            if search.reached > MOST_STEPS:
                raise TooLarge("Trying all orders of some robots' events takes", search.reached, "steps", MOST_STEPS)
        return None

    def _told_apart(self, index: int, robot: int, named: Collection[Event]) -> list[int]:
        """Return the letters of a robot, by index, without those that are to one conjunct like the one before; those of named events stay."""
        word = self.words[robot]
        if self.joint:
            return list(range(len(word)))
        later = (i for i in range(1, len(word)) if (robot, i) in named or not self._reading.alike(index, word[i - 1], word[i]))
        return [0, *later]

    def _ahead(self, index: int, words: Sequence[Sequence[Shown]], before: Mapping[Event, Sequence[Event]]) -> dict[int, int]:
        """Return, for robots that are alike to one conjunct and its precedences, the one before each."""
        last, found = dict[Hashable, int](), dict[int, int]()
        for robot, word in enumerate(words):
            waits = frozenset((i, other) for i in range(len(word)) for other in before.get((robot, i), ()))
            waited = frozenset((i, then) for then, firsts in before.items() for who, i in firsts if who == robot)
            key = (tuple(self._reading.effects(index, letter) for letter in word), waits, waited)
            if key in last:
                found[robot] = last[key]
            last[key] = robot
        return found


def needed_orders(words: Linearisations, order: Sequence[Event], names: Names) -> dict[Pair, Precedence] | None:
    """Return precedences that suffice, as plans say them, or None where those that a plan can say do not.

    Args:
        words: The robots' words, and the formula.
        order: All events in an order all of whose team words satisfy the formula.
        names: What plans say of events.

    Raises:
        TooLarge: There are too many team words.
    """
    place = {event: index for index, event in enumerate(order)}
    said = {pair: names.precedence(pair) for pair in itertools.combinations(order, 2) if pair[0][0] != pair[1][0]}
    named = {pair: precedence for pair, precedence in said.items() if precedence is not None}
    offered = sorted(named, key=lambda pair: (unlikeness(named[pair]), place[pair[0]] - place[pair[1]], pair))
    pairs: list[Pair] = []
    while (broken := words.broken(pairs)) is not None:
        missing = next((pair for pair in offered if _breaks(broken.way, pair)), None)
        if missing is None:
            return None
        pairs.append(missing)
    for pair in sorted(pairs, key=offered.index, reverse=True):
        others = [other for other in pairs if other != pair]
        if words.broken(others) is None:
            pairs = others
    return {pair: named[pair] for pair in sorted(pairs, key=lambda each: (place[each[1]], place[each[0]]))}


def _breaks(way: Sequence[At], pair: Pair) -> bool:
    """Tell whether a team word does not keep a precedence."""
    (robot, index), (other, then) = pair
    for before, after in itertools.pairwise(way):
        if before[other] < then <= after[other]:
            return before[robot] < index
    return False
