"""Bodies that a leg of the path must stay out of, convex and with separating planes.

These are an ellipsoid (a region that the word does not allow, grown by the margin; the place where another robot hovers), a
convex part of a region of another shape, likewise, and, grown by the margin and the vehicle's radius, a ring's disc (rim and opening) and
a convex part of an obstacle (`solid_body`). A plane between a straight leg and a convex body keeps the leg's whole curve outside
once all its Bernstein points are on the far side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from refine.obstacles.gaps import Solid, solids
from refine.obstacles.inflated_bodies import InflatedBody, disc
from refine.obstacles.solid_body import SolidBody
from refine.planes import Plane, nearest_on_segment
from verify.data.shapes.convex_parts import ConvexBody
from verify.data.shapes.region import Hoop, Region

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Ball:
    """An ellipsoid as the unit ball of a metric: points with |root (r - centre)| <= 1.

    Attributes:
        name: What it stands for, in messages.
        centre: m. Shape (3,).
        root: Square root of its matrix, m^-1. Shape (3, 3).
    """

    name: str
    centre: Floats
    root: Floats

    @cached_property
    def inflated(self) -> InflatedBody:
        """Return it as ways lead around it."""
        matrix = self.root.T @ self.root
        half = np.sqrt(np.diag(np.linalg.inv(matrix)))
        corners = np.stack([self.centre - half, self.centre + half])
        convex = ConvexBody(np.zeros((0, 3)), np.zeros(0), matrix[None], self.centre[None], np.ones(1), np.ones(1))
        return InflatedBody(self.name, convex, corners[0], corners[1], corners, 0, 0.0)

    @cached_property
    def least_radius(self) -> float:
        """Its smallest half-axis in m."""
        return float(1.0 / np.linalg.norm(self.root, 2))

    @cached_property
    def reach(self) -> float:
        """Its largest half-axis in m."""
        return float(1.0 / np.linalg.norm(self.root, -2))

    def signed_distance(self, points: Floats) -> Floats:
        """Return how far points are outside, in m (a lower bound of the distance), negative inside. Shape (..., 3) to (...)."""
        return (np.linalg.norm((points - self.centre) @ self.root.T, axis=-1) - 1.0) * self.least_radius

    def meets(self, a: Floats, b: Floats) -> bool:
        """Return whether the segment a b has no plane between it and the body."""
        return self.plane(a, b) is None

    def grown(self, by: float) -> Ball:
        """Return it with its smallest half-axis longer by `by` m, the others in proportion."""
        return Ball(self.name, self.centre, self.root / (1.0 + by / self.least_radius))

    def plane(self, a: Floats, b: Floats) -> Plane | None:
        """Return a plane with the body on one side and the segment a b on the other; None where they meet."""
        start, end = self.root @ (a - self.centre), self.root @ (b - self.centre)
        nearest = _nearest_to_origin(start, end)
        distance = float(np.linalg.norm(nearest))
        if distance <= 1.0:
            return None
        normal = self.root.T @ (nearest / distance)
        size = float(np.linalg.norm(normal))
        return Plane(normal / size, float(normal @ self.centre + 1.0) / size)


@dataclass(frozen=True, eq=False)
class Disc:
    """A flat cylinder grown by a ball: all points within `growth` of it.

    Attributes:
        name: What it stands for, in messages.
        centre: m. Shape (3,).
        normal: Unit vector. Shape (3,).
        radius: m.
        half: Half its thickness, m.
        growth: m.
    """

    name: str
    centre: Floats
    normal: Floats
    radius: float
    half: float
    growth: float

    @cached_property
    def inflated(self) -> InflatedBody:
        """Return the flat cylinder around it that ways lead around."""
        return disc(self.name, self.centre, self.normal, self.radius + self.growth, self.half + self.growth)

    @property
    def reach(self) -> float:
        """Greatest distance of its points from its centre, in m."""
        return float(np.hypot(self.radius, self.half)) + self.growth

    def _nearest(self, points: Floats) -> Floats:
        """Return the nearest points of the cylinder."""
        offset = points - self.centre
        along = offset @ self.normal
        across = offset - along[..., None] * self.normal
        size = np.linalg.norm(across, axis=-1)
        shrink = np.minimum(1.0, self.radius / np.maximum(size, 1e-12))
        return self.centre + np.clip(along, -self.half, self.half)[..., None] * self.normal + across * shrink[..., None]

    def signed_distance(self, points: Floats) -> Floats:
        """Return how far points are outside, in m; -growth for points of the cylinder itself."""
        return np.linalg.norm(points - self._nearest(points), axis=-1) - self.growth

    def meets(self, a: Floats, b: Floats) -> bool:
        """Return whether the segment a b has no plane between it and the body."""
        far = float(np.linalg.norm(_nearest_to_origin(a - self.centre, b - self.centre)))
        return far <= np.hypot(self.radius, self.half) + self.growth and self.plane(a, b) is None

    def grown(self, by: float) -> Disc:
        """Return it grown by `by` m more."""
        return replace(self, growth=self.growth + by)

    def plane(self, a: Floats, b: Floats) -> Plane | None:
        """Return a plane with the body on one side and the segment a b on the other; None where they meet."""
        point = nearest_on_segment(a, b, self.signed_distance)
        nearest = self._nearest(point)
        distance = float(np.linalg.norm(point - nearest))
        if distance <= self.growth:
            return None
        normal = (point - nearest) / distance
        return Plane(normal, float(normal @ nearest) + self.growth)


@dataclass(frozen=True, eq=False)
class Part:
    """A convex part of a region, grown: faces and quadrics moved outwards.

    Attributes:
        name: What it stands for, in messages.
        centre: Of the region, m. Shape (3,).
        solid: The part, grown, around the centre.
    """

    name: str
    centre: Floats
    solid: Solid

    @cached_property
    def inflated(self) -> InflatedBody:
        """Return it as ways lead around it."""
        return InflatedBody.of(self.name, self.centre, self.solid)

    @cached_property
    def reach(self) -> float:
        """Greatest distance of its points from its centre, in m."""
        return float(np.linalg.norm(self.solid.corners, axis=1).max())

    def signed_distance(self, points: Floats) -> Floats:
        """Return how far points are outside, in m (a lower bound of the distance), negative inside. Shape (..., 3) to (...)."""
        offset = points - self.centre
        return -self.solid.body.depths(offset.reshape(-1, 3)).reshape(offset.shape[:-1])

    def meets(self, a: Floats, b: Floats) -> bool:
        """Return whether the segment a b has no plane between it and the body."""
        return self.plane(a, b) is None

    def grown(self, by: float) -> Part:
        """Return it grown by `by` m more."""
        return replace(self, solid=Solid.of(self.solid.body.grown(by)))

    def plane(self, a: Floats, b: Floats) -> Plane | None:
        """Return a plane with the body on one side and the segment a b on the other; None where they meet."""
        ends = np.stack([a, b]) - self.centre
        across = np.cross(self.solid.edges, b - a) if len(self.solid.edges) else np.zeros((0, 3))
        sizes = np.linalg.norm(across, axis=1)
        ways = across[sizes > 1e-9] / sizes[sizes > 1e-9, None]
        gap, normal = self.solid.beside(ends, np.concatenate([ways, -ways]))
        if gap <= 0.0:
            return None
        return Plane(normal, float(np.min(ends @ normal)) - gap + float(normal @ self.centre))


@dataclass(frozen=True, eq=False)
class Parts:
    """A region of several parts, grown.

    Attributes:
        name: What it stands for, in messages.
        centre: m. Shape (3,).
        parts: Each convex.
    """

    name: str
    centre: Floats
    parts: tuple[Part, ...]

    @cached_property
    def reach(self) -> float:
        """Greatest distance of its points from its centre, in m."""
        return max(part.reach for part in self.parts)

    def signed_distance(self, points: Floats) -> Floats:
        """Return how far points are outside, in m (a lower bound of the distance), negative inside. Shape (..., 3) to (...)."""
        return np.min([part.signed_distance(points) for part in self.parts], axis=0)

    def meets(self, a: Floats, b: Floats) -> bool:
        """Return whether the segment a b has no plane between it and one of the parts."""
        return any(part.meets(a, b) for part in self.parts)

    def grown(self, by: float) -> Parts:
        """Return it grown by `by` m more."""
        return replace(self, parts=tuple(part.grown(by) for part in self.parts))


Obstacle = Ball | Disc | Part | SolidBody
GrownRegion = Ball | Part | Parts


def convex_parts(body: GrownRegion | Disc | SolidBody) -> tuple[Obstacle, ...]:
    """Return the convex bodies that a region or ring is made of: each has a plane of its own."""
    return body.parts if isinstance(body, Parts) else (body,)


def grown_region(name: str, region: Region, margin: float) -> GrownRegion:
    """Return the body outside of which a point cannot be in the region within `margin`.

    Args:
        name: What it is called in messages.
        region: Of any shape; an ellipsoid is scaled by 1 + margin / its least radius.
        margin: m.
    """
    if region.is_ellipsoid:
        return grown_ellipsoid(name, region, margin)
    centre = np.array(region.center)
    parts = tuple(Part(name, centre, solid) for solid in solids(region.body, margin))
    return parts[0] if len(parts) == 1 else Parts(name, centre, parts)


def grown_ellipsoid(name: str, region: Region, margin: float) -> Ball:
    """Return an ellipsoid scaled by 1 + margin / its least radius.

    Args:
        name: What it is called in messages.
        region: An ellipsoid.
        margin: m.
    """
    scale = 1.0 + margin / region.inner_radius
    values, vectors = np.linalg.eigh(region.shape)
    root = (vectors * np.sqrt(values)) @ vectors.T / scale
    return Ball(name, np.array(region.center), root)


def ring(name: str, hoop: Hoop, margin: float) -> Disc:
    """Return rim and opening of a hoop that is not being flown through, grown by `margin`.

    Args:
        name: The hoop's.
        hoop: Its centre, normal, opening and rim.
        margin: m.
    """
    return Disc(f"ring of {name}", np.array(hoop.center), np.array(hoop.normal), hoop.opening + hoop.rim, hoop.rim / 2, margin)


def opening(name: str, hoop: Hoop, margin: float) -> Disc:
    """Return the opening of a hoop, grown by `margin`.

    Args:
        name: The hoop's.
        hoop: Its centre, normal and opening.
        margin: m.
    """
    return Disc(f"opening of {name}", np.array(hoop.center), np.array(hoop.normal), hoop.opening, 0.0, margin)


def keep_out(name: str, point: Floats, distance: float, z_scale: float) -> Ball:
    """Return the place where another robot hovers: `distance` around it, with z counted `z_scale` times.

    Args:
        name: What it is called in messages.
        point: m. Shape (3,).
        distance: m.
        z_scale: Distances in z count this many times.
    """
    return Ball(name, np.array(point), np.diag([1.0, 1.0, z_scale]) / distance)


def blocking(a: Floats, b: Floats, obstacles: tuple[Obstacle, ...]) -> Obstacle | None:
    """Return the first body that a straight leg meets.

    Args:
        a: Start of the leg, m. Shape (3,).
        b: Its end.
        obstacles: Bodies, in the order in which they are looked at.
    """
    near = within(obstacles, np.minimum(a, b), np.maximum(a, b))
    return next((obstacles[index] for index in near if obstacles[index].meets(a, b)), None)


def within(obstacles: tuple[Obstacle | Parts, ...], low: Floats, high: Floats) -> list[int]:
    """Return which bodies may reach into a box, by their number: of a thousand bodies few are near.

    Args:
        obstacles: The bodies.
        low: Lower corner of the box, m. Shape (3,).
        high: Upper corner.
    """
    centres, reaches, halves = _extents(obstacles)
    beside = np.maximum(np.maximum(low - centres, centres - high), 0.0)
    near = np.einsum("ik,ik->i", beside, beside) <= reaches**2
    if halves is not None:
        near &= np.all(beside <= halves, axis=1)
    return np.flatnonzero(near).tolist()


@lru_cache(maxsize=256)
def _extents(obstacles: tuple[Obstacle | Parts, ...]) -> tuple[Floats, Floats, Floats | None]:
    """Return the bodies' centres, how far they reach from there and, where there are solid ones, half the edges of boxes, m.

    Shapes (bodies, 3), (bodies,), (bodies, 3).
    """
    centres = np.array([body.centre for body in obstacles]).reshape(-1, 3)
    reaches = np.array([body.reach * (1 + 1e-9) + 1e-9 for body in obstacles])
    boxes = {index: body.half_lengths for index, body in enumerate(obstacles) if isinstance(body, SolidBody)}
    if not boxes:
        return centres, reaches, None
    halves = np.repeat(reaches[:, None], 3, axis=1)
    halves[list(boxes)] = np.array(list(boxes.values())) * (1 + 1e-9) + 1e-9
    return centres, reaches, halves


def _nearest_to_origin(a: Floats, b: Floats) -> Floats:
    """Return the segment's point nearest to the origin."""
    step = b - a
    square = float(step @ step)
    share = 0.0 if square == 0.0 else float(np.clip(-(a @ step) / square, 0.0, 1.0))
    return a + share * step
