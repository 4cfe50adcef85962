"""Moves that may be made at the same time: stages, within which the formula allows every order, and between which robots wait.

A course is a list of moves one after another. Moves are put into one stage for as long as all the orders in which their
letters can come, those of robots that do the same at one instant too, leave the conjuncts in states from which the rest of the
course does what is asked. A robot sets out for a move of the next stage when all that move in this one have arrived.
"""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from functools import lru_cache

from ltlplan.search.counting.counting_propositions import Marks, States, Sums

MOST_STEPS = 20_000
"""Steps of trying all orders of one stage's moves."""

Turn = tuple[int, tuple[Sums, ...]]
"""One robot's move as the formula sees it: which robot, and the marks that it makes along the way."""

_Progress = tuple[tuple[int, ...], ...]
"""For each kind of move how many robots are at each of its letters."""


def stages(marks: Marks, begin: Sequence[Sums], turns: Sequence[Turn]) -> list[tuple[int, ...]] | None:
    """Return turns, by index, in stages; None where even one after another they do not do what is asked.

    Args:
        marks: What the formula sees.
        begin: The marks that each robot makes at its start.
        turns: In an order that does what is asked.
    """
    first = marks.begin(_total(begin))
    if first is None or not _is_done_by(marks, {first}, begin, turns):
        return None
    found: list[tuple[int, ...]] = []
    held, states, at = begin, {first}, 0
    while at < len(turns):
        size, states = _longest(marks, states, held, turns[at:])
        held = _held_after(held, turns[at : at + size])
        found.append(tuple(range(at, at + size)))
        at += size
    return found


def _longest(marks: Marks, states: set[States], held: Sequence[Sums], turns: Sequence[Turn]) -> tuple[int, set[States]]:
    """Return how many of the first turns can be made at the same time, and the states that this can lead to."""

    def possible(size: int) -> set[States] | None:
        after = _at_once(marks, states, held, turns[:size])
        done = after is not None and _is_done_by(marks, after, _held_after(held, turns[:size]), turns[size:])
        return after if done else None

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


def _held_after(held: Sequence[Sums], turns: Sequence[Turn]) -> list[Sums]:
    """Return the marks that each robot makes after some turns."""
    last = {robot: shown[-1] for robot, shown in turns}
    return [last.get(robot, own) for robot, own in enumerate(held)]


def _is_done_by(marks: Marks, states: set[States], held: Sequence[Sums], turns: Sequence[Turn]) -> bool:
    """Tell whether turns, one after another, lead from all these states to where everything is done."""
    now = list(held)
    for robot, way in turns:
        for shown in way:
            now[robot] = shown
            sums = _total(now)
            after = {marks.read(state, sums) for state in states}
            states = {state for state in after if state is not None}
            if None in after:
                return False
    return all(marks.accepting(state) for state in states)


def _at_once(marks: Marks, states: set[States], held: Sequence[Sums], turns: Sequence[Turn]) -> set[States] | None:
    """Return the states that all orders of some robots' letters lead to; None where one loses the task, or they are too many."""
    ways: dict[int, tuple[Sums, ...]] = {}  # a robot makes its own turns one after another
    for robot, way in turns:
        ways[robot] = (*ways.get(robot, (held[robot],)), *way)
    kinds = Counter(ways.values())
    others = _total([own for robot, own in enumerate(held) if robot not in ways] or [(0,) * len(held[0])])
    start = tuple((count, *(0,) * (len(way) - 1)) for way, count in kinds.items())
    layers: dict[int, dict[_Progress, set[States]]] = defaultdict(dict)
    layers[0][start] = states
    last, steps = sum(count * (len(way) - 1) for way, count in kinds.items()), 0
    for depth in range(last):
        for progress, here in layers.pop(depth, {}).items():
            for after, shown in _further(tuple(kinds), progress):
                steps += len(here)
                if steps > MOST_STEPS:
                    return None
                sums = _total((others, *shown))
                read = {marks.read(state, sums) for state in here}
                if None in read:
                    return None
                reached = layers[_depth(after)].setdefault(after, set())
                reached |= {state for state in read if state is not None}
    return next(iter(layers[last].values()))


def _depth(progress: _Progress) -> int:
    return sum(place * count for counts in progress for place, count in enumerate(counts))


def _further(kinds: Sequence[tuple[Sums, ...]], progress: _Progress) -> Iterator[tuple[_Progress, tuple[Sums, ...]]]:
    """Yield what can follow when some robots, one at least, go on by one letter at one instant, with the marks that each kind makes then."""
    options = map(_options, kinds, progress)
    for chosen in itertools.islice(itertools.product(*options), 1, None):  # the first one is that nobody does
        after, shown = zip(*chosen, strict=True)
        yield after, shown


@lru_cache(maxsize=10_000)
def _options(way: tuple[Sums, ...], counts: tuple[int, ...]) -> list[tuple[tuple[int, ...], Sums]]:
    """Return what can follow for one kind, how many of which are at each of their letters; at first that nobody goes on."""
    found: list[tuple[tuple[int, ...], Sums]] = []
    for going in itertools.product(*(range(count + 1) for count in counts[:-1])):
        after = tuple(count - out + new for count, out, new in zip(counts, (*going, 0), (0, *going), strict=True))
        found.append((after, tuple(sum(a * m for a, m in zip(after, marks, strict=True)) for marks in zip(*way, strict=True))))
    return found


def _total(held: Sequence[Sums]) -> Sums:
    return tuple(map(sum, zip(*held, strict=True)))
