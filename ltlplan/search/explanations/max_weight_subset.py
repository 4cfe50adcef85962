"""Subset of parts to keep where not all can be kept: the most weight, and of equal weight the least cost.

Sets of parts to leave out are tried in the order of their weight (`ltlplan.search.lawler`). A set that cannot be kept is made smaller until all of it is needed for
that; whoever keeps such a core need not be searched again, so that few searches answer for all sets (as MaxSAT solvers do; Davies and
Bacchus 2011). Where searches or sets are too many, parts are added one by one, heaviest first, and the answer is said to be uncertain.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from ltlplan.logic.budget import TooLarge
from ltlplan.search.lawler import Partition

Parts = frozenset[int]
CostOf = Callable[[Parts], "float | None"]
"""From parts, by index, to the least cost of keeping them all; None where that cannot be. Raises TooLarge where it is not known."""

SEARCHES = 300
"""Sets of parts that are searched for, at most."""

_SETS = 20_000  # sets that are looked at, most of them without a search
_NEAR = 10**6  # weights are taken as ratios of numbers no larger where that changes them by less than a billionth
_SLACK = 1e-9  # by which costs may differ and count as equal


@dataclass(frozen=True, slots=True)
class Kept:
    """A choice of parts.

    Attributes:
        parts: The indices of those that are kept.
        cost: The least cost of keeping them.
        certain: Whether no choice keeps more weight, or costs less for the same.
    """

    parts: Parts
    cost: float
    certain: bool


class _Spent(Exception):
    """No more searches are allowed."""


class MostWeight:
    """Choices among the same parts; what was searched for once is known.

    Args:
        weights: Of each part, above 0.
        cost_of: Searches for the least cost of keeping some parts.
        searches: How often, at most.
    """

    def __init__(self, weights: Sequence[float], cost_of: CostOf, *, searches: int = SEARCHES) -> None:
        self.weights = comparable(weights)
        self._cost_of, self._left, self._sets = cost_of, searches, _SETS
        self._known: dict[Parts, float | None] = {}
        self._too_large: set[Parts] = set()
        self._cores: list[Parts] = []

    def choose(self, forced: Parts = frozenset()) -> Kept | None:
        """Return the best choice that keeps some parts in any case; None where these cannot be kept.

        Args:
            forced: The indices of parts that must be kept.
        """
        try:
            return self._exactly(forced)
        except _Spent:
            return self._greedily(forced)

    def alone_impossible(self, part: int) -> bool:
        """Tell whether it is known that a part cannot be kept even by itself.

        Args:
            part: Its index.
        """
        return any(core <= {part} for core in self._cores)

    def _exactly(self, forced: Parts) -> Kept | None:
        best: Kept | None = None
        least, certain = Fraction(0), True  # weight left out by the best
        for left_out, kept in self._by_weight(forced):
            if best is not None and left_out > least:
                break
            cost = self._search(kept)
            if cost is None:
                certain = certain and kept in self._known
            elif best is None or cost < best.cost - _SLACK:
                best, least = Kept(kept, cost, certain=True), left_out
        return best and replace(best, certain=certain)

    def _by_weight(self, forced: Parts) -> Iterator[tuple[Fraction, Parts]]:
        """Yield sets to keep that hold no core, those first that leave out least weight, with that weight."""
        everything = frozenset(range(len(self.weights)))
        free = sorted(everything - forced, key=lambda part: (self.weights[part], part))

        def cost(places: tuple[int, ...]) -> Iterator[tuple[tuple[Fraction, tuple[int, ...]], Parts]]:
            left_out = frozenset(free[place] for place in places)
            yield (sum((self.weights[part] for part in left_out), Fraction(0)), places), everything - left_out

        def heavier(places: tuple[int, ...], _kept: Parts) -> Iterator[tuple[int, ...]]:
            after = places[-1] + 1 if places else 0
            if after < len(free):
                yield (*places, after)
                if places:
                    yield (*places[:-1], after)

        for (weight, _), _, _, kept in Partition([()], cost, heavier):
            self._sets -= 1
            if self._sets < 0:
                raise _Spent
            if not any(core <= kept for core in self._cores):
                yield weight, kept

    def _search(self, kept: Parts) -> float | None:
        """Return the least cost of keeping some parts; where they cannot be kept, a core of them is known afterwards."""
        cost = self._cost(kept)
        if cost is None and kept in self._known and not any(core <= kept for core in self._cores):
            core = kept
            for part in sorted(kept, key=lambda part: (self.weights[part], part)):
                smaller = core - {part}
                if self._cost(smaller) is None and smaller in self._known:
                    core = smaller
            self._cores.append(core)
        return cost

    def _cost(self, kept: Parts) -> float | None:
        if any(core <= kept for core in self._cores):
            self._known[kept] = None
        if kept in self._too_large:
            return None  # not known
        if kept not in self._known:
            if self._left <= 0:
                raise _Spent
            self._left -= 1
            try:
                self._known[kept] = self._cost_of(kept)
            except TooLarge:
                self._too_large.add(kept)
                return None
        return self._known[kept]

    def _greedily(self, forced: Parts) -> Kept | None:
        self._left += len(self.weights) + 1
        kept, cost = forced, self._cost(forced)
        if cost is None:
            return None
        for part in sorted(set(range(len(self.weights))) - forced, key=lambda part: (-self.weights[part], part)):
            more = self._cost(kept | {part})
            if more is not None:
                kept, cost = kept | {part}, more
        return Kept(kept, cost, certain=False)


def comparable(weights: Sequence[float]) -> tuple[Fraction, ...]:
    """Return weights as shares of the largest, such that sums that are meant to be equal are, whatever unit they are in.

    Args:
        weights: Above 0.
    """
    exact = [Fraction(repr(float(weight))) for weight in weights]
    largest = max(exact, default=Fraction(1))
    shares = [weight / largest for weight in exact]
    near = [share.limit_denominator(_NEAR) for share in shares]
    return tuple(b if abs(a - b) * 10**9 < a else a for a, b in zip(shares, near, strict=True))
