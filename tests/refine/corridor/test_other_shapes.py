"""What keeps a path out of boxes, cylinders and unions: planes, and where a robot that hovers may step aside."""

from __future__ import annotations

import numpy as np
import pytest

from refine.corridor.planned import hovering_corridor
from refine.obstacles.keep_out_bodies import convex_parts, grown_region
from tests.helpers.motion.flights import small_mission
from tests.helpers.motion.solids import random_solid
from verify.data.shapes.region import Region

UNION = "a: {union: [{center: [1, 0, 1], size: [0.4, 1, 1]}, {center: [1.4, 0, 1], cylinder: {radius: 0.3, height: 1}}]}"


@pytest.mark.slow
def test_a_plane_parts_a_leg_from_each_part_wherever_they_lie_apart() -> None:
    rng = np.random.default_rng(0)
    parted = 0
    for _ in range(200):
        data, holds = random_solid(rng)
        body = grown_region("a", Region.model_validate(data), 0.05)
        a, b = rng.uniform([-2, -2, 0], [2, 2, 2], (2, 3))
        along = a + np.linspace(0, 1, 200)[:, None] * (b - a)
        planes = [part.plane(a, b) for part in convex_parts(body)]
        if all(plane is not None for plane in planes):
            parted += 1
            assert np.all(holds(along) < 0)
            assert np.all(body.signed_distance(along) > -1e-9)
            points = rng.uniform([-2, -2, 0], [2, 2, 2], (2000, 3))
            inside = points[holds(points) >= 0]
            assert np.all(np.any([inside @ plane.normal < plane.offset for plane in planes if plane is not None], axis=0))
        else:
            assert np.min(body.signed_distance(along)) < 0.02
    assert parted > 40


def test_a_robot_that_hovers_beside_a_union_keeps_out_of_each_part() -> None:
    mission = small_mission(regions=UNION)
    corridor = hovering_corridor(mission, "r0", np.array([0.0, 0.0, 1.0]), 3)
    here, there = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.3, 1.0])
    for leg in corridor.legs:
        assert len(leg.obstacles) == 2
        assert all(body.plane(here, there) is not None for body in leg.obstacles)


@pytest.mark.parametrize("margin", [0.0, 0.1])
def test_what_is_outside_the_grown_body_is_outside_by_the_margin(margin: float) -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        data, holds = random_solid(rng)
        body = grown_region("a", Region.model_validate(data), margin)
        points = rng.uniform([-2, -2, 0], [2, 2, 2], (500, 3))
        outside = points[body.signed_distance(points) > 0]
        pushes = rng.normal(size=outside.shape)
        pushes *= margin / np.linalg.norm(pushes, axis=1, keepdims=True)
        assert np.all(holds(outside + pushes) < 1e-9)
