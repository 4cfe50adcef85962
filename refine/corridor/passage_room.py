"""Greatest distance of a passage from a hoop's axis: inside the opening, and meanwhile inside the hoop's region, both by the margin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from verify.data.shapes.convex_parts import ConvexBody
from verify.data.shapes.region import Hoop

Floats = NDArray[np.float64]

_ANGLES = np.arange(64) * (np.pi / 32)
_FINE = np.arange(256) * (np.pi / 128)
_AHEAD = 1e-3
"""m before and behind the margin on which a passage is looked at as well."""
_PARALLEL = 1e-9
"""A face whose normal leaves the axis by less bounds no distance from it; nor does a quadric in a direction in which it changes by less."""


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
    normal = np.array(hoop.normal)
    left = np.cross([0.0, 0.0, 1.0], normal)
    left /= np.linalg.norm(left)
    angles = _ANGLES if hoop.is_ellipsoid else _FINE
    across = np.cos(angles)[:, None] * left + np.sin(angles)[:, None] * np.cross(normal, left)
    if not hoop.is_ellipsoid:
        return max(_room_in_body(body, normal, across, margin) for body in hoop.measures.covers)
    shape, inside = hoop.shape, 1.0 - margin / hoop.inner_radius
    if inside <= 0.0:
        return 0.0
    ahead = margin + _AHEAD
    square = np.einsum("ai,ij,aj->a", across, shape, across)  # of p in the region's quadratic form at (ahead, p)
    linear = ahead * (across @ shape @ normal)
    rest = float(ahead**2 * (normal @ shape @ normal) - inside**2)
    if rest >= 0.0:
        return 0.0
    return float(np.min((-linear + np.sqrt(linear**2 - square * rest)) / square))


def _room_in_body(body: ConvexBody, normal: Floats, across: Floats, margin: float) -> float:
    """Return the same for a convex body around the ring's centre: of a face from its distance, of a quadric from many directions."""
    ends = np.array([[margin + _AHEAD], [-margin - _AHEAD]]) * normal
    if np.min(body.depths(ends)) <= margin:
        return 0.0
    room = np.inf
    if len(body.normals):
        left = body.distances - margin - np.abs(body.normals @ normal) * (margin + _AHEAD)
        slope = np.linalg.norm(np.cross(body.normals, normal), axis=1)
        room = float(np.min(left[slope > _PARALLEL] / slope[slope > _PARALLEL], initial=np.inf))
    for matrix, centre, root, scale in zip(body.matrices, body.centres, body.roots, body.scales, strict=True):
        start = ends - centre
        square = np.einsum("ai,ij,aj->a", across, matrix, across)
        linear = np.einsum("ei,ij,aj->ea", start, matrix, across)
        rest = np.einsum("ei,ij,ej->e", start, matrix, start)[:, None] - (root - scale * margin) ** 2
        steep = square > _PARALLEL
        found = (-linear + np.sqrt(linear**2 - square * rest))[:, steep] / square[steep]
        room = min(room, float(np.min(found, initial=np.inf)))
    return room
