"""Sets of times as sorted cuts, exact and in integers.

A cut is an integer: `2 * x` lies just before the time x, `2 * x + 1` just after it; x counts ticks, the common divisor of all times at hand. A
set begins at its first cut, ends at the second, begins again at the third. With an odd number of cuts it never ends. So `(2, 5)` is [1, 2],
`(3, 4)` is the open interval (1, 2), `(0,)` is all time from 0 on. No set has times below 0.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator

Instants = tuple[int, ...]

NEVER: Instants = ()
ALWAYS: Instants = (0,)


def at(instants: Instants, tick: int) -> bool:
    """Return whether a time belongs to a set."""
    return shows(instants, 2 * tick)


def shows(instants: Instants, cut: int) -> bool:
    """Return whether the times just behind a cut belong to a set: its own time where the cut lies before it."""
    return bisect_right(instants, cut) % 2 == 1


def complement(instants: Instants) -> Instants:
    """Return all times from 0 on that do not belong to a set."""
    return instants[1:] if instants and instants[0] == 0 else (0, *instants)


def union(*sets: Instants) -> Instants:
    """Return the times that belong to one of the sets."""
    return _covered(sets, 1)


def intersection(*sets: Instants) -> Instants:
    """Return the times that belong to all of the sets."""
    return _covered(sets, len(sets))


def _covered(sets: tuple[Instants, ...], least: int) -> Instants:
    """Return the times that belong to so many of the sets at least, one or more."""
    steps = sorted((cut, 1 - 2 * (index % 2)) for instants in sets for index, cut in enumerate(instants))
    found: list[int] = []
    depth = 0
    for number, (cut, step) in enumerate(steps):
        depth += step
        if number + 1 < len(steps) and steps[number + 1][0] == cut:
            continue
        if (depth >= least) != (len(found) % 2 == 1):
            found.append(cut)
    return tuple(found)


def shifted(instants: Instants, ticks: int) -> Instants:
    """Return the times t from 0 on for which t + ticks belongs to a set."""
    if ticks == 0:
        return instants
    first = bisect_right(instants, 2 * ticks)
    later = tuple(cut - 2 * ticks for cut in instants[first:])
    return (0, *later) if first % 2 else later


def before(instants: Instants, tick: int) -> Instants:
    """Return the times of a set up to a time, that one included."""
    return intersection(instants, (0, 2 * tick + 1))


def since(instants: Instants, tick: int) -> Instants:
    """Return the times of a set from a time on, that one included."""
    return intersection(instants, (2 * tick,))


def intervals(instants: Instants) -> Iterator[tuple[int, int | None]]:
    """Yield the two cuts of each interval of a set; None for one that never ends."""
    for index in range(0, len(instants), 2):
        yield instants[index], instants[index + 1] if index + 1 < len(instants) else None


def lasting(instants: Instants, ticks: int) -> Instants:
    """Return the times t for which all of [t, t + ticks) belongs to a set."""
    if ticks == 0:
        return ALWAYS
    found: list[int] = []
    for low, high in intervals(instants):
        if high is None:
            found.append(low)
        elif (last := (high // 2 - ticks) * 2 + 1) > low:
            found += (low, last)
    return tuple(found)


def until(held: Instants, reached: Instants, ticks: int | None) -> Instants:
    """Return the times t from which one thing is held until another is reached, after so many ticks at the latest.

    That is: for some t' in [t, t + ticks] the other one is there at t' and the first at all times in [t, t'); or for some t' in [t, t + ticks)
    the first is there in [t, t'] and the other one just after t'. Regions are closed, so what holds outside of one begins at no first instant.

    Args:
        held: Times of the first.
        reached: Times of the other.
        ticks: None for no bound.
    """
    pieces: list[Instants] = [reached]
    just_after = tuple(cut // 2 * 2 for cut in reached)  # the times after which the other is there at once
    for low, high in intervals(held):
        end = None if high is None else high // 2 * 2 + 1  # it may be reached where the first ends
        for start, stop in _within(reached, low, end):
            pieces.append(_from(low if ticks is None else max(low, start - 2 * ticks), _least(stop, high)))
        if ticks == 0:
            continue
        for start, stop in _within(just_after, low, high):
            pieces.append(_from(low if ticks is None else max(low, (start | 1) - 2 * ticks), stop))
    return union(*pieces)


def _within(instants: Instants, low: int, high: int | None) -> Iterator[tuple[int, int | None]]:
    """Yield the intervals of a set, cut down to those between two cuts."""
    first = bisect_right(instants, low)
    for index in range(first - first % 2, len(instants), 2):
        start = max(instants[index], low)
        if high is not None and start >= high:
            return
        stop = _least(instants[index + 1] if index + 1 < len(instants) else None, high)
        if stop is None or stop > start:
            yield start, stop


def _least(one: int | None, other: int | None) -> int | None:
    return other if one is None else one if other is None else min(one, other)


def _from(low: int, high: int | None) -> Instants:
    return (low,) if high is None else (low, high) if high > low else ()
