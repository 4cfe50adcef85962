"""A way around what stands between two points: around one body at a time, or where that does not get through, over a roadmap."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from refine.legs import Stop, refused, show
from refine.obstacles import Obstacle
from refine.roadmap import way_around

Floats = NDArray[np.float64]

_DEPTH = 3
_ANGLES = np.arange(16) * (np.pi / 8)
_BESIDE = 0.05
"""m by which a detour passes clear of what it goes around."""


def detour(
    name: str, a: Floats, b: Floats, obstacles: tuple[Obstacle, ...], low: Floats, high: Floats, *, to: Stop
) -> list[Floats]:
    """Return points to put between two others so that straight lines meet no obstacle.

    Raises:
        Infeasible: None were found; names the robot, the body in the way and the stop that it was on its way to.
    """
    blocked = blocking(a, b, obstacles)
    if blocked is None:
        return []
    found = _around(a, b, obstacles, low, high, _DEPTH)
    if found is None:
        found = way_around(a, b, obstacles, low, high)
    if found is None:
        raise refused(
            "visits",
            name,
            to,
            f"{name}: '{blocked.name}' is in the way from {show(a)} to {show(b)}, and no way around was found.",
        )
    return found


def blocking(a: Floats, b: Floats, obstacles: tuple[Obstacle, ...]) -> Obstacle | None:
    """Return the first body that a straight leg meets."""
    return next((body for body in obstacles if body.plane(a, b) is None), None)


def _around(
    a: Floats, b: Floats, obstacles: tuple[Obstacle, ...], low: Floats, high: Floats, depth: int
) -> list[Floats] | None:
    """Return via points from a to b, the shortest of the sides that work first; None where none does."""
    body = blocking(a, b, obstacles)
    if body is None:
        return []
    if depth == 0:
        return None
    step = (b - a) / max(float(np.linalg.norm(b - a)), 1e-9)
    foot = a + np.clip((body.centre - a) @ step, 0.0, np.linalg.norm(b - a)) * step
    first = np.cross(step, [0.0, 0.0, 1.0] if abs(step[2]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    second = np.cross(step, first)
    sides = np.cos(_ANGLES)[:, None] * first + np.sin(_ANGLES)[:, None] * second
    reach = np.arange(1, 61) * 0.05
    options: list[tuple[float, int, Floats]] = []
    for index, side in enumerate(sides):
        line = foot + reach[:, None] * side
        clear = np.all((line >= low) & (line <= high), axis=1)
        for other in obstacles:
            clear &= other.clearance(line) >= _BESIDE
        if clear.any():
            via = line[int(np.argmax(clear))]
            options.append((float(np.linalg.norm(via - a) + np.linalg.norm(b - via)), index, via))
    for _, _, via in sorted(options, key=lambda option: option[:2])[:6]:
        before = _around(a, via, obstacles, low, high, depth - 1)
        after = None if before is None else _around(via, b, obstacles, low, high, depth - 1)
        if before is not None and after is not None:
            return [*before, via, *after]
    return None
