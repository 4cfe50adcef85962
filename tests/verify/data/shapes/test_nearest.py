"""Nearest points of convex bodies against a general optimiser, and against what must hold of any nearest point."""

import itertools

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.helpers.few import few_of
from verify.data.shapes.convex_parts import outline
from verify.data.shapes.nearest import surface_of
from verify.data.shapes.obstacle import Obstacle

SHAPES = [
    {"center": (0, 0, 0), "radii": (0.3, 0.2, 0.5), "yaw_deg": 20},
    {"center": (0, 0, 0), "size": (0.05, 2.0, 0.5), "yaw_deg": 20},
    {"center": (0, 0, 0), "cylinder": {"radius": 0.3, "height": 1.0}},
    {"prism": {"polygon": [[0, 0], [1, 0], [0.5, 0.7]], "z": [0, 0.05]}},
    {"center": (0, 0, 0), "parts": [[{"linear": signs, "bound": 0.5} for signs in itertools.product((1, -1), repeat=3)]]},
]


@few_of(2, "shape", SHAPES, ids=["ellipsoid", "box", "cylinder", "prism", "octahedron"])
def test_nearest_points_are_an_optimisers(shape: dict[str, object]) -> None:
    part = Obstacle.model_validate(shape).body[0]
    surface = surface_of(part)
    points = np.random.default_rng(0).normal(size=(15, 3))
    found, nearest = surface.distances(points), surface.nearest(points)
    assert surface.body.depths(nearest).min() > -1e-12
    for point, distance in zip(points[found > 0], found[found > 0], strict=True):
        inside = [
            {"type": "ineq", "fun": lambda x, q=q: q.bound - np.array(q.linear) @ x - x @ np.array(q.quadratic) @ x}
            for q in part
        ]
        best = minimize(
            lambda x, p=point: np.sum((x - p) ** 2), np.zeros(3), constraints=inside, method="SLSQP", options={"ftol": 1e-14}
        )
        assert distance == pytest.approx(np.sqrt(best.fun), abs=2e-6)


@pytest.mark.parametrize("shape", SHAPES, ids=["ellipsoid", "box", "cylinder", "prism", "octahedron"])
def test_the_way_to_the_nearest_point_parts_the_body_from_the_point(shape: dict[str, object]) -> None:
    part = Obstacle.model_validate(shape).body[0]
    surface, rng = surface_of(part), np.random.default_rng(1)
    points = rng.normal(size=(300, 3))
    points = points[surface.body.depths(points) < 0]
    nearest = surface.nearest(points)
    within = rng.uniform(-1, 1, (20000, 3))
    within = within[surface.body.depths(within) >= 0]
    ways = points - nearest
    assert np.max(within @ ways.T - np.einsum("ni,ni->n", nearest, ways)) < 1e-9


@few_of(
    3, "shape", [*SHAPES, {"center": (0, 0, 0), "parts": [[{"quadratic": np.diag([40.0, 20.0, 60.0]).tolist(), "bound": 4.0}]]}]
)
def test_an_outline_is_close_around_its_body(shape: dict[str, object]) -> None:
    surface = surface_of(Obstacle.model_validate(shape).body[0])
    corners, ways = outline(surface.body), np.random.default_rng(2).normal(size=(200, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    reaches = np.array([surface.reaches(way) for way in ways])
    around = (ways @ corners.T).max(axis=1)
    assert np.all(around >= reaches - 1e-9)
    assert np.all(around <= reaches + 0.25 * np.abs(reaches))
