"""Heading along a flight: fixed, along the path, or towards a point. Angles are unwrapped, so nothing jumps at +-pi."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from refine.minimum_snap import minimum_snap
from refine.spline import Spline

Floats = NDArray[np.float64]

Heading = Literal["fixed", "path"] | tuple[float, float, float]

_SLOW = 0.05
"""m/s of horizontal speed below which the path has no direction; the last one is kept."""
_NEAR = 0.05
"""m of horizontal distance below which a point has no direction."""
_SAMPLES = 33


def heading_spline(path: Spline, heading: Heading, start: float, *, cycle: int | None = None) -> Spline | None:
    """Return yaw over a flight; None where it is constant.

    Args:
        path: Three axes.
        heading: How to look.
        start: Yaw at the start, rad; kept for ever where heading is "fixed".
        cycle: Node where the cycle begins; the last node repeats its heading, perhaps full circles further.
    """
    if heading == "fixed":
        return None
    wanted = _directions(path, heading, start)
    turned = np.unwrap(wanted)
    nodes = turned[:: _SAMPLES - 1].copy()
    nodes[1:] += _nearest_turn(start - nodes[1])  # turn there from the start's heading on the first leg
    nodes[0] = start
    if cycle is not None:  # a lap may turn the vehicle full circles: the heading is the same, its number is not
        nodes[-1] = nodes[cycle] + _nearest_turn(nodes[-1] - nodes[cycle])
    rate = np.full((len(nodes), 1), np.nan)
    rate[[0, -1]] = 0.0
    if cycle is not None:
        rate[cycle] = 0.0
    return minimum_snap(nodes[:, None], path.knots, velocity=rate, acceleration=_closed(rate, cycle), jerk=_closed(rate, cycle))


def _closed(rate: Floats, cycle: int | None) -> Floats:
    values = np.full_like(rate, np.nan)
    values[[0, -1]] = 0.0
    if cycle is not None:
        values[cycle] = 0.0
    return values


def _directions(path: Spline, heading: Heading, start: float) -> Floats:
    """Return the wanted yaw at samples, wrapped or not. Shape (pieces * (samples - 1) + 1,)."""
    shares = np.linspace(0.0, 1.0, _SAMPLES)
    joined = lambda derivative: _join(path.sample(shares, derivative)[..., :2])  # noqa: E731
    if heading == "path":
        vector, least = joined(1), _SLOW
    else:
        vector, least = np.array(heading[:2], dtype=np.float64) - joined(0), _NEAR
    clear = np.linalg.norm(vector, axis=1) > least
    if not clear.any():
        return np.full(len(vector), start)
    angles = np.unwrap(np.arctan2(vector[clear, 1], vector[clear, 0]))
    angles += _nearest_turn(start - angles[0])
    index = np.maximum(np.cumsum(clear) - 1, 0)
    return angles[index]


def _join(samples: Floats) -> Floats:
    return np.concatenate([samples[:, :-1].reshape(-1, samples.shape[2]), samples[-1:, -1]])


def _nearest_turn(angle: float) -> float:
    return 2 * np.pi * round(angle / (2 * np.pi))
