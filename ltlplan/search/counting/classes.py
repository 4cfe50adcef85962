"""Classes of places: robots that rest in one class can do the same and are not told apart, so they are only counted."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from operator import mul, sub

from ltlplan.search.counting.counting_propositions import Marks, Sums

Numbers = tuple[int, ...]
"""How many robots rest in each class of places."""


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


@dataclass(frozen=True, slots=True)
class Change:
    """Change of a team's letters by one robot's move.

    Attributes:
        move: The move.
        letters: For each of its letters the difference to the sums of marks before the move.
        entered: Small regions, by number, that the robot enters.
    """

    move: ClassMove
    letters: tuple[Sums, ...]
    entered: tuple[int, ...]


@dataclass(frozen=True)
class Classes:
    """The abilities of a team, over classes that are numbered.

    Attributes:
        marks: What the formula sees.
        resting: For each class the marks that a robot makes that rests there.
        ends: For each class whether the flight may end there.
        moves: For each class the moves from it.
        begin: How many robots start in each class.
        owners: For each class the robot that alone comes to it, as the formula names it; empty where none is named.
        crowds: Small regions, none of which holds too many robots at rest.
    """

    marks: Marks
    resting: tuple[Sums, ...]
    ends: tuple[bool, ...]
    moves: tuple[tuple[ClassMove, ...], ...]
    begin: Numbers
    owners: tuple[str, ...]
    crowds: tuple[Crowd, ...] = ()

    @cached_property
    def changes(self) -> list[list[Change]]:
        """The moves from each class, with what they change."""
        return [[self._change(move) for move in found] for found in self.moves]

    def _change(self, move: ClassMove) -> Change:
        before = self.resting[move.source]
        letters = tuple(tuple(map(sub, marks, before)) for marks in move.marks)
        entered = (
            k for k, crowd in enumerate(self.crowds) if move.target in crowd.classes and move.source not in crowd.classes
        )
        return Change(move, letters, tuple(entered))

    def may_end(self, numbers: Numbers) -> bool:
        """Tell whether the flights of all robots may end.

        Args:
            numbers: How many rest in each class.
        """
        return all(end or not count for end, count in zip(self.ends, numbers, strict=True))

    def sums(self, numbers: Numbers) -> Sums:
        """Return how many robots make each mark.

        Args:
            numbers: How many rest in each class.
        """
        return tuple(sum(map(mul, numbers, column)) for column in zip(*self.resting, strict=True))
