"""Sums of half-spaces that part a path from an edge or a corner of an obstacle.

Everything here is in floats and only proposes: the kernel takes the sums, which have whole weights, and checks with them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from verify.kernel.flights import Team
from verify.kernel.statement import Inequality, Shape, Statement

_DEPTH = 10
_SLACK = 1e-7
"""m by which a plane must part more than is asked, so that rounding does not matter."""

_PARTS = 16
"""Weights are whole numbers up to this."""

Sum = list[list[int]]
_Floats = NDArray[np.float64]


def half_space_sums(statement: Statement, team: Team, hulls: Mapping[str, _Floats]) -> dict[str, list[list[Sum]]]:
    """Return sums of half-spaces for the parts of obstacles, by the key of their evidence.

    Args:
        statement: Has the obstacles.
        team: All paths.
        hulls: For each robot the corners of what holds each segment, m. Shape (segments, 8, 3).
    """
    found: dict[str, list[list[Sum]]] = {}
    alike: dict[Fraction, list[str]] = {}
    for name, path in team.paths.items():
        alike.setdefault(path.robot.radius, []).append(name)
    rows = {radius: np.concatenate([hulls[name] for name in names]) for radius, names in alike.items()}
    for name, obstacle in statement.obstacles.items():
        every: list[list[Sum]] = [[] for _ in obstacle.parts]
        for part, sums in zip(obstacle.parts, every, strict=True):
            planes = _Planes.of(obstacle, part)
            for radius, those in rows.items():
                _add_sums(sums, planes, those, float(statement.margin + radius))
        if any(every):
            found[f"sums/{name}"] = every
    return found


class _Planes:
    """The half-spaces of a part: their numbers, normals' lengths, unit normals and bounds."""

    def __init__(self, numbers: list[int], lengths: _Floats, normals: _Floats, bounds: _Floats) -> None:
        self.numbers, self.lengths, self.normals, self.bounds = numbers, lengths, normals, bounds

    @classmethod
    def of(cls, obstacle: Shape, part: Sequence[Inequality]) -> _Planes:
        numbers = [k for k, one in enumerate(part) if not one.quadratic]
        normals = np.array([[float(x) for x in part[k].linear or (0, 0, 0)] for k in numbers]).reshape(-1, 3)
        lengths = np.linalg.norm(normals, axis=1)
        bounds = np.array([float(part[k].bound) for k in numbers]) + normals @ [float(x) for x in obstacle.center]
        return cls(numbers, lengths, normals / lengths[:, None], bounds / lengths)


def _add_sums(sums: list[Sum], planes: _Planes, hulls: _Floats, length: float) -> None:
    """Add what parts of hulls need that no half-space by itself parts from the part."""
    known = np.array([_combined(planes, one) for one in sums]).reshape(-1, 4)
    for _ in range(_DEPTH):
        over = hulls @ planes.normals.T - planes.bounds
        clear = (over.min(axis=1) > length + _SLACK).any(axis=1)
        if len(known):
            clear |= (hulls @ known[:, :3].T - known[:, 3]).min(axis=1).max(axis=1) > length + _SLACK
        open_ = ~clear & (np.count_nonzero(over.max(axis=1) > 0, axis=1) > 1)  # no part of others is beyond two half-spaces
        hulls, over = hulls[open_], over[open_]
        for hull, beyond in zip(hulls, over.mean(axis=1), strict=True):
            new = _proposed(planes, np.maximum(beyond, 0.0))
            if new is None or new in sums:
                continue
            row = _combined(planes, new)
            if (hull @ row[:3] - row[3]).min() > length + _SLACK:
                sums.append(new)
                known = np.vstack([known, row])
        if not len(hulls):
            return
        hulls = _halved(hulls)


def _proposed(planes: _Planes, beyond: _Floats) -> Sum | None:
    """Return the half-spaces that a point is beyond, each weighed by how far."""
    if np.count_nonzero(beyond) < 2:
        return None
    shares = beyond / planes.lengths
    weights = np.rint(shares / shares.max() * _PARTS).astype(int)
    row = [[planes.numbers[k], int(weight)] for k, weight in enumerate(weights) if weight]
    return row if len(row) > 1 else None


def _combined(planes: _Planes, row: Sum) -> _Floats:
    """Return a sum's unit normal and bound. Shape (4,)."""
    index = [planes.numbers.index(k) for k, _ in row]
    weights = np.array([float(weight) for _, weight in row]) * planes.lengths[index]
    normal, bound = weights @ planes.normals[index], weights @ planes.bounds[index]
    return np.append(normal, bound) / np.linalg.norm(normal)


def _halved(hulls: _Floats) -> _Floats:
    """Return the corners of both halves of each. Shape (2 n, 8, 3)."""
    row, first, second = hulls, [hulls[:, 0]], [hulls[:, -1]]
    for _ in range(hulls.shape[1] - 1):
        row = (row[:, 1:] + row[:, :-1]) / 2
        first.append(row[:, 0])
        second.append(row[:, -1])
    return np.concatenate([np.stack(first, axis=1), np.stack(second[::-1], axis=1)])
