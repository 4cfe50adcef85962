"""Few precedences under which every team word satisfies the formula, taken from one order of all events that does.

Precedences are added for as long as some team word that keeps them breaks the formula: of those that the order has and that word has
not, the one that is easiest to fly and asks least. Then each that can be done without is left out again.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from ltlplan.search.orders.event_names import Names, unlikeness
from ltlplan.search.orders.linearisations import At, Event, Linearisations, Pair
from verify.data.plan import Precedence


def needed_orders(words: Linearisations, order: Sequence[Event], names: Names) -> dict[Pair, Precedence] | None:
    """Return precedences that suffice, as plans say them, or None where those that a plan can say do not.

    Args:
        words: The robots' words, and the formula.
        order: All events in an order all of whose team words satisfy the formula.
        names: What plans say of events.

    Raises:
        TooLarge: There are too many team words.
    """
    place = {event: index for index, event in enumerate(order)}
    said = {pair: names.precedence(pair) for pair in itertools.combinations(order, 2) if pair[0][0] != pair[1][0]}
    named = {pair: precedence for pair, precedence in said.items() if precedence is not None}
    offered = sorted(named, key=lambda pair: (unlikeness(named[pair]), place[pair[0]] - place[pair[1]], pair))
    pairs: list[Pair] = []
    while (broken := words.broken(pairs)) is not None:
        missing = next((pair for pair in offered if _breaks(broken.way, pair)), None)
        if missing is None:
            return None
        pairs.append(missing)
    for pair in sorted(pairs, key=offered.index, reverse=True):
        others = [other for other in pairs if other != pair]
        if words.broken(others) is None:
            pairs = others
    return {pair: named[pair] for pair in sorted(pairs, key=lambda each: (place[each[1]], place[each[0]]))}


def _breaks(way: Sequence[At], pair: Pair) -> bool:
    """Tell whether a team word does not keep a precedence."""
    (robot, index), (other, then) = pair
    for before, after in itertools.pairwise(way):
        if before[other] < then <= after[other]:
            return before[robot] < index
    return False
