"""How far from a hoop's axis a passage may be: inside the opening, and while it is there inside the hoop's region, both by the margin."""

from __future__ import annotations

import numpy as np

from verify.data.shapes.region import Hoop

_ANGLES = np.arange(64) * (np.pi / 32)
_AHEAD = 1e-3
"""m before and behind the margin on which a passage is looked at as well."""


def room_in_opening(hoop: Hoop, radius: float, margin: float) -> float:
    """Return how far from the axis a vehicle's centre may be for its sphere to pass the opening, in m; not positive without room.

    Args:
        hoop: The hoop.
        radius: The vehicle's, m.
        margin: delta, m.
    """
    return hoop.opening - margin - radius


def room_in_region(hoop: Hoop, margin: float) -> float:
    """Return how far from the axis a point may be to be in the hoop's region by the margin as long as the opening is near.

    That is within the margin of the hoop's plane: a passage belongs to the visit of the region, which must contain it.

    Returns:
        m; 0 where not even the axis is far enough inside.
    """
    normal, shape = np.array(hoop.normal), hoop.shape
    inside = 1.0 - margin / hoop.inner_radius
    if inside <= 0.0:
        return 0.0
    left = np.cross([0.0, 0.0, 1.0], normal)
    left /= np.linalg.norm(left)
    across = np.cos(_ANGLES)[:, None] * left + np.sin(_ANGLES)[:, None] * np.cross(normal, left)
    ahead = margin + _AHEAD
    square = np.einsum("ai,ij,aj->a", across, shape, across)  # of p in the region's quadratic form at (ahead, p)
    linear = ahead * (across @ shape @ normal)
    rest = float(ahead**2 * (normal @ shape @ normal) - inside**2)
    if rest >= 0.0:
        return 0.0
    return float(np.min((-linear + np.sqrt(linear**2 - square * rest)) / square))
