"""Lower bounds on the cost to come to sets of places and then home, in whichever order is cheapest.

Of few sets all orders are compared (Held and Karp 1962); of many it is bounded by spanning trees with tolls (Held and Karp 1970).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ltlplan.search.memoization import memoized
from verify.data.arrays import Floats

_ASCENT = 150  # steps by which tolls are chosen


def needed(sets: Sequence[frozenset[int]]) -> list[frozenset[int]]:
    """Return the sets that have to be come to by themselves: whoever comes to a part of another set comes to that one too.

    Args:
        sets: Of places.
    """
    different = list(dict.fromkeys(sets))
    return [own for own in different if not any(other < own for other in different)]


def least_orders(apart: Floats, after: Floats) -> Callable[[int], Floats]:
    """Return a function of the sets still to come to: for each of them, the least that is left once it was come to first.

    The table of Held and Karp: `table[left, k]` is the cheapest order of the sets in `left`, from set k, then home.

    Args:
        apart: Least costs from set to set. Shape (sets, sets).
        after: Least costs from each set home. Shape (sets,).
    """
    count = len(after)
    table = np.full((1 << count, count), np.inf)
    table[0] = after
    left = np.arange(1 << count)
    ones = np.array([bin(mask).count("1") for mask in range(1 << count)])
    for size in range(1, count):
        level = left[ones == size]
        for k in range(count):
            having = level[level >> k & 1 == 1]
            table[having] = np.minimum(table[having], apart[:, k] + table[having ^ (1 << k), k][:, None])

    def remaining(mask: int) -> Floats:
        return np.array([table[mask ^ (1 << k), k] if mask >> k & 1 else np.inf for k in range(count)])

    return remaining


class LeastTrees:
    """The least that is left, by the smallest tree that joins home and all sets still to come to.

    A way through sets leaves and enters each once. So a toll on each set changes all ways alike, but not trees, which may
    branch: the tolls of Held and Karp's ascent make the smallest tree nearly a way.

    Args:
        apart: Least costs from set to set. Shape (sets, sets).
        after: Least costs from each set home. Shape (sets,).
    """

    def __init__(self, apart: Floats, after: Floats) -> None:
        count = len(after)
        self._near = np.full((count + 1, count + 1), np.inf)  # home is the last one
        self._near[:count, :count] = np.minimum(apart, apart.T)
        self._near[:count, count] = self._near[count, :count] = after
        self._toll = np.zeros(count + 1)
        self._ascend()

    @memoized
    def remaining(self, mask: int) -> Floats:
        """Return the least for each set in the mask, as the first one that is come to; infinite for those not in it."""
        inside = np.array([mask >> k & 1 == 1 for k in range(len(self._toll) - 1)] + [True])
        total, _ = self._tree(inside)
        tolls = 2.0 * float(self._toll[inside].sum()) - float(self._toll[-1])
        return np.where(inside, np.maximum(total - tolls + self._toll, 0.0), np.inf)[:-1]

    def _tree(self, inside: NDArray[np.bool_]) -> tuple[float, NDArray[np.int64]]:
        """Return the length of the smallest tree, tolls included, and how many edges of it meet each set (Prim's algorithm)."""
        near = self._near + self._toll[:, None] + self._toll[None, :]
        outside = inside.copy()
        outside[-1] = False
        far, nearest = np.where(outside, near[-1], np.inf), np.full(len(inside), len(inside) - 1)
        met, total = np.zeros(len(inside), dtype=np.int64), 0.0
        while outside.any():
            k = int(np.argmin(far))
            total += float(far[k])
            met[k] += 1
            met[nearest[k]] += 1
            outside[k] = False
            closer = outside & (near[k] < far)
            far, nearest = np.where(closer, near[k], far), np.where(closer, k, nearest)
            far[~outside] = np.inf
        return total, met

    def _ascend(self) -> None:
        """Choose tolls under which the tree that joins everything is long."""
        inside, best, chosen = np.ones(len(self._toll), dtype=np.bool_), -np.inf, self._toll
        wanted = np.where(np.arange(len(self._toll)) < len(self._toll) - 1, 2, 1)
        step = float(self._near[np.isfinite(self._near)].mean()) / 4.0
        for _ in range(_ASCENT):
            total, met = self._tree(inside)
            value = total - float(wanted @ self._toll) + float(self._toll[:-1].min())
            if value > best:
                best, chosen = value, self._toll
            self._toll = self._toll + step * (met - wanted)
            step *= 0.97
        self._toll = chosen
