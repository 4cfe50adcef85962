"""Lower bounds on what single robots pay, where all others show whatever a conjunct needs, at no cost.

Such a robot reads its own letters, and any letter of the team once where that helps. What it pays then it pays in every plan, and robots pay each by
themselves; so these bounds add up. A robot that shows a letter which breaks a conjunct whenever it is read has to leave it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice

from ltlplan.logic.automaton import DEAD
from ltlplan.search.joint.conjuncts import JointConjunct
from ltlplan.search.label_setting import distances
from ltlplan.search.memoization import memoized
from ltlplan.search.numbering import closure
from ltlplan.search.orders.state_sets import Known, Reading, Shown
from ltlplan.search.team_reading import UNREACHABLE
from ltlplan.systems.transition_systems import TransitionSystem

_MOST = 20_000
"""Nodes, with states of a conjunct, that are looked at; beyond them nothing is known."""

States = frozenset[int]
_At = tuple[int, States]
"""A node of the robot, and the states of the conjunct that are possible there."""
_END: _At = (-1, frozenset())


class HelpedRobots:
    """Robots, each with the help of all others, for all conjuncts; under `own`.

    Args:
        systems: One for each robot.
        shown: For each of them what it shows at each node.
        reading: How the formula reads them.
    """

    def __init__(self, systems: Sequence[TransitionSystem], shown: Sequence[Sequence[Shown]], reading: Reading) -> None:
        self._reading, letter = reading, reading.marks.letter
        self._robots = [
            [
                _Helped(system, [tuple(letter(sums) & part.mask for sums in each) for each in own], part, letters)
                for part, letters in zip(reading.marks.parts, self._letters(shown), strict=True)
            ]
            for system, own in zip(systems, shown, strict=True)
        ]

    @memoized
    def left(self, robot: int, node: int, known: Known) -> float:
        """Return the least that a robot still pays; `UNREACHABLE` where no help is enough.

        Args:
            robot: By index.
            node: Where it is.
            known: What is possible of the formula.
        """
        return max(
            each.left(node, states) for each, states in zip(self._robots[robot], self._reading.states(known), strict=True)
        )

    def _letters(self, shown: Sequence[Sequence[Shown]]) -> Iterator[list[int]]:
        """Yield, for each conjunct, what it sees of the letters that anybody may show."""
        every = {self._reading.marks.letter(sums) for own in shown for each in own for sums in each}
        for part in self._reading.marks.parts:
            yield sorted({letter & part.mask for letter in every})


class _Helped:
    """One robot that is helped, for one conjunct.

    Args:
        system: The robot's.
        own: For each node the letters that may be read there, as bits.
        part: The conjunct.
        letters: What others may show, as bits.
    """

    def __init__(
        self, system: TransitionSystem, own: Sequence[tuple[int, ...]], part: JointConjunct, letters: Sequence[int]
    ) -> None:
        self._system, self._own, self._part, self._letters = system, own, part, letters
        self._left: dict[_At, float] = {}

    def left(self, node: int, states: States) -> float:
        """Return the least that the robot still pays; 0 where that takes too long to find out."""
        if (node, states) not in self._left:
            self._look_from((node, states))
        return self._left[node, states]

    def _look_from(self, start: _At) -> None:
        """Find out what is left at all that can be reached."""
        before: dict[_At, list[tuple[_At, float]]] = {}

        def onwards(at: _At) -> Iterator[_At]:
            for after, cost in self._onwards(at):
                before.setdefault(after, []).append((at, cost))
                yield after

        reached = list(islice(closure([start], onwards), _MOST + 1))
        if len(reached) > _MOST:
            self._left[start] = 0.0
            return
        endings = ((at, self._system.ending(at[0])) for at in reached if all(map(self._part.accepting, at[1])))
        ends = [(at, end) for at, end in endings if end is not None]
        least = distances([_END], lambda at: ends if at == _END else before.get(at, ()))
        self._left |= {at: least.get(at, UNREACHABLE) for at in reached}

    def _onwards(self, at: _At) -> Iterator[tuple[_At, float]]:
        node, states = at
        for letter in self._letters:
            if (after := self._read(states, (letter,), self._own[node])) is not None:
                yield (node, after), 0.0
        for target, cost in self._system.edges[node]:
            is_event = self._system.labels[target] != self._system.labels[node]
            after = self._read(states, self._own[target], self._own[target]) if is_event else states
            if after is not None:
                yield (target, after), cost

    @memoized
    def _read(self, states: States, first: tuple[int, ...], held: tuple[int, ...]) -> States | None:
        """Return the states after one of some letters, and then any that are held, as often as one likes; None where some lose the task."""
        begun, step = {self._part.step(state, letter) for state in states for letter in first}, self._part.step
        found = frozenset(closure(begun, lambda state: (step(state, letter) for letter in held)))
        return None if DEAD in found else found
