"""What planning and pictures ask of a body, in floats: how deep points lie in it, how far it reaches, where its surface is.

The depth of a point is the radius of a ball around it that the body holds, or minus that of one that it does not touch; where
corners are near it may be less than the greatest. It changes by at most d within d. Nothing here is a proof.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from verify.data.errors import BadInput
from verify.data.shapes.conditions import HalfSpace, condition, covers
from verify.data.shapes.inequalities import GREATEST_RADIUS, LEAST_RADIUS, Inequality, Parts

Floats = NDArray[np.float64]

_FAR = 4 * GREATEST_RADIUS
MOST_PARTS, MOST_INEQUALITIES = 64, 64
"""A region may have so many parts, and each so many inequalities."""


@dataclass(frozen=True, eq=False, slots=True)
class ConvexBody:
    """One convex body as arrays.

    Attributes:
        normals: Unit normals of its faces. Shape (faces, 3).
        distances: Of the faces from the origin, along the normals, in m. Shape (faces,).
        matrices: Of its quadrics, in m^-2. Shape (quadrics, 3, 3).
        centres: m. Shape (quadrics, 3).
        roots: Of the quadrics' right-hand sides. Shape (quadrics,).
        scales: 1/m; by which a quadric's root changes at most. Shape (quadrics,).
    """

    normals: Floats
    distances: Floats
    matrices: Floats
    centres: Floats
    roots: Floats
    scales: Floats

    def depths(self, points: Floats) -> Floats:
        """Return how deep points lie. Shape (n, 3) to (n,)."""
        depth = np.full(len(points), np.inf)
        if len(self.normals):
            depth = np.min(self.distances - points @ self.normals.T, axis=1)
        for matrix, centre, root, scale in zip(self.matrices, self.centres, self.roots, self.scales, strict=True):
            offset = points - centre
            level = np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", offset, matrix, offset), 0.0))
            depth = np.minimum(depth, (root - level) / scale)
        return depth

    def corners(self) -> Floats:
        """Return the corners of a polyhedron around the body: its faces, and the box of each quadric. Shape (corners, 3)."""
        normals, distances = [self.normals], [self.distances]
        for matrix, centre, root in zip(self.matrices, self.centres, self.roots, strict=True):
            axes = np.flatnonzero(np.diag(matrix))
            half = root * np.sqrt(np.diag(np.linalg.inv(matrix[np.ix_(axes, axes)])))
            for sign in (1.0, -1.0):
                normals.append(sign * np.eye(3)[axes])
                distances.append(sign * centre[axes] + half)
        normals.append(np.concatenate([np.eye(3), -np.eye(3)]))
        distances.append(np.full(6, _FAR))
        return polyhedron_corners(np.concatenate(normals), np.concatenate(distances))


def polyhedron_corners(normals: Floats, distances: Floats) -> Floats:
    """Return where three faces meet within all others.

    Args:
        normals: Unit normals. Shape (n, 3).
        distances: Of the faces from the origin, m. Shape (n,).

    Returns:
        m. Shape (corners, 3).
    """
    triples = np.array(list(itertools.combinations(range(len(normals)), 3)))
    sides = normals[triples]
    regular = np.abs(np.linalg.det(sides)) > 1e-9
    triples, sides = triples[regular], sides[regular]
    points: NDArray[Any] = np.linalg.solve(sides, distances[triples][..., None])[
        ..., 0
    ]  # of any type: numpy's solve does not say which
    slack = 1e-9 * (1 + np.abs(points).max(axis=1, initial=0.0))
    return points[np.max(points @ normals.T - distances, axis=1) <= slack]


@dataclass(frozen=True, eq=False, slots=True)
class Measures:
    """A region's body around its centre.

    Attributes:
        parts: Its parts.
        covers: Convex bodies within it that are deepest somewhere: the parts, and those across shared faces.
        inner_radius: How deep the centre lies, m.
        outer_radius: No point is farther from the centre, m.
        half_lengths: Half the edges of a box around the centre, along the world's axes, that holds it, m.
        volume: Roughly, of the boxes around its parts, in m^3.
    """

    parts: tuple[ConvexBody, ...]
    covers: tuple[ConvexBody, ...]
    inner_radius: float
    outer_radius: float
    half_lengths: tuple[float, float, float]
    volume: float

    def depths(self, points: Floats) -> Floats:
        """Return how deep points, relative to the centre, lie in the body; below zero outside. Shape (..., 3) to (...)."""
        flat = points.reshape(-1, 3)
        return np.maximum.reduce([body.depths(flat) for body in self.covers]).reshape(points.shape[:-1])

    def levels(self, points: Floats) -> Floats:
        """Return a square that is at most 1 inside; its root changes by at most d over the inner radius within d. Shape (..., 3) to (...)."""
        return np.maximum(1.0 - self.depths(points) / self.inner_radius, 0.0) ** 2


def convex_body(inequalities: tuple[Inequality, ...]) -> ConvexBody:
    """Return a convex part as arrays.

    Raises:
        BadInput: An inequality is none that is understood.
    """
    normals, distances, matrices, centres, roots, scales = [], [], [], [], [], []
    for inequality in inequalities:
        found = condition(inequality)
        if isinstance(found, HalfSpace):
            length = math.hypot(*inequality.linear)
            normals.append([x / length for x in inequality.linear])
            distances.append(inequality.bound / length)
        else:
            matrices.append(inequality.quadratic)
            centres.append([float(x) for x in found.centre])
            roots.append(math.sqrt(found.square))
            scales.append(float(found.scale))
    return ConvexBody(
        np.array(normals).reshape(-1, 3),
        np.array(distances),
        np.array(matrices).reshape(-1, 3, 3),
        np.array(centres).reshape(-1, 3),
        np.array(roots),
        np.array(scales),
    )


@lru_cache(maxsize=4096)
def measures(parts: Parts) -> Measures:
    """Measure a body.

    Raises:
        BadInput: It is none that a region can be: not convex in each part, without an end, flat, too small, too large, of too many
            parts, or its centre lies outside.
    """
    if not 1 <= len(parts) <= MOST_PARTS or not all(1 <= len(part) <= MOST_INEQUALITIES for part in parts):
        raise BadInput(
            f"A region has 1 to {MOST_PARTS} parts, each of 1 to {MOST_INEQUALITIES} inequalities; this one has {len(parts)} parts, of "
            f"{', '.join(str(len(part)) for part in parts[:5])} inequalities."
        )
    bodies = tuple(convex_body(part) for part in parts)
    corners = [body.corners() for body in bodies]
    for index, found in enumerate(corners):
        which = f"Part {index + 1} of {len(parts)}" if len(parts) > 1 else "The region"
        if len(found) == 0:
            raise BadInput(f"{which} has no points: its inequalities contradict each other.")
        if not np.abs(found).max() <= GREATEST_RADIUS:
            raise BadInput(f"{which} has no end, or one farther than {GREATEST_RADIUS:g} m from its centre.")
        deep = float(bodies[index].depths(found.mean(axis=0)[None])[0])
        if not deep >= LEAST_RADIUS:
            raise BadInput(f"{which} is flat: its middle is {deep:g} m inside it, and {LEAST_RADIUS:g} m is the least.")
    around = tuple(map(convex_body, covers(parts)))
    inner = float(max(body.depths(np.zeros((1, 3)))[0] for body in around))
    if not inner >= LEAST_RADIUS:
        raise BadInput(
            f"A region's centre must lie inside it, by {LEAST_RADIUS:g} m at the least; this one's is {inner:g} m inside (below zero: outside)."
        )
    every = np.concatenate(corners)
    half = np.abs(every).max(axis=0).tolist()
    volume = sum(float(np.prod(np.ptp(found, axis=0))) for found in corners)
    return Measures(bodies, around, inner, float(np.linalg.norm(every, axis=1).max()), (half[0], half[1], half[2]), volume)
