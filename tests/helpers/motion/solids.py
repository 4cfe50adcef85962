"""Bodies by school geometry, for tests of the judge: drawn at random, each with a function that tells which points it holds."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

Holds = Callable[[np.ndarray], np.ndarray]
"""How far inside points are, roughly, in m; not below zero in the body. Shape (n, 3) to (n,)."""


def box(center: np.ndarray, size: np.ndarray, yaw_deg: float) -> tuple[dict[str, Any], Holds]:
    cos, sin = math.cos(math.radians(yaw_deg)), math.sin(math.radians(yaw_deg))

    def holds(points: np.ndarray) -> np.ndarray:
        x, y, z = (points - center).T
        own = np.stack([cos * x + sin * y, -sin * x + cos * y, z], axis=1)
        return (size / 2 - np.abs(own)).min(axis=1)

    return {"center": center.tolist(), "size": size.tolist(), "yaw_deg": yaw_deg}, holds


def cylinder(center: np.ndarray, radius: float, height: float) -> tuple[dict[str, Any], Holds]:
    def holds(points: np.ndarray) -> np.ndarray:
        x, y, z = (points - center).T
        return np.minimum(radius - np.hypot(x, y), height / 2 - np.abs(z))

    return {"center": center.tolist(), "cylinder": {"radius": radius, "height": height}}, holds


def prism(polygon: np.ndarray, low: float, high: float) -> tuple[dict[str, Any], Holds]:
    """A polygon counterclockwise."""

    def holds(points: np.ndarray) -> np.ndarray:
        depth = np.minimum(points[:, 2] - low, high - points[:, 2])
        for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
            side = (b[0] - a[0]) * (points[:, 1] - a[1]) - (b[1] - a[1]) * (points[:, 0] - a[0])
            depth = np.minimum(depth, side / np.hypot(*(b - a)))
        return depth

    return {"prism": {"polygon": polygon.tolist(), "z": [low, high]}}, holds


def ellipsoid(center: np.ndarray, radii: np.ndarray, yaw_deg: float) -> tuple[dict[str, Any], Holds]:
    cos, sin = math.cos(math.radians(yaw_deg)), math.sin(math.radians(yaw_deg))

    def holds(points: np.ndarray) -> np.ndarray:
        x, y, z = (points - center).T
        own = np.stack([cos * x + sin * y, -sin * x + cos * y, z], axis=1)
        return (1 - np.linalg.norm(own / radii, axis=1)) * radii.min()

    return {"center": center.tolist(), "radii": radii.tolist(), "yaw_deg": yaw_deg}, holds


def union(*members: tuple[dict[str, Any], Holds]) -> tuple[dict[str, Any], Holds]:
    return {"union": [data for data, _ in members]}, lambda points: np.max([holds(points) for _, holds in members], axis=0)


def random_polygon(rng: np.random.Generator, middle: np.ndarray, size: float) -> np.ndarray:
    """Corners on a circle, so that it is convex."""
    while True:
        angles = np.sort(rng.uniform(0, 2 * np.pi, int(rng.integers(3, 8))))
        if np.diff(angles, append=angles[0] + 2 * np.pi).min() > 0.2:
            return middle + size * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def random_solid(rng: np.random.Generator, *, unions: bool = True) -> tuple[dict[str, Any], Holds]:
    """A body of any shape near (0, 0, 1), of some decimetres."""
    center = np.round(rng.normal(size=3) * [0.5, 0.5, 0.3] + [0.0, 0.0, 1.0], 3)
    yaw = float(rng.choice([0.0, 30.0, -71.3, 90.0]))
    kind = int(rng.integers(0, 6 if unions else 4))
    if kind == 0:
        return box(center, np.round(rng.uniform(0.2, 1.5, 3), 3), yaw)
    if kind == 1:
        return cylinder(center, float(rng.uniform(0.1, 0.7)), float(rng.uniform(0.2, 1.0)))
    if kind == 2:
        return prism(random_polygon(rng, center[:2], rng.uniform(0.2, 0.8)), center[2] - 0.3, center[2] + rng.uniform(0.0, 0.5))
    if kind == 3:
        return ellipsoid(center, rng.uniform(0.1, 0.8, 3), yaw)
    if kind == 4:  # a box and its neighbour across a wall
        first = np.round(rng.uniform(0.3, 0.9, 3), 2)
        second = np.array([np.round(rng.uniform(0.3, 0.9), 2), first[1] * rng.choice([1.0, 0.6]), first[2]])
        beside = center + np.array([(first[0] + second[0]) / 2, 0.0, 0.0])
        return union(box(center, first, 0.0), box(beside, second, 0.0))
    return union(*(random_solid(rng, unions=False) for _ in range(int(rng.integers(2, 4)))))
