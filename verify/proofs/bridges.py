"""Convex bodies across the faces that parts of a region share, by the steps that the kernel repeats."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import product

from verify.kernel.statement import Inequality, Shape, Statement, Vector
from verify.kernel.zones import holds, meet

_MOST = 64
"""Bodies of one region, parts included."""

Bridge = list[int]
"""Numbers of two bodies, and of a face of each, without which they are one."""


def bridges(statement: Statement) -> dict[str, list[Bridge]]:
    """Return the bridges of regions of several parts, by the key of their evidence."""
    found = {name: list(_bridges(shape)) for name, shape in statement.regions.items() if len(shape.parts) > 1}
    return {f"bridges/{name}": rows for name, rows in found.items() if rows}


def _bridges(shape: Shape) -> Iterator[Bridge]:
    every: list[Inequality] = list(dict.fromkeys(one for part in shape.parts for one in part))
    bodies = [frozenset(every.index(one) for one in part) for part in shape.parts]
    flat = {number: (one.linear, one.bound) for number, one in enumerate(every) if one.linear and not one.quadratic}
    index = 0
    while index < len(bodies) and len(bodies) < _MOST:
        for other in range(index):
            for a, b in product(sorted(bodies[index]), sorted(bodies[other])):
                if len(bodies) >= _MOST or not meet(every[a], every[b]):
                    continue
                body = (bodies[index] - {a}) | (bodies[other] - {b})
                body = frozenset(k for k in body if not any(holds(every[j], every[k]) for j in body))
                if _is_new(body, bodies, flat):
                    bodies.append(body)
                    yield [index, other, a, b]
        index += 1


def _is_new(body: frozenset[int], bodies: list[frozenset[int]], flat: dict[int, tuple[Vector, Fraction]]) -> bool:
    """Return whether a body is not empty, as far as opposite faces tell, and holds more than one that is known."""
    for k, j in product(body & flat.keys(), repeat=2):
        (one, bound), (other, its) = flat[k], flat[j]
        if all(a == -b for a, b in zip(one, other, strict=True)) and bound + its <= 0:
            return False
    return not any(known <= body for known in bodies)
