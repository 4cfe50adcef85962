"""Team words of robots that give fixed words: one robot after another, or all at once.

Robots whose words are alike are one kind and only counted, so that a hundred idle robots cost what one does. Both
graphs are of the form that `inclusion` searches; an `Observation` names a kind, and `nodes` says which letter of it.
"""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Iterator, Sequence

from verify.data.language.word import Letter
from verify.data.sections import TeamReading
from verify.logic.team_letters import Together
from verify.model_checking.team_graph import Observation, Step

Letters = tuple[Letter, ...]


class InTurn:
    """One robot after another gives its whole word, in every order.

    A state is (how many of each kind have still to fly; the kind that flies; the index of its letter).

    Under the joint reading each letter is joined with the first letters of the robots that wait and the last letters
    of those that are done; taking off then reads nothing new, because the first letter is held already. `together` puts them
    together where their union is not all that is asked.
    """

    def __init__(
        self, kinds: Sequence[Letters], counts: Sequence[int], reading: TeamReading, together: Together | None = None
    ) -> None:
        self.kinds = tuple(kinds)
        self.counts = tuple(counts)
        self.joint = reading == "joint"
        self.together = together

    def observation(self, waiting: tuple[int, ...], kind: int, index: int) -> Observation:
        """Return the reading while a robot of one kind flies and `waiting` have still to fly.

        Args:
            waiting: How many of each kind have still to fly, the one that flies left out.
            kind: Which kind flies.
            index: Of the letter that it has come to.
        """
        letter = self.kinds[kind][index]
        if self.together is not None:
            letter = self.together(self._held(waiting, kind, index))
        elif self.joint:
            for other, letters in enumerate(self.kinds):
                done = self.counts[other] - waiting[other] - (other == kind)
                if waiting[other]:
                    letter |= letters[0]
                if done:
                    letter |= letters[-1]
        return Observation(kind, letter, (index,))

    def _held(self, waiting: tuple[int, ...], kind: int, index: int) -> Iterator[tuple[Letter, int]]:
        """Yield the letters that are held, and by how many."""
        yield self.kinds[kind][index], 1
        for other, letters in enumerate(self.kinds):
            yield letters[0], waiting[other]
            yield letters[-1], self.counts[other] - waiting[other] - (other == kind)

    def initial(self) -> Iterator[Step]:
        """Yield every robot that may fly first."""
        for kind, waiting in self.next(self.counts):
            yield self.observation(waiting, kind, 0), (waiting, kind, 0)

    def next(self, waiting: tuple[int, ...]) -> Iterator[tuple[int, tuple[int, ...]]]:
        """Yield each kind that may fly next, and who waits then."""
        for kind, count in enumerate(waiting):
            if count:
                yield kind, (*waiting[:kind], count - 1, *waiting[kind + 1 :])

    def steps(self, state: tuple[tuple[int, ...], int, int]) -> Iterator[Step]:
        """Go on to the next letter, or to the next robot."""
        waiting, kind, index = state
        if index + 1 < len(self.kinds[kind]):
            yield self.observation(waiting, kind, index + 1), (waiting, kind, index + 1)
            return
        for following, left in self.next(waiting):
            yield (None if self.joint else self.observation(left, following, 0)), (left, following, 0)

    def is_final(self, state: tuple[tuple[int, ...], int, int]) -> bool:
        """Return whether all have flown."""
        waiting, kind, index = state
        return not any(waiting) and index + 1 == len(self.kinds[kind])

    def stronger(self, state: Hashable) -> tuple[Hashable, int]:
        """No state can do more than another."""
        return state, 0


class Shuffle:
    """All robots at once, each keeping its own order; a held letter may be read any number of times.

    Times do not bind, so moving on to a letter and reading it for the first time can be one step. A state holds, for
    each kind, how many of its robots were last read at each index (index 0: not yet read). An observation's `nodes` are the
    letter's index and whether it is read for the first time.
    """

    def __init__(self, kinds: Sequence[Letters], counts: Sequence[int]) -> None:
        self.kinds = tuple(kinds)
        self.counts = tuple(counts)
        self.ends = tuple((0,) * len(word) + (count,) for word, count in zip(self.kinds, self.counts, strict=True))

    def initial(self) -> Iterator[Step]:
        """Yield the beginning, when nobody has been read."""
        yield None, tuple((count,) + (0,) * len(word) for word, count in zip(self.kinds, self.counts, strict=True))

    def steps(self, state: tuple[tuple[int, ...], ...]) -> Iterator[Step]:
        """Read any robot again, or for the first time in its next letter."""
        for kind, places in enumerate(state):
            word = self.kinds[kind]
            for place, count in enumerate(places):
                if not count:
                    continue
                if place:
                    yield Observation(kind, word[place - 1], (place - 1, 0)), state
                if place < len(word):
                    moved = list(places)
                    moved[place] -= 1
                    moved[place + 1] += 1
                    yield Observation(kind, word[place], (place, 1)), (*state[:kind], tuple(moved), *state[kind + 1 :])

    def is_final(self, state: tuple[tuple[int, ...], ...]) -> bool:
        """Return whether all have been read in their last letters."""
        return state == self.ends

    def stronger(self, state: Hashable) -> tuple[Hashable, int]:
        """No state can do more than another."""
        return state, 0


class JointShuffle:
    """The union of all robots' letters as time passes, whatever the times; several may change together.

    A state holds, for each kind, how many of its robots hold each letter.
    """

    def __init__(self, kinds: Sequence[Letters], counts: Sequence[int], together: Together | None = None) -> None:
        self.kinds = tuple(kinds)
        self.counts = tuple(counts)
        self.together = together

    def _observation(self, state: tuple[tuple[int, ...], ...]) -> Observation:
        nodes = tuple(count for places in state for count in places)
        if self.together is not None:
            return Observation(None, self.together(zip(itertools.chain(*self.kinds), nodes, strict=True)), nodes)
        letter: Letter = frozenset()
        for word, places in zip(self.kinds, state, strict=True):
            for held, count in zip(word, places, strict=True):
                if count:
                    letter |= held
        return Observation(None, letter, nodes)

    def initial(self) -> Iterator[Step]:
        """Yield the beginning, when all hold their first letters."""
        state = tuple((count,) + (0,) * (len(word) - 1) for word, count in zip(self.kinds, self.counts, strict=True))
        yield self._observation(state), state

    def steps(self, state: tuple[tuple[int, ...], ...]) -> Iterator[Step]:
        """Read again, or let any robots go on together, each by one letter."""
        for moved in itertools.product(*(list(_advances(places)) for places in state)):
            yield self._observation(moved), moved

    def is_final(self, state: tuple[tuple[int, ...], ...]) -> bool:
        """Return whether all hold their last letters."""
        return all(places[-1] == count for places, count in zip(state, self.counts, strict=True))

    def stronger(self, state: Hashable) -> tuple[Hashable, int]:
        """No state can do more than another."""
        return state, 0


def _advances(places: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    """Yield how many robots of one kind hold each letter after some of them (perhaps none) have gone on by one."""
    for moving in itertools.product(*(range(count + 1) for count in places[:-1])):
        leaving, arriving = (*moving, 0), (0, *moving)
        yield tuple(n - out + came for n, out, came in zip(places, leaving, arriving, strict=True))
