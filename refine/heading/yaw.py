"""Heading along a flight: fixed, along the path, or towards a point. Angles are unwrapped, so nothing jumps at +-pi."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from refine.heading.least_squares import bases, fitted
from refine.spline.basis import ORDER
from refine.spline.spline import Spline

Floats = NDArray[np.float64]

Heading = Literal["fixed", "path"] | tuple[float, float, float]

_SLOW = 0.05
"""m/s of horizontal speed below which the path has no direction; the last one is kept."""
_NEAR = 0.05
"""m of horizontal distance below which a point has no direction."""
_SAMPLES = 33
CORNER = 0.1
"""Share of a mean leg's duration over which the heading turns a corner."""


def heading_spline(
    path: Spline,
    heading: Heading,
    start: float,
    *,
    cycle: int | None = None,
    rest: frozenset[int] = frozenset(),
    corner: float = CORNER,
) -> Spline | None:
    """Return yaw over a flight; None where it is 0 throughout.

    Args:
        path: Three axes.
        heading: How to look.
        start: Yaw at the start, rad; kept for ever where heading is "fixed".
        cycle: Node where the cycle begins; the last node repeats its heading, perhaps full circles further.
        rest: Nodes at which the heading rests too, so that the vehicle may hover there.
        corner: Share of a mean leg's duration over which the heading turns a corner.
    """
    if heading == "fixed":
        constant = np.zeros((len(path) + 1, ORDER, 1))
        constant[:, 0] = start
        return Spline(path.durations, constant) if start else None
    at = np.linspace(0.0, 1.0, _SAMPLES)
    wanted = _directions(path, heading, start, at)
    nodes = len(path) + 1
    given = np.zeros((nodes, ORDER))
    free = np.ones((nodes, ORDER), dtype=bool)
    given[0, 0], free[0] = start, False
    free[[-1, *rest], 1:] = False
    if cycle is not None:  # a lap may turn the vehicle full circles: the heading is the same, its number is not
        given[cycle, 0] = start if cycle == 0 else wanted[cycle - 1, -1]
        given[-1, 0] = given[cycle, 0] + _nearest_turn(wanted[-1, -1] - given[cycle, 0])
        free[cycle], free[-1] = False, False
    values, _, accelerations = bases(path, at)
    still = corner * path.durations.mean()  # corners are rounded over about this time
    matrix = np.concatenate([values, still**2 * accelerations])
    aims = np.concatenate([wanted.ravel(), np.zeros(len(values))]) - matrix @ given.ravel()
    states = given + fitted(path, matrix, aims, free, np.ones(len(aims))).reshape(nodes, ORDER)
    return Spline(path.durations, states[:, :, None])


def _directions(path: Spline, heading: Heading, start: float, at: Floats) -> Floats:
    """Return the wanted yaw at samples, unwrapped, led over from the start's on the first leg. Shape (pieces, samples)."""
    if heading == "path":
        vector, least = path.sample(at, 1)[..., :2].reshape(-1, 2), _SLOW
    else:
        vector, least = np.array(heading[:2], dtype=np.float64) - path.sample(at)[..., :2].reshape(-1, 2), _NEAR
    clear = np.linalg.norm(vector, axis=1) > least
    if not clear.any():
        return np.full((len(path), len(at)), start)
    angles = np.unwrap(np.arctan2(vector[clear, 1], vector[clear, 0]))
    angles += _nearest_turn(start - angles[0])
    wanted = angles[np.maximum(np.cumsum(clear) - 1, 0)].reshape(len(path), len(at))
    lead = at**3 * (10 - 15 * at + 6 * at**2)
    wanted[0] = start + lead * (wanted[0] - start)
    return wanted


def _nearest_turn(angle: float) -> float:
    return 2 * np.pi * round(angle / (2 * np.pi))
