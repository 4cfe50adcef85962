"""The four motion primitives of the 2019 paper (Section III-A), each with its length.

All four are seen in a hoop's own frame: x along its normal, yz across it. `dist_x` and `dist_yz` are the distances
between the current and the next control point along and across the normal, in m. A leg takes t = length / v.

  STRAIGHT  dist_yz = 0                    |dist_x|
  S_CURVE   same direction, x >  yz        2 (2 h theta), two equal tangent arcs of radius h turned by 2 theta each:
                                           rt = delta sqrt(dist_x^2 + dist_yz^2), theta = atan2(dist_yz, dist_x),
                                           h = rt / sin(theta)
  U_TURN    same direction, x <= yz        (dist_yz - dist_x) + dist_x pi/2, two quarter arcs of radius dist_x / 2
                                           joined by a straight piece
  TURN      direction changes              dist_x + dist_yz pi/2, a straight piece and a half circle

Where we differ from the print. (1) The paper has a minus under the root of S_CURVE's leg `rt`. With a minus the length
goes to zero as dist_x nears dist_yz, far below the distance itself; with a plus and delta = 1/4, `rt` is a quarter
of the distance, the two arcs really join the two points, and the length meets STRAIGHT's as dist_yz -> 0 and U_TURN's at
dist_x = dist_yz. Times follow the plus; a test compares the other formula. (2) The captions of
Fig. 3 name U_TURN and TURN the other way round than Algorithm 1 and the lengths do; we follow the algorithm. (3) TURN's
half circle lies in the plane of the two points and the normal, so its width is dist_yz (the paper's dist_y, where both
points are at one height). (4) STRAIGHT ends the choice for its segment.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from verify.data.arrays import Floats

Kind = Literal["STRAIGHT", "S_CURVE", "U_TURN", "TURN"]


DELTA = 0.25
"""S_CURVE's delta: the share of the distance that one leg of its triangle takes."""

_ALIGNED = 1e-9
"""m (m^2 for products); a control point this close to the other's axis is on it."""


@dataclass(frozen=True, slots=True)
class Primitive:
    """One segment between two control points.

    Attributes:
        kind: Which of the four.
        length: m, by the primitive's formula.
    """

    kind: Kind
    length: float

    def time(self, speed: float) -> float:
        """Return the segment's time in s at a speed in m/s (t = length / v)."""
        return self.length / speed


def straight(dist_x: float) -> float:
    """Length of a straight line along the normal: |dist_x|."""
    return abs(dist_x)


def s_curve(dist_x: float, dist_yz: float) -> float:
    """Length of two equal tangent arcs: 2 (2 h theta), with a plus under the root (see the module's note).

    Args:
        dist_x: m along the hoop's normal.
        dist_yz: m across it.
    """
    leg, theta = DELTA * math.hypot(dist_x, dist_yz), math.atan2(dist_yz, dist_x)
    h_theta = leg if theta < 1e-9 else leg / math.sin(theta) * theta
    return 2 * (2 * h_theta)


def u_turn(dist_x: float, dist_yz: float) -> float:
    """Length of two quarter arcs joined by a straight piece: (dist_yz - dist_x) + dist_x pi/2."""
    return (dist_yz - dist_x) + dist_x * math.pi / 2


def turn(dist_x: float, dist_yz: float) -> float:
    """Length of a straight piece and a half circle: dist_x + dist_yz pi/2."""
    return dist_x + dist_yz * math.pi / 2


def choose(previous: Floats | None, current: Floats, following: Floats, axes: Floats | None) -> Primitive:
    """Choose the primitive from one control point to the next (Algorithm 1, lines 13 to 25).

    Args:
        previous: The control point before the current one, m; None at the start, where no direction is changed.
        current: m. Shape (3,).
        following: The next control point, m. Shape (3,).
        axes: The hoop's own axes as columns; None where there is no hoop, and the way is straight. Shape (3, 3).
    """
    if axes is None:
        return Primitive("STRAIGHT", float(np.linalg.norm(following - current)))
    ahead, left, up = axes.T @ (following - current)
    dist_x, dist_yz = abs(float(ahead)), math.hypot(left, up)
    if dist_yz <= _ALIGNED:
        return Primitive("STRAIGHT", straight(dist_x))
    past = float(axes[:, 0] @ (current - previous)) if previous is not None else float(ahead)
    if past * ahead >= -_ALIGNED:  # across the normal is no change of direction
        if dist_x <= dist_yz:
            return Primitive("U_TURN", u_turn(dist_x, dist_yz))
        return Primitive("S_CURVE", s_curve(dist_x, dist_yz))
    return Primitive("TURN", turn(dist_x, dist_yz))
