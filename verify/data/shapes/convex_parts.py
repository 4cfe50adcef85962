"""Convex parts of bodies as arrays of floats: how deep points lie in one, how far it reaches, where its corners and edges are.

The depth of a point is the radius of a ball around it that the part holds, or minus that of one that it does not touch; where
corners are near it may be less than the greatest. It changes by at most d within d. Nothing here is a proof.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from verify.data.arrays import Floats
from verify.data.shapes.conditions import HalfSpace, condition
from verify.data.shapes.inequalities import GREATEST_RADIUS, Inequality

_FAR = 4 * GREATEST_RADIUS


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

    def grown(self, by: float) -> ConvexBody:
        """Return it with each face and quadric moved outwards by so many m."""
        return ConvexBody(
            self.normals, self.distances + by, self.matrices, self.centres, self.roots + self.scales * by, self.scales
        )

    def reaches(self, ways: Floats, corners: Floats) -> Floats:
        """Return how far it reaches in directions, at the most.

        Args:
            ways: Directions. Shape (n, 3).
            corners: As `corners` gives them.

        Returns:
            The greatest way . point of the body, or more. Shape (n,).
        """
        reach = np.max(ways @ corners.T, axis=1)
        for matrix, centre, root in zip(self.matrices, self.centres, self.roots, strict=True):
            axes = np.flatnonzero(np.diag(matrix))
            own = ways[:, axes]
            far = root * np.sqrt(np.einsum("ni,ij,nj->n", own, np.linalg.inv(matrix[np.ix_(axes, axes)]), own))
            rest = ways.copy()
            rest[:, axes] = 0.0
            reach = np.minimum(reach, own @ centre[axes] + far + np.max(rest @ corners.T, axis=1))
        return reach

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


def outline(body: ConvexBody) -> Floats:
    """Return the corners of a polyhedron close around a convex body, for pictures: its faces, and many that touch its quadrics.

    Args:
        body: The body.

    Returns:
        m. Shape (corners, 3).
    """
    return polyhedron_corners(*faces_around(body))


def faces_around(body: ConvexBody) -> tuple[Floats, Floats]:
    """Return the faces of a polyhedron close around a convex body: its own, and many that touch its quadrics.

    Args:
        body: The body.

    Returns:
        Unit normals, and distances from the origin along them in m. Shapes (faces, 3) and (faces,).
    """
    normals, distances = [body.normals], [body.distances]
    angles = np.arange(24) * (np.pi / 12)
    for matrix, centre, root in zip(body.matrices, body.centres, body.roots, strict=True):
        axes = np.flatnonzero(np.diag(matrix))
        around = np.stack([np.cos(angles), np.sin(angles)], axis=1) if len(axes) == 2 else spread_evenly(60)[:, axes]
        if len(axes) == 1:
            around = np.array([[1.0], [-1.0]])
        ways = np.zeros((len(around), 3))
        ways[:, axes] = around
        inverse = np.linalg.inv(matrix[np.ix_(axes, axes)])
        normals.append(ways)
        distances.append(ways @ centre + root * np.sqrt(np.einsum("ni,ij,nj->n", around, inverse, around)))
    return np.concatenate(normals), np.concatenate(distances)


def spread_evenly(count: int) -> Floats:
    """Return unit vectors spread evenly. Shape (count, 3)."""
    turns = np.arange(count) + 0.5
    up = 1.0 - 2.0 * turns / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * turns
    flat = np.sqrt(1.0 - up**2)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), up], axis=1)
