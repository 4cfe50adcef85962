"""Few precedences under which every team word satisfies the formula, taken from one order of all events that does.

Precedences are added for as long as some team word that keeps them breaks the formula: of those that the order has and that word has
not, the one that is easiest to fly and asks least. Then each that can be done without is left out again.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

from ltlplan.search.orders.linearisations import At, Event, Linearisations, Pair

Price = Callable[[Pair], tuple[int, ...] | None]
"""How dear it is to keep a precedence; None where it cannot be said in a plan."""


def needed_orders(words: Linearisations, order: Sequence[Event], price: Price) -> list[Pair] | None:
    """Return precedences that suffice, or None where those that a plan can say do not.

    Args:
        words: The robots' words, and the formula.
        order: All events in an order all of whose team words satisfy the formula.
        price: Prefers some precedences to others.

    Raises:
        TooLarge: There are too many team words.
    """
    place = {event: index for index, event in enumerate(order)}
    offered = [
        (cost, place[first] - place[then], (first, then))
        for first in order
        for then in order
        if first[0] != then[0] and place[first] < place[then] and (cost := price((first, then))) is not None
    ]
    offered.sort()
    pairs: list[Pair] = []
    while (broken := words.broken(pairs)) is not None:
        missing = next((pair for _, _, pair in offered if _breaks(broken.way, pair)), None)
        if missing is None:
            return None
        pairs.append(missing)
    dear = {pair: rank for rank, (_, _, pair) in enumerate(offered)}
    for pair in sorted(pairs, key=lambda each: -dear[each]):
        others = [other for other in pairs if other != pair]
        if words.broken(others) is None:
            pairs = others
    return sorted(pairs, key=lambda each: (place[each[1]], place[each[0]]))


def _breaks(way: Sequence[At], pair: Pair) -> bool:
    """Tell whether a team word does not keep a precedence."""
    (robot, index), (other, then) = pair
    for before, after in itertools.pairwise(way):
        if before[other] < then <= after[other]:
            return before[robot] < index
    return False
