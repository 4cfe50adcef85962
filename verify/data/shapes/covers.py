"""Convex bodies within a union: its parts, and those that reach across the faces that parts share.

Where one part ends at n.x <= h and another at n.x >= h, or sooner, a point that keeps all other inequalities of both is in one
or in the other: without the shared face the two are one convex body within the union. The rule is applied to what it gives,
too, so that a point where four boxes meet is inside. A ball in one of these bodies is in the union; a ball that only
several of them cover together, around a corner that goes inwards, is not found.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from functools import lru_cache

from verify.data.shapes.inequalities import Inequality

Cover = tuple[Inequality, ...]
Numbers = tuple[int, ...]
"""A convex body, by the numbers of its inequalities."""


@lru_cache(maxsize=4096)
def covers(parts: tuple[tuple[Inequality, ...], ...], most: int = 64) -> tuple[Cover, ...]:
    """Return convex bodies within a union: its parts first, and what they become without the faces between them.

    Args:
        parts: The union.
        most: How many bodies are looked for; any number of them is right.
    """
    if len(parts) == 1:
        return (tuple(dict.fromkeys(parts[0])),)
    known = {one: number for number, one in enumerate(dict.fromkeys(one for part in parts for one in part))}
    union = _Union(tuple(known))
    found: list[Numbers] = [tuple(dict.fromkeys(known[one] for one in part)) for part in parts]
    sets = [frozenset(part) for part in found]
    index = 0
    while index < len(found) and len(found) < most:
        for other in range(index):
            for bridge in union.bridges(found[index], found[other]):
                kept = frozenset(bridge)
                if any(body <= kept for body in sets) or len(found) >= most:
                    continue
                found.append(bridge)
                sets.append(kept)
        index += 1
    return tuple(tuple(union.inequalities[number] for number in body) for body in found)


class _Union:
    """The inequalities of a union by their numbers, with what is asked of pairs of them over and over."""

    def __init__(self, inequalities: Sequence[Inequality]) -> None:
        self.inequalities = inequalities
        flat = [not any(map(any, one.quadratic)) for one in inequalities]
        ways = {way: number for number, way in enumerate(dict.fromkeys(one.linear for one in inequalities))}
        self._bounds = [one.bound for one in inequalities]
        self._ways = [ways[one.linear] if is_flat else None for one, is_flat in zip(inequalities, flat, strict=True)]
        self._opposite = [ways.get((-x, -y, -z)) for x, y, z in ways]
        self._facing = [
            frozenset(k for k, b in enumerate(inequalities) if flat[i] and flat[k] and _faces(a, b))
            for i, a in enumerate(inequalities)
        ]

    def bridges(self, one: Numbers, other: Numbers) -> list[Numbers]:
        """Return what two convex bodies become without a face at which one begins where the other ends."""
        found: list[Numbers] = []
        for a in one:
            facing = self._facing[a]
            for b in other if facing else ():
                if b in facing:
                    rest = self._thick(dict.fromkeys([*(x for x in one if x != a), *(x for x in other if x != b)]))
                    if rest is not None:
                        found.append(rest)
        return found

    def _thick(self, body: Iterable[int]) -> Numbers | None:
        """Leave out half-spaces that hold another one with the very same normal; None where two opposite ones leave nothing between."""
        least: dict[int, float] = {}
        for x in body:
            way = self._ways[x]
            if way is not None:
                least[way] = min(self._bounds[x], least.get(way, math.inf))
        for way, bound in least.items():
            opposite = self._opposite[way]
            if opposite is not None and bound + least.get(opposite, math.inf) <= 0:
                return None
        return tuple(x for x in body if (way := self._ways[x]) is None or self._bounds[x] <= least[way])


def _faces(a: Inequality, b: Inequality) -> bool:
    """Return whether every point beyond one half-space is in another: their normals are opposite, and they leave no gap."""
    if sum(x * y for x, y in zip(a.linear, b.linear, strict=True)) >= 0:  # in floats: most pairs end here
        return False
    first, second = [Fraction(x) for x in a.linear], [Fraction(x) for x in b.linear]
    if any(first[i] * second[j] != first[j] * second[i] for i, j in ((0, 1), (0, 2), (1, 2))):
        return False
    axis = next(i for i in range(3) if first[i])
    share = -second[axis] / first[axis]  # second = -share first
    return share > 0 and Fraction(b.bound) >= -share * Fraction(a.bound)
