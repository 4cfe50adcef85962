"""A Gaussian that is fitted to the elite of what is drawn from it (Algorithm 2 of the 2019 paper), as a frozen value.

    ask: draw candidates    tell: keep the elite of those that count, fit the Gaussian to it

It knows nothing of paths: a cost is a number, infinite for a candidate that does not count.

In a `Tournament` several Gaussians share the candidates of each round; twice, the worse half of them leaves. A Gaussian that is fitted to its own elite settles in one valley of the costs, and which one depends on its mean and its first
draws. Several that draw for themselves, from means of their own, settle in several. Each batch of a round goes to one of them
in turn, so that those that stay get more of every round: with four, a quarter each at first, then a half, then one gets all.
The budget is the same as for one Gaussian (successive halving: Jamieson and Talwalkar, "Non-stochastic best arm
identification", AISTATS 2016).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from verify.data.arrays import Floats

_BATCH = 250  # candidates after which a Gaussian is fitted again, about
_FLOOR = 1e-5  # least standard deviation in any direction, in the unit of the candidates
_POPULATIONS = 4
_BATCHES_EACH = 100  # fewer than that for each population, and one alone goes farther
_OPENING = 0.5  # share of the batches after which half of the populations leave for the first time
_LAST = 0.75  # share of the batches after which the best one is alone


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the search.

    Attributes:
        samples: Candidates a round.
        elite: Share of a round that the Gaussian is fitted to, 0.1 <= elite < 0.3.
        rounds: At most this many.
        target: Stop once the best cost is not above it.
        batch: A round is drawn and told in parts of about this many candidates: large rounds then teach the Gaussian
            several times each, which takes it farther than one fit to all of them.
        populations: How many Gaussians begin side by side and share each round, the worse half leaving the search twice
            before its end; by default 4 where each of them gets 100 batches, otherwise 1.
    """

    samples: int = 200
    elite: float = 0.25
    rounds: int = 50
    target: float = 0.0
    batch: int = _BATCH
    populations: int | None = None

    @property
    def sizes(self) -> tuple[int, ...]:
        """Candidates in each batch of a round, as equal as they can be."""
        count = max(1, self.samples // self.batch)
        least, more = divmod(self.samples, count)
        return (least + 1,) * more + (least,) * (count - more)

    @property
    def gaussians(self) -> int:
        """Number of Gaussians that begin the search."""
        if self.populations is not None:
            return self.populations
        return _POPULATIONS if self.rounds * len(self.sizes) >= _POPULATIONS * _BATCHES_EACH else 1


@dataclass(frozen=True, eq=False)
class Search:
    """The Gaussian, and the best candidate seen.

    Attributes:
        mean: Shape (size,).
        covariance: Shape (size, size).
        best: The candidate with the least cost so far; the first mean until one counted. Shape (size,).
        best_cost: Its cost; infinite until one counted.
        options: How to search.
    """

    mean: Floats
    covariance: Floats
    best: Floats
    best_cost: float
    options: Options

    @classmethod
    def start(cls, mean: ArrayLike, covariance: ArrayLike, options: Options, best_cost: float = math.inf) -> Search:
        """Begin at a mean, whose own cost may be given.

        Args:
            mean: Shape (n,).
            covariance: Shape (n, n).
            options: How to search.
            best_cost: Of the mean; infinite where it does not count or is not known.
        """
        centre, spread = np.array(mean, dtype=np.float64), np.array(covariance, dtype=np.float64)
        return cls(centre, spread, centre, best_cost, options)

    def ask(self, rng: np.random.Generator, count: int | None = None) -> Floats:
        """Draw `count` candidates, by default a whole round. Shape (count, size)."""
        values, vectors = np.linalg.eigh(self.covariance)
        root = vectors * np.sqrt(np.maximum(values, _FLOOR**2))
        return self.mean + rng.standard_normal((self.options.samples if count is None else count, len(self.mean))) @ root.T

    def tell(self, candidates: Floats, costs: Floats) -> Search:
        """Return the search after the candidates that it was asked for.

        The elite is `elite` times as many, or fewer where fewer candidates have a finite cost. Fewer than two leave the
        mean where it is and halve the spread: they were drawn too widely for the specification.

        The update is the maximum-likelihood fit to the elite, weighted by rank. Its covariance is taken about the old
        mean: about the elite's own mean, as the paper leaves it open, the spread dies along the very direction in which
        the costs fall, and the search stops half way.
        """
        order = np.argsort(costs, kind="stable")
        order = order[np.isfinite(costs[order])]
        best, best_cost = self.best, self.best_cost
        if len(order) and costs[order[0]] < best_cost:
            best, best_cost = candidates[order[0]].copy(), float(costs[order[0]])
        count = math.ceil(self.options.elite * len(candidates))
        elites = candidates[order[:count]]
        if len(elites) < 2:
            return replace(self, covariance=self.covariance / 4, best=best, best_cost=best_cost)
        weights = math.log(count + 0.5) - np.log(np.arange(1, len(elites) + 1))
        weights /= weights.sum()
        beta = max(0.1, count / (count + 10 * len(self.mean)))  # few elites know little of a covariance
        offset = elites - self.mean
        covariance = (1 - beta) * self.covariance + beta * (offset.T * weights) @ offset
        return replace(self, mean=weights @ elites, covariance=(covariance + covariance.T) / 2, best=best, best_cost=best_cost)


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
