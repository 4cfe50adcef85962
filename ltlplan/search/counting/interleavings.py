"""Orders in which robots that are counted make their letters: all that some waits allow, those at one instant included."""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from operator import mul

from ltlplan.logic.automaton import DEAD
from ltlplan.search.counting.counting_propositions import Sums

MOST_STEPS = 20_000
"""Steps of trying all orders."""
_Progress = tuple[tuple[int, ...], ...]
"""For each kind of robots how many are at each of its letters."""


@dataclass(frozen=True, slots=True)
class Interleaved:
    """Robots that make letters one after another, in kinds that are alike.

    Attributes:
        ways: The letters of each kind's robots, that before the first move included.
        counts: How many there are of each.
        others: The marks that all other robots make.
    """

    ways: tuple[tuple[Sums, ...], ...]
    counts: tuple[int, ...]
    others: Sums


@dataclass(frozen=True, slots=True)
class KindWait:
    """No robot of kind `then` comes to its letter `due` before all robots of kind `first` have come to their letter `done`."""

    first: int
    done: int
    then: int
    due: int

    def allows(self, before: _Progress, after: _Progress) -> bool:
        """Tell whether what happens at one instant keeps it."""
        return sum(after[self.then][self.due :]) == sum(before[self.then][self.due :]) or not any(
            before[self.first][: self.done]
        )


# five parameters: what is read by whom, in which orders, to which end
def in_all_orders(
    read: Callable[[int, Sums], int],
    states: set[int],
    team: Interleaved,
    waits: Sequence[KindWait] = (),
    done: Callable[[int], bool] = lambda _: True,
) -> set[int]:
    """Return the states of one conjunct that all orders of a team's letters lead to; none where one will not do, or they are too many.

    One order is read first, in which each robot goes on for as long as it may: it will not do in most teams of which some order will not.

    Args:
        read: Returns the conjunct's state after a letter, or `DEAD`.
        states: Where it may be at the beginning.
        team: Who makes which letters.
        waits: Orders are left out that do not keep them.
        done: Whether a state will do at the end.
    """
    start = tuple((count, *(0,) * (len(way) - 1)) for way, count in zip(team.ways, team.counts, strict=True))
    if not all(map(done, _in_one_order(read, states, team, waits, start))):
        return set()
    layers: dict[int, dict[_Progress, set[int]]] = defaultdict(dict)
    layers[0][start] = states
    last, steps = sum(count * (len(way) - 1) for way, count in zip(team.ways, team.counts, strict=True)), 0
    for depth in range(last):
        for progress, here in layers.pop(depth, {}).items():
            for after, shown in _further(team.ways, progress):
                if not all(wait.allows(progress, after) for wait in waits):
                    continue
                steps += len(here)
                sums = total((team.others, *shown))
                found = {read(state, sums) for state in here}
                if steps > MOST_STEPS or DEAD in found:
                    return set()
                at = sum(place * count for counts in after for place, count in enumerate(counts))
                layers[at].setdefault(after, set()).update(found)
    found = next(iter(layers[last].values()))
    return found if all(map(done, found)) else set()


# five parameters: as `in_all_orders` has, and where it begins
def _in_one_order(
    read: Callable[[int, Sums], int], states: set[int], team: Interleaved, waits: Sequence[KindWait], start: _Progress
) -> set[int]:
    """Return the states after an order in which whoever has come farthest goes on; none where waits let nobody go on."""
    progress, going = start, True
    while going:
        going = False
        for kind, place in ((k, p) for k, counts in enumerate(progress) for p in reversed(range(len(counts) - 1)) if counts[p]):
            counts = list(progress[kind])
            counts[place : place + 2] = counts[place] - 1, counts[place + 1] + 1
            after = (*progress[:kind], tuple(counts), *progress[kind + 1 :])
            if all(wait.allows(progress, after) for wait in waits):
                progress, going = after, True
                made = (
                    tuple(n * m for m in marks)
                    for way, own in zip(team.ways, after, strict=True)
                    for marks, n in zip(way, own, strict=True)
                )
                sums = total((team.others, *made))
                states = {read(state, sums) for state in states}
                break
    return states if not any(any(counts[:-1]) for counts in progress) else set()


def _further(kinds: Sequence[tuple[Sums, ...]], progress: _Progress) -> Iterator[tuple[_Progress, tuple[Sums, ...]]]:
    """Yield what can follow when some robots, one at least, go on by one letter at one instant, with the marks that each kind makes then."""
    for chosen in itertools.islice(
        itertools.product(*map(_options, kinds, progress)), 1, None
    ):  # the first one is that nobody does
        after, shown = zip(*chosen, strict=True)
        yield after, shown


@lru_cache(maxsize=10_000)
def _options(way: tuple[Sums, ...], counts: tuple[int, ...]) -> list[tuple[tuple[int, ...], Sums]]:
    """Return what can follow for one kind, how many of which are at each of their letters; at first that nobody goes on."""
    afters = (
        tuple(count - out + new for count, out, new in zip(counts, (*going, 0), (0, *going), strict=True))
        for going in itertools.product(*(range(count + 1) for count in counts[:-1]))
    )
    return [(after, tuple(sum(map(mul, after, marks)) for marks in zip(*way, strict=True))) for after in afters]


def total(held: Sequence[Sums]) -> Sums:
    """Return the sum of the marks that robots make."""
    return tuple(map(sum, zip(*held, strict=True)))
