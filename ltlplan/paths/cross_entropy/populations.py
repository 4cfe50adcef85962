"""Several Gaussians that share the candidates of each round; twice, the worse half of them leaves.

A Gaussian that is fitted to its own elite settles in one valley of the costs, and which one depends on its mean and its first
draws. Several that draw for themselves, from means of their own, settle in several. Each batch of a round goes to one of them
in turn, so that those that stay get more of every round: with four, a quarter each at first, then a half, then one gets all.
The budget is the same as for one Gaussian (successive halving: Jamieson and Talwalkar, "Non-stochastic best arm
identification", AISTATS 2016).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ltlplan.paths.cross_entropy.gaussian import Search
from verify.data.arrays import Floats

_OPENING = 0.5  # share of the batches after which half of the populations leave for the first time
_LAST = 0.75  # share of the batches after which the best one is alone


@dataclass(frozen=True, eq=False)
class Tournament:
    """The populations that are left.

    Attributes:
        searches: One Gaussian each, the order of their turns.
        told: How many batches they were told, those that have left included.
    """

    searches: tuple[Search, ...]
    told: int = 0

    @classmethod
    def start(cls, search: Search, others: Sequence[Search] = ()) -> Tournament:
        """Begin with as many populations as the options say.

        Args:
            search: The first population.
            others: The next ones; where there are fewer than the options say, all begin again from the first.
        """
        return cls(tuple(itertools.islice(itertools.cycle((search, *others)), search.options.gaussians)))

    @property
    def best(self) -> Search:
        """The population with the least cost so far; the first of several."""
        return min(self.searches, key=lambda search: search.best_cost)

    def ask(self, rng: np.random.Generator) -> Floats:
        """Draw the next batch of a round, from the population whose turn it is. Shape (batch, size)."""
        sizes = self.searches[0].options.sizes
        return self.searches[self.told % len(self.searches)].ask(rng, sizes[self.told % len(sizes)])

    def tell(self, candidates: Floats, costs: Floats) -> Tournament:
        """Return the tournament after the batch that was asked for."""
        turn, told = self.told % len(self.searches), self.told + 1
        searches = list(self.searches)
        searches[turn] = searches[turn].tell(candidates, costs)
        options = searches[0].options
        batches = options.rounds * len(options.sizes)
        if told == round(_LAST * batches):
            searches = _best(searches, 1)
        elif told == round(_OPENING * batches):
            searches = _best(searches, (len(searches) + 1) // 2)
        return replace(self, searches=tuple(searches), told=told)


def _best(searches: list[Search], count: int) -> list[Search]:
    return sorted(searches, key=lambda search: search.best_cost)[:count]
