"""Boxes, upright cylinders and convex prisms, compiled to inequalities around their centres."""

from __future__ import annotations

import itertools
import math
from typing import Annotated

import numpy as np
from pydantic import Field

from verify.data.shapes.inequalities import GREATEST_RADIUS, LEAST_RADIUS, Inequality, Point
from verify.data.shapes.region_shapes import Placed, RegionShape, exact_turn
from verify.data.value import Value
from verify.data.vehicle import Number, Positive

Corner = tuple[Number, Number]

_MOST_CORNERS = 60
_STRAIGHT = 1e-9
"""m; a corner that lies nearer than this to the line between its neighbours is none."""
_GRID = 1024.0
"""A prism's centre is a multiple of 1/1024 m, so that its distances from there are written without rounding, or nearly so; a thin one's
is of a finer grid."""


class Cylinder(Value):
    """Value of the key `cylinder`."""

    radius: Positive = Field(description="m")
    height: Positive = Field(description="m, along z, half of it above the centre")


class Prism(Value):
    """Value of the key `prism`."""

    polygon: Annotated[tuple[Corner, ...], Field(min_length=3, max_length=_MOST_CORNERS)] = Field(
        description="m, corners of a convex polygon in the order in which they follow each other, world frame"
    )
    z: tuple[Number, Number] = Field(description="m, floor and ceiling, world frame")


def slab(normal: Point, low: float, high: float) -> tuple[Inequality, Inequality]:
    """Return low <= normal . x <= high.

    Args:
        normal: Of any length but zero.
        low: Lower bound.
        high: Upper bound.
    """
    opposite = (-normal[0], -normal[1], -normal[2])
    return Inequality(linear=normal, bound=high), Inequality(linear=opposite, bound=-low)


def box(size: tuple[float, float, float], yaw: float) -> list[list[Inequality]]:
    """Return the body of a box around the origin.

    Args:
        size: m, full lengths along the box's own x, y, z.
        yaw: rad, turns it about z.

    Raises:
        ValueError: A length is absurd.
    """
    _require_lengths("size", [x / 2 for x in size], size)
    cos, sin = exact_turn(yaw)
    x, y, z = (length / 2 for length in size)
    return [[*slab((cos, sin, 0.0), -x, x), *slab((-sin, cos, 0.0), -y, y), *slab((0.0, 0.0, 1.0), -z, z)]]


def cylinder(given: Cylinder, yaw: float) -> list[list[Inequality]]:  # noqa: ARG001  # turned it is the same
    """Return the body of an upright cylinder around the origin.

    Args:
        given: Radius and height.
        yaw: Does not matter.

    Raises:
        ValueError: A length is absurd.
    """
    _require_lengths("cylinder", [given.radius, given.height / 2], (given.radius, given.height))
    form = 1.0 / (given.radius * given.radius)
    round_wall = Inequality(quadratic=((form, 0.0, 0.0), (0.0, form, 0.0), (0.0, 0.0, 0.0)))
    return [[round_wall, *slab((0.0, 0.0, 1.0), -given.height / 2, given.height / 2)]]


def prism(given: Prism, yaw: float) -> Placed:  # noqa: ARG001  # it takes none
    """Return where a prism is: around the deepest point of its polygon, halfway up.

    Args:
        given: Polygon, floor and ceiling.
        yaw: 0.

    Raises:
        ValueError: The polygon is not convex, crosses itself, is flat or has a corner twice; or a coordinate is absurd.
    """
    low, high = given.z
    if not all(abs(x) <= GREATEST_RADIUS for x in itertools.chain(given.z, *given.polygon)):
        raise ValueError(f"coordinates must lie between -{GREATEST_RADIUS:g} m and {GREATEST_RADIUS:g} m")
    if high - low < 2 * LEAST_RADIUS:
        raise ValueError(f"z: the ceiling {high:g} m must lie above the floor {low:g} m; write `z: [low, high]`")
    corners = convex_polygon(given.polygon)
    normals = _edges(corners)
    center = _on_grid((*_deepest(corners), (low + high) / 2), normals, corners, high - low)
    faces = [
        Inequality(linear=(nx, ny, 0.0), bound=nx * (x - center[0]) + ny * (y - center[1]))
        for (nx, ny), (x, y) in zip(normals, corners, strict=True)
    ]
    return Placed((center[0], center[1], center[2]), [[*faces, *slab((0.0, 0.0, 1.0), low - center[2], high - center[2])]])


def _on_grid(middle: Point, normals: list[Corner], corners: list[Corner], height: float) -> Point:
    """Return a point near the deepest one, on the coarsest grid that has one nearly as deep."""

    def depth(point: tuple[float, ...]) -> float:
        sides = (nx * (x - point[0]) + ny * (y - point[1]) for (nx, ny), (x, y) in zip(normals, corners, strict=True))
        return min(*sides, height / 2 - abs(point[2] - middle[2]))

    for grid in (_GRID, _GRID**2):
        x, y, z = (round(x * grid) / grid for x in middle)
        if depth((x, y, z)) >= depth(middle) / 2:
            return x, y, z
    return middle


def convex_polygon(corners: tuple[Corner, ...]) -> list[Corner]:
    """Return a convex polygon's corners counterclockwise, without those that lie on an edge.

    Args:
        corners: m, in either direction. Shape (corners, 2).

    Raises:
        ValueError: The polygon is not convex, crosses itself, is flat or has a corner twice.
    """
    for (i, a), (j, b) in itertools.combinations(enumerate(corners), 2):
        if math.dist(a, b) <= _STRAIGHT:
            last = " (a polygon closes by itself; leave the last corner out)" if (i, j) == (0, len(corners) - 1) else ""
            raise ValueError(f"polygon: corner {_shown(a)} stands there twice, as number {i + 1} and {j + 1}{last}")
    count = len(corners)
    for i, j in itertools.combinations(range(count), 2):
        if (j - i) % count in (1, count - 1):
            continue
        if _cross_each_other(corners[i], corners[(i + 1) % count], corners[j], corners[(j + 1) % count]):
            raise ValueError(
                f"polygon: the edge after {_shown(corners[i])} crosses the edge after {_shown(corners[j])}; give the corners in the order "
                "in which they follow each other around it"
            )
    area = sum(a[0] * b[1] - a[1] * b[0] for a, b in itertools.pairwise([*corners, corners[0]])) / 2
    ordered = list(corners) if area > 0 else list(reversed(corners))
    kept, heights = list(ordered), _heights(ordered)
    while min(map(abs, heights)) <= _STRAIGHT:
        del kept[min(range(len(kept)), key=lambda i: abs(heights[i]))]
        if len(kept) < 3:
            raise ValueError("polygon: its corners lie on a line, so that it is flat")
        heights = _heights(kept)
    for i, height in enumerate(heights):
        if height < 0:
            raise ValueError(
                f"polygon: not convex, it turns inwards at {_shown(kept[i])}; split it there into convex prisms, and give them as a `union`"
            )
    return kept


def _require_lengths(key: str, halves: list[float], given: tuple[float, ...]) -> None:
    if not all(LEAST_RADIUS <= half <= GREATEST_RADIUS for half in halves):
        raise ValueError(f"{key}: lengths {list(given)} must lie between {2 * LEAST_RADIUS:g} m and {2 * GREATEST_RADIUS:g} m")


def _edges(corners: list[Corner]) -> list[Corner]:
    """Return the outward unit normal of the edge that begins at each corner; edges that are walked the other way have the opposite one."""
    normals: list[Corner] = []
    for a, b in itertools.pairwise([*corners, corners[0]]):
        along = (b[0] - a[0], b[1] - a[1])
        length = math.hypot(*along)
        normals.append((along[1] / length, -along[0] / length))
    return normals


def _deepest(corners: list[Corner]) -> Corner:
    """Return the point that is farthest from all edges, the middle of those where there are several."""
    normals = np.array(_edges(corners))
    bounds = np.einsum("ni,ni->n", normals, np.array(corners))
    triples = np.array(list(itertools.combinations(range(len(corners)), 3)))
    sides = np.concatenate([normals[triples], np.ones((len(triples), 3, 1))], axis=2)
    regular = np.abs(np.linalg.det(sides)) > 1e-12
    points = np.linalg.solve(sides[regular], bounds[triples[regular]][..., None])[..., 0]
    depth = np.min(bounds - points[:, :2] @ normals.T, axis=1)
    best = points[depth >= depth.max() * (1 - 1e-9), :2].mean(axis=0)
    return float(best[0]), float(best[1])


def _heights(corners: list[Corner]) -> list[float]:
    """Return how far each corner lies outside the line between its neighbours, in m; below zero where the polygon turns inwards."""
    heights: list[float] = []
    for k, corner in enumerate(corners):
        before, after = corners[k - 1], corners[(k + 1) % len(corners)]
        along = (after[0] - before[0], after[1] - before[1])
        cross = along[0] * (corner[1] - before[1]) - along[1] * (corner[0] - before[0])
        heights.append(-cross / max(math.hypot(*along), 1e-300))
    return heights


def _cross_each_other(a: Corner, b: Corner, c: Corner, d: Corner) -> bool:
    def side(p: Corner, q: Corner, r: Corner) -> float:
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    return side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0


def _shown(corner: Corner) -> str:
    return f"[{corner[0]:g}, {corner[1]:g}]"


BOX = RegionShape(
    schema=tuple[Positive, Positive, Positive], compiled=box, meaning="m, full lengths along the region's own x, y, z"
)
CYLINDER = RegionShape(schema=Cylinder, compiled=cylinder, meaning="`radius` and `height` in m, upright")
PRISM = RegionShape(
    schema=Prism,
    compiled=prism,
    meaning="`polygon`, corners [x, y] of a convex polygon, and `z: [low, high]`, in m in the world's frame",
    places_itself=True,
)
