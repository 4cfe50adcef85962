"""What is proved of points beside parts of obstacles, held against exact distances to the last bit."""

from fractions import Fraction

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.motion.solid_distances import distances
from tests.helpers.motion.solids import random_solid
from verify.data.shapes.conditions import HalfSpace, condition
from verify.data.shapes.nearest import surface_of
from verify.data.shapes.obstacle import Obstacle
from verify.data.shapes.solid_parts import solid_parts
from verify.motion.obstacles.bodies import SolidBodies
from verify.motion.obstacles.half_spaces import Hulls

SHAPES = {
    "box": {"center": [0.1, -0.2, 1.0], "size": [0.7, 0.3, 0.5], "yaw_deg": 33.0},
    "far part": {
        "union": [
            {"center": [0.0, 0.0, 1.0], "size": [3.0, 3.0, 3.0]},
            {"center": [7.3, 2.1, 0.9], "size": [0.7, 0.3, 0.5], "yaw_deg": 12.0},
        ]
    },
    "prism": {"prism": {"polygon": [[0, 0], [1, 0.1], [0.9, 0.8], [0.2, 0.7]], "z": [0.31, 0.77]}},
    "many faces": {"prism": {"polygon": [[np.cos(a), np.sin(a)] for a in 2 * np.pi * np.arange(16) / 16], "z": [0.31, 0.77]}},
}


@few_of(2, "name", SHAPES)
def test_nothing_is_proved_beyond_the_exact_distance_of_a_face(name: str) -> None:
    rng = np.random.default_rng(3)
    *_, part = solid_parts({"o": Obstacle.model_validate(SHAPES[name])}, {})
    bodies, surface, center = SolidBodies((part,)), surface_of(part.inequalities), np.array(part.center)
    middle = center + surface.corners.mean(axis=0)
    points = middle + 0.7 * rng.normal(size=(3000, 3))
    with np.errstate(all="ignore"):
        low, near = bodies.distances(np.zeros(len(points), dtype=np.intp), Hulls.points(points), points)
    over = (points - center) @ surface.body.normals.T - surface.body.distances
    best = np.argmax(over, axis=1)
    on_face = points - center - over.max(axis=1)[:, None] * surface.body.normals[best]
    away = on_face @ surface.body.normals.T - surface.body.distances
    away[np.arange(len(points)), best] = -1.0
    chosen = np.flatnonzero((over.max(axis=1) > 0) & (away.max(axis=1) < -1e-3))
    assert len(chosen) > 200
    faces = [one for one in map(condition, part.inequalities) if isinstance(one, HalfSpace)]
    for k in chosen.tolist():
        face = faces[int(best[k])]
        offset = [Fraction(x) - Fraction(c) for x, c in zip(points[k].tolist(), part.center, strict=True)]
        value = sum((n * x for n, x in zip(face.normal, offset, strict=True)), Fraction(0)) - face.bound
        square = value * value / sum(n * n for n in face.normal)
        assert Fraction(float(low[k])) ** 2 <= square
        assert low[k] == pytest.approx(float(square) ** 0.5, abs=1e-13)
        assert near[k] == pytest.approx(low[k], abs=1e-13)


def test_boxes_are_told_apart_by_what_holds_them() -> None:
    """Boxes of any size beside all parts: never farther than the nearest of their points, and close to that."""
    rng = np.random.default_rng(4)
    shapes = {
        "a": {"center": [0, 0, 1], "size": [0.4, 0.6, 0.5], "yaw_deg": 20},
        "b": {"center": [2, 0, 1], "cylinder": {"radius": 0.3, "height": 1.0}},
        "c": {"center": [0, 2, 1], "radii": [0.3, 0.2, 0.5]},
    }
    parts = solid_parts({name: Obstacle.model_validate(shape) for name, shape in shapes.items()}, {})
    bodies = SolidBodies(parts)
    low = rng.uniform(-2, 3, (60, 3))
    high = low + rng.uniform(0, 0.5, (60, 3))
    beyond = bodies.outlines.beyond(low, high)
    for k in range(60):
        inside = rng.uniform(low[k], high[k], (400, 3))
        for column, part in enumerate(parts):
            least = part.distances(inside).min()
            assert beyond[k, column] <= least + 1e-12
            assert beyond[k, column] >= 0.4 * least - 0.6
            assert bodies.outlines.beyond_one(low[[k]], high[[k]], np.array([column])) == beyond[k, column]


def test_boxes_around_parts_hold_them_and_little_more() -> None:
    """Of any shape and size, oblique and sharp ones too: as far as support functions of their corners, where they have only such."""
    rng = np.random.default_rng(11)
    for shape in [*SHARP, *(random_solid(rng, unions=False)[0] for _ in range(20))]:
        parts = solid_parts({"o": Obstacle.model_validate(shape)}, {})
        found, surface = SolidBodies(parts).outlines, surface_of(parts[0].inequalities)
        around = 50.0 * np.concatenate([np.eye(3), -np.eye(3), rng.normal(size=(40, 3))])
        on = np.array(parts[0].center) + surface.nearest(around)
        assert np.all(found.low <= on.min(axis=0) + 1e-9)
        assert np.all(found.high >= on.max(axis=0) - 1e-9)
        assert found.low == pytest.approx(on[:6].min(axis=0)[None], abs=0.05)
        assert found.high == pytest.approx(on[:6].max(axis=0)[None], abs=0.05)


SHARP = [
    {"prism": {"polygon": [[0, 0], [1, 0.02], [0.5, 0.05]], "z": [0, 1]}},
    {"prism": {"polygon": [[0, 0], [1, 0], [0, 0.1]], "z": [0, 0.05]}},
]


def test_beside_any_shape_the_distance_itself_is_proved() -> None:
    """At faces, edges and corners, of two degrees too."""
    rng = np.random.default_rng(0)
    for shape in [*SHARP, *(random_solid(rng, unions=False)[0] for _ in range(12))]:
        bodies = SolidBodies(solid_parts({"o": Obstacle.model_validate(shape)}, {}))
        points = rng.normal(size=(200, 3)) + np.array([0, 0, 1])
        with np.errstate(all="ignore"):
            low, near = bodies.distances(np.zeros(len(points), dtype=np.intp), Hulls.points(points), points)
        wanted = distances(shape, points)
        outside = wanted > 1e-6
        assert low[outside] == pytest.approx(wanted[outside], abs=1e-9)
        assert np.all(low[outside] <= wanted[outside] + 1e-12)
        assert near[outside] == pytest.approx(wanted[outside], abs=1e-9)


@pytest.mark.parametrize("bound", [1e-6, 0.25, 4.0, 1e6])
def test_how_a_round_body_is_written_changes_nothing(bound: float) -> None:
    """x'Mx <= b for M of any size: the ellipsoid of the same radii, told as far away."""
    radii = np.array([0.4, 0.25, 0.6])
    written = {"parts": [[{"quadratic": np.diag(bound / radii**2).tolist(), "bound": bound}]]}
    points = np.random.default_rng(6).normal(size=(300, 3))
    found = [
        SolidBodies(solid_parts({"o": Obstacle.model_validate({"center": [0, 0, 0], **shape})}, {})).nearest(points)[0].low
        for shape in ({"radii": radii.tolist()}, written)
    ]
    outside = np.sum((points / radii) ** 2, axis=1) > 1
    np.testing.assert_allclose(found[0][outside], found[1][outside], atol=1e-12)


@pytest.mark.parametrize("scale", [1e-310, 1e-200, 1.2e-162, 2.72e-162, 1e-100, 1e100, 1e155, 1e300])
def test_how_long_normals_are_written_changes_nothing(scale: float) -> None:
    """Squares of such normals vanish, lose digits or overflow; the body is the same box, 1 m around its centre."""
    faces = [
        {"linear": [sign * scale * (k == axis) for k in range(3)], "bound": scale} for axis in range(3) for sign in (1.0, -1.0)
    ]
    bodies = SolidBodies(solid_parts({"o": Obstacle.model_validate({"center": [0, 0, 0], "parts": [faces]})}, {}))
    points = np.array([[2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 2.0, 2.0], [0.5, 0.0, 0.0]])
    found, _ = bodies.nearest(points)
    assert np.all(found.low <= np.sqrt([1.0, 2.0, 3.0, 0.0]))
    np.testing.assert_allclose(found.low[:3], np.sqrt([1.0, 2.0, 3.0]), rtol=1e-9)
    beyond = bodies.outlines.beyond(points, points)[:, 0]
    wanted = np.array([1.0, np.sqrt(2.0), np.sqrt(3.0), -0.5])
    assert np.all(beyond <= wanted)
    np.testing.assert_allclose(beyond, wanted, rtol=1e-5)
