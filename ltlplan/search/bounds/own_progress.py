"""Resting places of robots, and the progress of each that the formula names with the conjuncts that speak of it alone.

Such a conjunct reads no letters but that robot's, so that what is left of it depends on where that robot is and on nobody else: it is found
exactly, and added up over robots. A position is a class of places, of a robot that is named together with the states of its own conjuncts.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ltlplan.logic.automaton import DEAD
from ltlplan.search.counting.classes import Classes
from ltlplan.search.counting.counting_propositions import States, Sums
from ltlplan.search.numbering import Numbers

MOST_POSITIONS = 200
"""Positions of one robot that is named; where it has more, its own conjuncts are not told apart."""

Position = tuple[int, States]


class Way(NamedTuple):
    """A move from one position to another, or none, while its robot's letter is read again.

    Attributes:
        source: A position, by number.
        target: Another one.
        cost: Of the move.
        marks: What the robot shows on the way, the target last.
    """

    source: int
    target: int
    cost: float
    marks: tuple[Sums, ...]


class Positions:
    """All positions of a team, and the ways between them.

    Args:
        classes: The team's.

    Attributes:
        known: All positions, by number.
        ways: For each robot that is named, and for all others together, their positions and the ways between these.
        done: Whether a robot at a position has nothing left to do by itself; nobody that is not named has.
        own: The conjuncts, by index, that speak of one robot alone.
    """

    def __init__(self, classes: Classes) -> None:
        self._classes, self._conjuncts = classes, classes.marks.conjuncts
        self._own: dict[str, tuple[int, ...]] = {}
        self._numbers = Numbers[Position]()
        self.known, self.ways = self._numbers.known, list[tuple[range, list[Way]]]()
        for robot in dict.fromkeys(classes.owners):
            own = tuple(k for k, conjunct in enumerate(self._conjuncts) if robot and conjunct.robot == robot)
            self._own[robot] = own if self._added(robot, own) else ()
            if own and not self._own[robot]:
                self._added(robot, ())
        self.own = frozenset(k for own in self._own.values() for k in own)
        accepts = [conjunct.part.accepting for conjunct in self._conjuncts]
        self.done = [
            not own or (classes.ends[place] and all(accepts[k](state) for k, state in zip(own, states, strict=True)))
            for place, states in self.known
            for own in (self._own[classes.owners[place]],)
        ]

    def of(self, place: int, states: States) -> int:
        """Return the position, by number, of a robot that rests at a class.

        Args:
            place: The class.
            states: The states of all conjuncts.
        """
        return self._numbers[place, tuple([states[k] for k in self._own[self._classes.owners[place]]])]

    def _added(self, robot: str, own: Sequence[int]) -> bool:
        """Add the positions of a robot, or of all that are not named, and the ways between them; tell whether they are few enough."""
        classes = self._classes
        begin, conjuncts = classes.sums(classes.begin), [self._conjuncts[k] for k in own]
        first = tuple([conjunct.read(conjunct.part.initial, conjunct.cut(begin)) for conjunct in conjuncts])
        places = [place for place, owner in enumerate(classes.owners) if owner == robot]
        begun = Numbers[Position]((place, first) for place in places if not own or classes.begin[place])
        steps: list[tuple[Position, Position, float, tuple[Sums, ...]]] = []
        for at in begun.known:  # grows while it is walked
            for to, cost, marks in self._steps(own, at):
                steps.append((at, to, cost, marks))
                if own and begun[to] >= MOST_POSITIONS:
                    return False
        number = {at: self._numbers[at] for at in begun}
        ways = [Way(number[at], number[to], cost, marks) for at, to, cost, marks in steps]
        self.ways.append((range(len(self.known) - len(begun), len(self.known)), ways))
        return True

    def _steps(self, own: Sequence[int], at: Position) -> Iterator[tuple[Position, float, tuple[Sums, ...]]]:
        """Yield what can follow a position, with its cost and marks."""
        place, states = at
        again = (place, 0.0, (self._classes.resting[place],))
        for target, cost, marks in (*((move.target, move.cost, move.marks) for move in self._classes.moves[place]), again):
            after = states
            for shown in marks:
                pairs = zip(own, after, strict=True)
                after = tuple([self._conjuncts[k].read(state, self._conjuncts[k].cut(shown)) for k, state in pairs])
            if DEAD not in after:
                yield (target, after), cost, marks
