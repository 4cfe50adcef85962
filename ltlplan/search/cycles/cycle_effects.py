"""Conjuncts that remember more than the last letter, and what a cycle does to the states of their automata.

An automaton need not be back in its state after a cycle for its word to go on for ever: several cycles may be one round of the automaton. So a cycle is
judged by where it leads from each state, and by whether it passes an accepting state on the way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache, reduce
from operator import or_

from ltlplan.logic.conjunct_automata import bits
from ltlplan.search.cycles.team_readers import Reader
from ltlplan.search.cycles.team_system import TeamLetter
from ltlplan.search.memoization import memoized
from ltlplan.search.numbering import Numbers, closure

Row = Mapping[int, tuple[int, int]]
"""For each state: where a cycle can lead, as bits, and where passing an accepting state, as bits.

A state that is not known comes up only where a cycle or the next one loses another conjunct."""


Masks = tuple[int, ...]
"""For each conjunct that remembers, the states that its automaton may be in, as bits."""


_Effect = tuple[
    tuple[tuple[int, int], ...], ...
]  # for each conjunct and state: where a way leads, and where by an accepting state


Steps = Callable[[int], int]
"""Where a letter, or a cycle, leads from one state, as bits."""


def image(mask: int, steps: Steps) -> int:
    """Return where a letter, or a cycle, leads from some states.

    Args:
        mask: The states, as bits.
        steps: Where it leads from one, as bits.
    """
    return reduce(or_, map(steps, bits(mask)), 0)


def goes_round(mask: int, row: Row) -> bool:
    """Tell whether from some states rounds of cycles with an accepting state in it can be reached.

    Args:
        mask: The states before the first cycle, as bits.
        row: What a cycle does.
    """

    def leads_to(some: int) -> Iterator[int]:
        return closure(bits(some), lambda state: bits(row.get(state, (0, 0))[0]))

    return any(state in leads_to(row.get(state, (0, 0))[1]) for state in leads_to(mask))


class Followers:
    """Conjuncts that remember, read letter by letter.

    Attributes:
        readers: Their automata.

    Args:
        readers: Their automata.
    """

    def __init__(self, readers: Sequence[Reader]) -> None:
        self.readers = tuple(readers)
        self.initial: Masks = tuple(1 << reader.initial for reader in self.readers)

    @memoized
    def after(self, masks: Masks, letter: TeamLetter) -> Masks | None:
        """Return the states after some states and a letter of the team; None where a conjunct is lost."""
        found = tuple(image(mask, self.steps(k, letter)) for k, mask in enumerate(masks))
        return found if all(found) else None

    @memoized
    def steps(self, k: int, letter: TeamLetter) -> Steps:
        """Return where a letter leads from each state of one conjunct, by its number."""
        reader = self.readers[k]
        return cache(lambda state: sum(1 << target for target in set(reader.successors(state, letter))))


class CycleEffects:
    """Effects of ways from one home on the states that conjuncts may be in there, by number; 0 is to do nothing.

    Args:
        followers: The conjuncts that remember.
        at: All states in which they may be at home.
    """

    def __init__(self, followers: Followers, at: Iterable[Masks]) -> None:
        self._followers = followers
        self._domain = [list(bits(reduce(or_, masks))) for masks in zip(*at, strict=True)]
        self._effects = Numbers([tuple(tuple((1 << s, 0) for s in own) for own in self._domain)])

    @memoized
    def after(self, effect: int, letter: TeamLetter) -> int:
        """Return the effect of a way that was gone on with: of its own and the next letter of the team.

        Args:
            effect: Of the way so far.
            letter: The next one of the team.
        """
        rows: _Effect = ()
        for k, row in enumerate(self._effects.known[effect]):
            steps, accepting = self._followers.steps(k, letter), self._followers.readers[k].accepting
            moved = [(image(reach, steps), image(marked, steps)) for reach, marked in row]
            every = reduce(or_, (reach for reach, _ in moved))
            final = sum(1 << s for s in bits(every) if s in accepting)
            rows = (*rows, tuple((reach, marked | reach & final) for reach, marked in moved))
        return self._effects[rows]

    def accepts(self, masks: Masks, effect: int) -> bool:
        """Tell whether all conjuncts accept a cycle that is repeated for ever.

        Args:
            masks: The states at home before the first cycle.
            effect: What a cycle does.
        """
        known = zip(masks, self._domain, self._effects.known[effect], strict=True)
        return all(goes_round(mask, dict(zip(own, row, strict=True))) for mask, own, row in known)
