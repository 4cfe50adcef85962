"""Moves that may be made at the same time: stages, within which the formula allows every order, and between which robots wait.

A course is a list of moves one after another. Moves are put into one stage for as long as all the orders in which their
letters can come, those of robots that do the same at one instant too, leave the conjuncts in states from which the rest of the
course does what is asked. A robot sets out for a move of the next stage when all that move in this one have arrived.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ltlplan.search.counting.counting_propositions import Marks, States, Sums
from ltlplan.search.memoization import memoized

MOST_STEPS = 20_000
"""Steps of trying all orders of one stage's moves."""


_Progress = tuple[tuple[int, ...], ...]
"""For each kind of move how many robots are at each of its letters."""


@dataclass(frozen=True, slots=True)
class Turn:
    """One robot's move as the formula sees it.

    Attributes:
        robot: Which robot.
        shown: The marks that it makes before and along the way.
    """

    robot: int
    shown: tuple[Sums, ...]


def stages(marks: Marks, begin: Sequence[Sums], turns: Sequence[Turn]) -> list[list[int]] | None:
    """Return turns, by index, in stages; None where even one after another they do not do what is asked.

    Args:
        marks: What the formula sees.
        begin: The marks that each robot makes at its start.
        turns: In an order that does what is asked.
    """
    held = [tuple(own) for own in begin]
    first = marks.begin(_total(held))
    if first is None or not _rest_is_done(marks, {first}, held, turns):
        return None
    found: list[list[int]] = []
    states, at = {first}, 0
    while at < len(turns):
        size, after = _longest(marks, states, held, turns[at:])
        found.append(list(range(at, at + size)))
        for turn in turns[at : at + size]:
            held[turn.robot] = turn.shown[-1]
        states, at = after, at + size
    return found


def _longest(marks: Marks, states: set[States], held: Sequence[Sums], turns: Sequence[Turn]) -> tuple[int, set[States]]:
    """Return how many of the first turns can be made at the same time, and the states that this can lead to."""

    def possible(size: int) -> set[States] | None:
        after = _at_once(marks, states, held, _joined(turns[:size]))
        if after is None:
            return None
        now = list(held)
        for turn in turns[:size]:
            now[turn.robot] = turn.shown[-1]
        return after if _rest_is_done(marks, after, now, turns[size:]) else None

    best = possible(1)
    assert best is not None  # the course does what is asked one turn after another
    size, step = 1, 1
    while step:
        more = possible(min(size + step, len(turns))) if size < len(turns) else None
        if more is not None:
            size, best, step = min(size + step, len(turns)), more, step * 2
        else:
            step = step // 2 if size < len(turns) else 0
    return size, best


def _joined(turns: Sequence[Turn]) -> list[Turn]:
    """Return turns with those of one robot, which it makes one after another, as one."""
    shown: dict[int, tuple[Sums, ...]] = {}
    for turn in turns:
        shown[turn.robot] = (*shown[turn.robot], *turn.shown[1:]) if turn.robot in shown else turn.shown
    return [Turn(robot, way) for robot, way in shown.items()]


def _rest_is_done(marks: Marks, states: set[States], held: Sequence[Sums], turns: Sequence[Turn]) -> bool:
    """Tell whether the turns, one after another, lead from all these states to where everything is done."""
    now = list(held)
    for turn in turns:
        others = tuple(t - m for t, m in zip(_total(now), now[turn.robot], strict=True))
        for shown in turn.shown[1:]:
            after = [marks.read(state, _sum(others, shown)) for state in states]
            states = {state for state in after if state is not None}
            if None in after:
                return False
        now[turn.robot] = turn.shown[-1]
    return all(marks.accepting(state) for state in states)


def _at_once(marks: Marks, states: set[States], held: Sequence[Sums], turns: Sequence[Turn]) -> set[States] | None:
    """Return the states that all orders of some robots' letters lead to; None where one loses the task, or they are too many."""
    kinds = Counter(turn.shown for turn in turns)
    moving = {turn.robot for turn in turns}
    others = _total([own for robot, own in enumerate(held) if robot not in moving] or [(0,) * len(held[0])])
    start = tuple((count, *(0,) * (len(shown) - 1)) for shown, count in kinds.items())
    goal = tuple((*(0,) * (len(shown) - 1), count) for shown, count in kinds.items())
    reached: dict[_Progress, set[States]] = {start: set(states)}
    layers: dict[int, list[_Progress]] = {0: [start]}
    moved, steps = _Moved(tuple(kinds)), 0
    for depth in range(sum(count * (len(shown) - 1) for shown, count in kinds.items()) + 1):
        for progress in layers.pop(depth, ()):
            here = reached.pop(progress) if progress != goal else reached[progress]
            for after, shown in moved.further(progress):
                steps += len(here)
                if steps > MOST_STEPS:
                    return None
                sums = tuple(map(sum, zip(others, *shown, strict=True)))
                read = {marks.read(state, sums) for state in here}
                if None in read:
                    return None
                if after not in reached:
                    reached[after] = set()
                    layers.setdefault(_depth(after), []).append(after)
                reached[after] |= {state for state in read if state is not None}
    return reached[goal]


def _depth(progress: _Progress) -> int:
    return sum(place * count for counts in progress for place, count in enumerate(counts))


class _Moved:
    """What can follow for robots of some kinds, those of one kind being at letters of the same move.

    Args:
        kinds: The letters of each kind's move.
    """

    def __init__(self, kinds: Sequence[tuple[Sums, ...]]) -> None:
        self._kinds = kinds

    def further(self, progress: _Progress) -> Iterator[tuple[_Progress, tuple[Sums, ...]]]:
        """Yield what can follow when some robots, one at least, go on by one letter at one instant, with the marks that each kind makes then."""
        options = (self._options(kind, counts) for kind, counts in enumerate(progress))
        for chosen in itertools.islice(itertools.product(*options), 1, None):  # the first one is that nobody does
            after, shown = zip(*chosen, strict=True)
            yield after, shown

    @memoized
    def _options(self, kind: int, counts: tuple[int, ...]) -> list[tuple[tuple[int, ...], Sums]]:
        """Return what can follow for one kind, how many of which are at each of their letters; at first that nobody goes on."""
        found: list[tuple[tuple[int, ...], Sums]] = []
        for going in itertools.product(*(range(count + 1) for count in counts[:-1])):
            after = tuple(count - out + new for count, out, new in zip(counts, (*going, 0), (0, *going), strict=True))
            letters = zip(*self._kinds[kind], strict=True)
            found.append((after, tuple(sum(a * m for a, m in zip(after, marks, strict=True)) for marks in letters)))
        return found


def _total(held: Sequence[Sums]) -> Sums:
    return tuple(map(sum, zip(*held, strict=True)))


def _sum(one: Sums, other: Sums) -> Sums:
    return tuple(a + b for a, b in zip(one, other, strict=True))
