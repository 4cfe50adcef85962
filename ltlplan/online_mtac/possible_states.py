"""Possible automaton states of a team in flight: those that its readings so far may have led to.

In the air several robots move at once. Under `team: own` a team word is any sequence of readings of held letters
(each letter of each robot read at least once, in the order of time), so what was flown so far leads not to one
state of the automaton but to a set of them. `Belief` keeps that set exactly: pairs of a state and the letters
that somebody holds and that this reading has not read yet. Three facts keep the pairs few. A letter whose reading
changes nothing may count as read. Robots that hold the same letter count as one, because truth does not change when a
letter is read twice. A letter that commutes with all others (the automaton may say which do) counts as read at once.

`admits` is the gate that online flight uses: an event (a robot enters a region, say) may happen now when the team can
still finish afterwards by letting one robot after another fly its remaining letters, in some order. The robot that
is first in such an order is always admitted, so nobody waits for ever; and since each event leaves such an order,
the flown word satisfies the formula once all have finished. This steers; the verdict is the checker's.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce

from ltlplan.mtac.decomposable_task import Accepting, State, union_of
from verify.data.language.word import Letter
from verify.data.sections import TeamReading

MAX_ORDERS = 500
"""Beginnings of serial orders that the gate looks at in vain at most; eight robots can be parted in 256 ways."""

MAX_TOGETHER = 4
"""Events of one instant that are tried in every order; more are taken in groups."""

MAX_GRID = 600
"""Interleavings of letters that are looked at before robots may enter regions side by side; beyond, one waits."""

Pair = tuple[State, frozenset[Letter]]
Ahead = Mapping[str, Sequence[Letter]]


@dataclass(frozen=True, slots=True)
class Belief:
    """Letters that robots hold, and the states that the readings so far may have led to.

    Attributes:
        automaton: Deterministic, of the formula on finite traces.
        reading: The mission's team reading.
        held: Each robot's present letter.
        pairs: Automaton state and letters still to be read. Under "joint" the second member is empty.
    """

    automaton: Accepting
    reading: TeamReading
    held: Mapping[str, Letter]
    pairs: frozenset[Pair]

    @property
    def states(self) -> frozenset[State]:
        """The automaton states that may have been reached."""
        return frozenset(state for state, _ in self.pairs)

    @property
    def settled(self) -> frozenset[State]:
        """The states of the readings that have read every held letter: those from which the rest is planned."""
        return frozenset(state for state, unread in self.pairs if not unread)

    def accepts(self) -> bool:
        """Tell whether the word is accepted if nobody's letter changes any more, whatever was read when."""
        return all(state in self.automaton.accepting for state in self.settled)

    def after(self, robot: str, letter: Letter) -> Belief:
        """Return the belief after one robot's letter has changed."""
        # the letter that ends must have been read by now
        return self._showing({robot: letter}, [pair for pair in self.pairs if self.held[robot] not in pair[1]])

    def after_all(self, events: Mapping[str, Letter]) -> Belief:
        """Return the belief after events of one instant, in any order (under "joint" also all at once); of a handful at most."""
        if len(events) == 1:
            ((robot, letter),) = events.items()
            return self.after(robot, letter)
        pairs: set[Pair] = set()
        for order in itertools.permutations(events):
            pairs |= reduce(lambda belief, robot: belief.after(robot, events[robot]), order, self).pairs
        if self.reading == "joint":
            pairs |= self.at_once(events).pairs
        return replace(self, held={**self.held, **events}, pairs=frozenset(pairs))

    def at_once(self, events: Mapping[str, Letter]) -> Belief:
        """Return the belief after letters that changed at the very same moment, for "joint" unions, or at take-off."""
        return self._showing(events, self.pairs)

    def _showing(self, events: Mapping[str, Letter], pairs: Iterable[Pair]) -> Belief:
        """Return the belief after some robots begin to show letters; under "own" those are still to be read.

        Args:
            events: The letter of each.
            pairs: Under "own", where the readings may have led that had read what had to be read.
        """
        held = {**self.held, **events}
        if self.reading == "joint":
            return replace(self, held=held, pairs=_joint(self.automaton, self.states, held))
        unread = frozenset(events.values())
        return replace(self, held=held, pairs=_closure(self.automaton, [(s, left | unread) for s, left in pairs], held))


def at_start(
    automaton: Accepting, held: Mapping[str, Letter], shown: Iterable[Mapping[str, Letter]] = (), *, reading: TeamReading
) -> Belief:
    """Return the belief at take-off, each robot in its first letter, or after changes that were seen since.

    Args:
        automaton: Of the formula.
        held: Each robot's first letter.
        shown: Letters that changed at one time, one time after another.
        reading: The mission's team reading.
    """
    begun = Belief(automaton, reading, {}, frozenset({(automaton.initial, frozenset())})).at_once(held)
    return reduce(after_events, shown, begun)


def admits(belief: Belief, chains: Ahead, rest: Ahead) -> bool:
    """Tell whether robots may now begin letters that they cannot interrupt, whatever the order in which these come.

    Args:
        belief: Now.
        chains: For each robot that is or would be inside a region: the letters up to and with the one that leaves it.
        rest: The letters that each robot is to show after those.

    Returns:
        Whether the team can finish one robot after another after every interleaving of the chains.
    """
    robots = [robot for robot, letters in chains.items() if letters]
    lengths = [len(chains[robot]) for robot in robots]
    if math.prod(length + 1 for length in lengths) > MAX_GRID:
        return False
    reached: dict[tuple[int, ...], Belief] = {(0,) * len(robots): belief}
    # places in the grid in an order in which every place comes after those that lead to it
    for place in itertools.product(*(range(length + 1) for length in lengths)):
        here = reached[place]
        for moving in _steps(place, lengths, together=belief.reading == "joint"):
            target = tuple(p + (i in moving) for i, p in enumerate(place))
            letters = {robots[i]: chains[robots[i]][place[i]] for i in moving}
            after = here.after(*next(iter(letters.items()))) if len(letters) == 1 else here.at_once(letters)
            known = reached.get(target)
            reached[target] = after if known is None else replace(after, pairs=after.pairs | known.pairs)
    return can_finish(reached[tuple(lengths)], rest)


def _steps(place: tuple[int, ...], lengths: Sequence[int], *, together: bool) -> Iterator[tuple[int, ...]]:
    """Yield which robots may show their next letter: any one, or any that do so at once."""
    free = [i for i, (p, length) in enumerate(zip(place, lengths, strict=True)) if p < length]
    for count in range(1, (len(free) if together else 1) + 1):
        yield from itertools.combinations(free, count)


def can_finish(belief: Belief, ahead: Ahead) -> bool:
    """Tell whether some serial order of what is ahead ends in acceptance, whatever was read when."""
    vain: set[tuple[frozenset[str], frozenset[Pair]]] = set()

    def finishes(here: Belief, left: frozenset[str]) -> bool:
        key = (left, here.pairs)
        if key in vain or len(vain) >= MAX_ORDERS:
            return False
        followed = (
            (follow(here, ((robot, letter) for letter in ahead[robot])), left - {robot}) for robot in ahead if robot in left
        )
        found = any(finishes(after, others) for after, others in followed) if left else here.accepts()
        if not found:
            vain.add(key)
        return found

    return finishes(belief, frozenset(robot for robot, letters in ahead.items() if letters))


def follow(belief: Belief, moves: Iterable[tuple[str, Letter]]) -> Belief:
    """Return the belief after changes of letters, one after another."""
    for robot, letter in moves:
        if letter != belief.held[robot]:
            belief = belief.after(robot, letter)
    return belief


def after_events(belief: Belief, events: Mapping[str, Letter]) -> Belief:
    """Return the belief after events that were seen together: in any order, in groups of a handful."""
    names = sorted(events)
    for first in range(0, len(names), MAX_TOGETHER):
        belief = belief.after_all({name: events[name] for name in names[first : first + MAX_TOGETHER]})
    return belief


def _joint(automaton: Accepting, states: Iterable[State], held: Mapping[str, Letter]) -> frozenset[Pair]:
    team_letter: Callable[[Mapping[str, Letter]], Letter] = getattr(automaton, "team_letter", union_of)
    shown = team_letter(held)
    return frozenset((automaton.successor(state, shown), frozenset[Letter]()) for state in states)


def _closure(automaton: Accepting, pairs: Iterable[Pair], held: Mapping[str, Letter]) -> frozenset[Pair]:
    """Add all that any number of readings of the held letters lead to."""
    commutes: Callable[[Letter], bool] = getattr(automaton, "commutes", lambda _letter: False)
    found: set[Pair] = set()
    stack, letters = list(pairs), frozenset(held.values())
    while stack:
        state, unread = stack.pop()
        for letter in [letter for letter in unread if commutes(letter)]:
            # it is read some time, and when does not matter
            state, unread = automaton.successor(state, letter), unread - {letter}
        after = {letter: automaton.successor(state, letter) for letter in letters}
        # what reads as no change may count as read
        unread = frozenset(letter for letter in unread if after[letter] != state)
        if (state, unread) in found:
            continue
        found.add((state, unread))
        stack.extend((target, unread - {letter}) for letter, target in after.items() if target != state)
    return frozenset(found)
