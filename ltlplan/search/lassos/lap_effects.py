"""Conjuncts that remember more than the last letter, and what a lap does to the states of their automata.

An automaton need not be back in its state after a lap for its word to go on for ever: several laps may be one round of the automaton. So a lap is
judged by where it leads from each state, and by whether it passes an accepting state on the way.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol

from ltlplan.search.lassos.team_readers import AnyReader
from verify.data import Letter

Row = Sequence[tuple[int, int]]
"""For each state: where a lap can lead, as bits, and where passing an accepting state, as bits."""


Masks = tuple[int, ...]
"""For each conjunct that remembers, the states that its automaton may be in, as bits."""


class Steps(Protocol):
    """For each state where a letter leads, as bits."""

    def __getitem__(self, state: int, /) -> int:
        """Return where a letter leads from one state, as bits."""
        ...


def image(mask: int, steps: Steps) -> int:
    """Return where a letter, or a lap, leads from some states.

    Args:
        mask: The states, as bits.
        steps: Where it leads from each.
    """
    result = 0
    while mask:
        low = mask & -mask
        result |= steps[low.bit_length() - 1]
        mask ^= low
    return result


def goes_round(mask: int, row: Row) -> bool:
    """Tell whether from some states a cycle of laps with an accepting state in it can be reached.

    Args:
        mask: The states before the first lap, as bits.
        row: What a lap does.
    """
    reach = [r for r, _ in row]
    reachable = _closure(mask, reach)
    for state, (_, marked) in enumerate(row):
        if reachable >> state & 1 and marked and _closure(marked, reach) >> state & 1:
            return True
    return False


def _closure(mask: int, reach: Sequence[int]) -> int:
    while True:
        more = mask | image(mask, reach)
        if more == mask:
            return mask
        mask = more


class Followers:
    """Conjuncts that remember, read letter by letter.

    Args:
        readers: Their automata.
    """

    def __init__(self, readers: Sequence[AnyReader]) -> None:
        self.readers = tuple(readers)
        self._steps: dict[tuple[int, Letter], _Steps] = {}
        self._after: dict[tuple[Masks, Letter], Masks | None] = {}

    def begin(self) -> Masks:
        """Return the states before the first letter."""
        return tuple(1 << reader.initial for reader in self.readers)

    def after(self, masks: Masks, letter: Letter) -> Masks | None:
        """Return the states after a letter; None where a conjunct is lost.

        Args:
            masks: The states before.
            letter: Of the team.
        """
        key = masks, letter
        if key not in self._after:
            found = tuple(image(mask, self.steps(k, letter)) for k, mask in enumerate(masks))
            self._after[key] = found if all(found) else None
        return self._after[key]

    def steps(self, k: int, letter: Letter) -> _Steps:
        """Return where a letter leads from each state of one conjunct.

        Args:
            k: Which one.
            letter: Of the team.
        """
        found = self._steps.get((k, letter))
        if found is None:
            found = self._steps[k, letter] = _Steps(self.readers[k], letter)
        return found


class _Steps(dict[int, int]):
    """Where a letter leads from each state, as bits; found out as it is asked for."""

    def __init__(self, reader: AnyReader, letter: Letter) -> None:
        super().__init__()
        self._reader, self._letter = reader, letter

    def __missing__(self, state: int) -> int:
        found = self[state] = sum(1 << target for target in set(self._reader.successors(state, self._letter)))
        return found


class LapEffects:
    """What ways from one home do to the states that conjuncts may be in there, by number; 0 is to do nothing.

    Args:
        followers: The conjuncts that remember.
        at: All states in which they may be at home.
    """

    def __init__(self, followers: Followers, at: Iterable[Masks]) -> None:
        self._followers = followers
        every = [0] * len(followers.readers)
        for masks in at:
            every = [a | b for a, b in zip(every, masks, strict=True)]
        self._domain = [[s for s in range(mask.bit_length()) if mask >> s & 1] for mask in every]
        identity = tuple(tuple((1 << s, 0) for s in own) for own in self._domain)
        self._effects, self._numbers = [identity], {identity: 0}
        self._after: dict[tuple[int, Letter], int] = {}

    def after(self, effect: int, letter: Letter) -> int:
        """Return the effect of a way that was gone on with.

        Args:
            effect: What it did before.
            letter: What the team shows next.
        """
        found = self._after.get((effect, letter))
        if found is None:
            rows: list[tuple[tuple[int, int], ...]] = []
            for k, row in enumerate(self._effects[effect]):
                steps, accepting = self._followers.steps(k, letter), self._followers.readers[k].accepting
                moved = [(image(reach, steps), image(marked, steps)) for reach, marked in row]
                final = sum(1 << s for s in _bits(moved) if s in accepting)
                rows.append(tuple((reach, marked | reach & final) for reach, marked in moved))
            key = tuple(rows)
            found = self._after[effect, letter] = self._numbers.setdefault(key, len(self._effects))
            if found == len(self._effects):
                self._effects.append(key)
        return found

    def accepts(self, masks: Masks, effect: int) -> bool:
        """Tell whether all conjuncts accept a lap that is repeated for ever.

        Args:
            masks: The states at home before the first lap.
            effect: What a lap does.
        """
        for mask, own, row in zip(masks, self._domain, self._effects[effect], strict=True):
            every, size = dict(zip(own, row, strict=True)), max(mask, *(reach for reach, _ in row)).bit_length()
            # a state that is not known comes up only where a lap or the next one loses another conjunct
            if not goes_round(mask, [every.get(s, (0, 0)) for s in range(size)]):
                return False
        return True


def _bits(moved: Sequence[tuple[int, int]]) -> Iterable[int]:
    every = 0
    for reach, _ in moved:
        every |= reach
    return (s for s in range(every.bit_length()) if every >> s & 1)
