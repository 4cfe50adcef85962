"""Conjuncts by what robots have to do about them: the decomposition set of a formula, conjunct by conjunct.

The rest of a mission may be handed to another robot where each conjunct by itself is as at the start, or done. So there are three kinds. A
*free* task can be done by anybody at any time: nothing ever loses it, and what is done stays done (`F a`, `F(a & F b)`). An *own* task is one
that others can lose (`!b U a`): one robot does it, and all others leave it as it was, or done. All other conjuncts hold from the start, and
every robot *keeps* them by itself, whatever was read before. Words that are shared like that keep own and kept conjuncts in every order
of the robots, by induction over the order; whoever asks looks at the free ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

from ltlplan.logic.conjunct_automata import is_task, reached_states
from ltlplan.logic.product_automaton import Task

MOST_STATES = 64
"""Of a conjunct's automaton, up to which all its states are looked at."""


class TaskKinds:
    """The conjuncts of a task, by what robots have to do about them.

    Attributes:
        free: Those that anybody does at any time, by index.
        own: Those that one robot does, and all others leave alone.
        kept: Those that every robot keeps by itself.
        readable: Whether all of them are small enough to look at all states.
    """

    def __init__(self, task: Task, starts: Sequence[int], *, lost: frozenset[int] = frozenset()) -> None:
        """Sort conjuncts.

        Args:
            task: Whose.
            starts: Each robot's first letter.
            lost: Conjuncts, by index, that are not to be free: some order of the robots was seen to break them.
        """
        self.parts = task.parts
        self.reached = [reached_states(part, MOST_STATES) for part in task.parts]
        self.readable = all(self.reached)
        self.free = tuple(
            i for i in range(len(task.parts)) if self.readable and i not in lost and is_task(task.parts[i], self.reached[i])
        )
        others = [i for i in range(len(task.parts)) if i not in self.free]
        self.own: tuple[int, ...] = tuple(i for i in others if not all(self.done_by(i, letter) for letter in starts))
        self.kept: tuple[int, ...] = tuple(i for i in others if i not in self.own)

    def done_by(self, index: int, letter: int) -> bool:
        """Tell whether a conjunct holds when one letter was read.

        Args:
            index: The conjunct's.
            letter: Its number.
        """
        part = self.parts[index]
        return part.accepting(part.row(part.initial)[letter])

    def free_alone(self) -> TaskKinds:
        """Return free tasks alone, as if nothing else were asked: what they cost so is a lower bound."""
        found = copy(self)
        found.own = found.kept = ()
        return found

    def begun(self, index: int) -> tuple[int, ...]:
        """Return the states of which a conjunct's word is followed: the initial one, then the accepting ones."""
        part = self.parts[index]
        return (part.initial, *(s for s in self.reached[index] if s != part.initial and part.accepting(s)))
