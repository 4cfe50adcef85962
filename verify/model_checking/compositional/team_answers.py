"""Can a team that is read one robot at a time break one part of a formula? Yes or no, twice: by `robots_apart` and by Spot.

The question is asked of the robots that matter alone, in names and times of its own: propositions are numbered in the order of
their names, and the ends of spans in the order of their times. So a hundred robots with a goal each ask one question a hundred
times, as do flights whose times differ but whose events can come in the same orders, and an answer is kept for all of them.

Spot's second opinion is on what remains: on the words of the robots that matter where those are few enough to be written
down, and otherwise on the automaton of breaking words itself, that it breaks the formula with all the letters that can
be read and in no other case. Where Spot gives neither, there is no answer.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Hashable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cached_property, lru_cache

from verify.data.errors import InternalError
from verify.data.language.word import Letter
from verify.logic.normal_form import Normal, to_formula
from verify.logic.progression import OutOfBudget
from verify.logic.spot_opinion import some_word_breaks
from verify.model_checking.compositional.compositional_check import some_word_breaks_apart
from verify.model_checking.compositional.relevant_robots import that_matter
from verify.model_checking.compositional.violation_automaton import BreakingWords
from verify.model_checking.inclusion import letter_graph
from verify.model_checking.robot_letters import RobotBehaviour
from verify.model_checking.team_graph import OwnGraph, Ranks

WRITTEN_DOWN = 1_000
"""Configurations of the robots that matter up to which their words are written down for Spot."""

_KEPT = 4_096
_ANSWERS: OrderedDict[Hashable, bool] = OrderedDict()


class Question:
    """One part of a formula, with all letters that a team can show, in names of its own.

    Attributes:
        part: The part, its propositions named by their numbers.
        words: What breaks it.
    """

    def __init__(self, part: Normal, letters: Sequence[Letter]) -> None:
        """Number the propositions.

        Args:
            part: One part of the formula, in normal form.
            letters: All that can be read, cut down to its propositions.

        Raises:
            OutOfBudget: The words that break it are too many kinds to be told apart.
        """
        self._names = {name: f"p{i}" for i, name in enumerate(sorted(part.propositions))}
        self._empty = frozenset[str]()
        self.part = replace(part, names=tuple(self._names.get(name, "") for name in part.names))
        self._confirmed = _confirmed(self.part, frozenset(self._renamed(letter) for letter in letters))
        self.words = self._confirmed.words

    def _renamed(self, letter: Letter) -> Letter:
        return frozenset(name for known, name in self._names.items() if known in letter)

    def nothing_is_idle(self) -> bool:
        """Return whether a robot that shows nothing of the part can be read at any time without consequence."""
        return bool(self.words.idle >> self.words.letters.index(self._empty) & 1)

    def is_broken(
        self, robots: Sequence[RobotBehaviour], *, timed: bool, clock_error: Fraction = Fraction(0), budget: int
    ) -> bool:
        """Return whether some team word breaks the part, with Spot's agreement.

        Args:
            robots: The team; shows no letter that the question does not have.
            timed: Whether the spans bind; otherwise only each robot's own order does.
            clock_error: How far each robot's clock may be off, in s.
            budget: Configurations that may be met.

        Raises:
            OutOfBudget: More were met, or Spot cannot be asked.
            InternalError: The two answers differ: a bug of ours.
            MissingEngine: Spot is not there to be asked.
        """
        renamed = [replace(r, letters=tuple(self._whole(letter) for letter in r.letters)) for r in robots]
        asked = _in_ranks(that_matter(renamed, self.words), clock_error if timed else None)
        key = self.part, asked, timed, budget
        if key in _ANSWERS:
            _ANSWERS.move_to_end(key)
            return _ANSWERS[key]
        answer = _ANSWERS[key] = self._decided(asked, timed=timed, budget=budget)
        while len(_ANSWERS) > _KEPT:
            _ANSWERS.popitem(last=False)
        return answer

    def _whole(self, letter: Letter) -> Letter:
        """Name what the part sees by its numbers, and keep the rest under names that no proposition has."""
        return frozenset(self._names.get(name, f"\n{name}") for name in letter)

    def _decided(self, robots: tuple[RobotBehaviour, ...], *, timed: bool, budget: int) -> bool:
        broken = some_word_breaks_apart(robots, self.words, timed=timed, budget=budget)
        theirs = self._by_writing_down(robots, timed=timed)
        if theirs is None and not self._confirmed.by_spot:
            raise InternalError(
                f"Our words that break `{to_formula(self.part)}` are not those that Spot finds. This is a bug of ltlplan's."
            )
        if theirs not in (broken, None):
            raise InternalError(
                "Two independent answers about one formula disagree: that robots one by one "
                f"{'fail' if broken else 'hold'}, Spot that it {'fails' if theirs else 'holds'}. This is a bug of ltlplan's."
            )
        return broken

    def _by_writing_down(self, robots: tuple[RobotBehaviour, ...], *, timed: bool) -> bool | None:
        if math.prod(2 * len(robot) for robot in robots) > 10 * WRITTEN_DOWN:
            return None
        try:
            graph = letter_graph(OwnGraph(robots, timed=timed), self.part.propositions, WRITTEN_DOWN)
            return some_word_breaks(graph, self.part)
        except OutOfBudget:
            return None


class _Confirmed:
    """Words that break a formula, and whether Spot finds them the same; asked when it is needed."""

    def __init__(self, words: BreakingWords) -> None:
        self.words = words

    @cached_property
    def by_spot(self) -> bool:
        return self.words.spot_agrees()


@lru_cache(maxsize=512)
def _confirmed(part: Normal, letters: frozenset[Letter]) -> _Confirmed:
    return _Confirmed(BreakingWords(part, sorted(letters, key=sorted)))


def _in_ranks(robots: Sequence[RobotBehaviour], clock_error: Fraction | None) -> tuple[RobotBehaviour, ...]:
    """Name robots by their numbers, and times by theirs; None where times do not bind."""
    ranks = Ranks.timeless(robots) if clock_error is None or len(robots) == 1 else Ranks.of(robots, clock_error)
    return tuple(
        replace(robot, robot=str(i), spans=tuple((Fraction(low), Fraction(high)) for low, high in spans))
        for i, (robot, spans) in enumerate(zip(robots, ranks.spans, strict=True))
    )
