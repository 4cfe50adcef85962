"""How far points are from bodies, by school geometry: closed forms that share nothing with the judge's."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

Floats = np.ndarray


def distances(shape: dict[str, Any], points: Floats) -> Floats:
    """Return how far points are from a body as a mission file writes it; 0 inside. Shape (n, 3) to (n,)."""
    if "union" in shape:
        return np.min([distances(member, points) for member in shape["union"]], axis=0)
    if "prism" in shape:
        return _from_prism(np.array(shape["prism"]["polygon"]), shape["prism"]["z"], points)
    own = _own(shape, points)
    if "size" in shape:
        return np.linalg.norm(np.maximum(np.abs(own) - np.array(shape["size"]) / 2, 0.0), axis=1)
    if "cylinder" in shape:
        beside = np.hypot(own[:, 0], own[:, 1]) - shape["cylinder"]["radius"]
        return np.hypot(np.maximum(beside, 0.0), np.maximum(np.abs(own[:, 2]) - shape["cylinder"]["height"] / 2, 0.0))
    return _from_ellipsoid(np.array(shape["radii"]), own)


def _own(shape: dict[str, Any], points: Floats) -> Floats:
    yaw = math.radians(shape.get("yaw_deg", 0.0))
    x, y, z = (points - np.array(shape["center"])).T
    return np.stack([math.cos(yaw) * x + math.sin(yaw) * y, math.cos(yaw) * y - math.sin(yaw) * x, z], axis=1)


def _from_prism(polygon: Floats, height: list[float], points: Floats) -> Floats:
    flat, beside, inside = points[:, :2], np.full(len(points), np.inf), np.ones(len(points), dtype=bool)
    turn = np.sign(np.sum(polygon[:, 0] * np.roll(polygon[:, 1], -1) - polygon[:, 1] * np.roll(polygon[:, 0], -1)))
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        along = b - a
        share = np.clip((flat - a) @ along / (along @ along), 0.0, 1.0)
        beside = np.minimum(beside, np.linalg.norm(flat - a - share[:, None] * along, axis=1))
        inside &= turn * (along[0] * (flat[:, 1] - a[1]) - along[1] * (flat[:, 0] - a[0])) >= 0
    above = np.maximum(np.maximum(points[:, 2] - height[1], height[0] - points[:, 2]), 0.0)
    return np.hypot(np.where(inside, 0.0, beside), above)


def _from_ellipsoid(radii: Floats, own: Floats) -> Floats:
    """Bisect for s with sum (a x / (a^2 + s))^2 = 1, as textbooks do."""
    low, high = np.zeros(len(own)), np.linalg.norm(own, axis=1) * radii.max() + 1.0
    for _ in range(80):
        middle = (low + high) / 2
        out = np.sum((radii * own / (radii**2 + middle[:, None])) ** 2, axis=1) > 1.0
        low, high = np.where(out, middle, low), np.where(out, high, middle)
    nearest = radii**2 * own / (radii**2 + high[:, None])
    return np.where(np.sum((own / radii) ** 2, axis=1) <= 1.0, 0.0, np.linalg.norm(own - nearest, axis=1))
