"""Gaps between bodies, in floats, against distances that a general optimiser finds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

from refine.obstacles.gaps import solids, widest_gap
from tests.helpers.motion.solids import random_solid
from verify.data.shapes.inequalities import Inequality, grown
from verify.data.shapes.region import Region

Floats = NDArray[np.float64]


def constraint(part: Sequence[Inequality], centre: Floats, which: slice) -> list[dict[str, object]]:
    def room(x: Floats) -> Floats:
        r = x[which] - centre
        return np.array([q.bound - np.array(q.linear) @ r - r @ np.array(q.quadratic) @ r for q in part])

    return [{"type": "ineq", "fun": room}]


def distance(one: Region, other: Region) -> float:
    """Least distance of two regions in m, zero where they overlap."""
    found = []
    for a in one.body:
        for b in other.body:
            begin = np.concatenate([one.center, other.center])
            best = minimize(
                lambda x: float(np.sum((x[:3] - x[3:]) ** 2)),
                begin,
                constraints=[
                    *constraint(a, np.array(one.center), slice(0, 3)),
                    *constraint(b, np.array(other.center), slice(3, 6)),
                ],
                method="SLSQP",
                options={"maxiter": 200, "ftol": 1e-12},
            )
            found.append(float(np.sqrt(best.fun)))
    return min(found)


def test_a_gap_is_never_wider_than_the_distance_and_is_there_where_bodies_are_apart() -> None:
    rng = np.random.default_rng(3)
    apart = 0
    for _ in range(10):
        one, other = (Region.model_validate(random_solid(rng)[0]) for _ in range(2))
        between = np.array(other.center) - one.center
        gap, far = widest_gap(one.body, other.body, between), distance(one, other)
        assert gap <= far + 1e-5
        assert gap == pytest.approx(widest_gap(other.body, one.body, -between), abs=0.02)
        if far > 0.02:
            apart += 1
            assert gap > 0.6 * far
    assert apart > 2


def test_a_round_body_s_gap_is_its_distance() -> None:
    ball = Region.model_validate({"center": (0, 0, 0), "radii": (0.5, 0.5, 0.5)})
    long = Region.model_validate({"center": (0, 0, 0), "radii": (0.5, 0.3, 0.9), "yaw_deg": 30})
    box = Region.model_validate({"center": (2, 1.5, 0), "size": (1, 1, 1)})
    assert widest_gap(ball.body, box.body, np.array(box.center)) == pytest.approx(np.hypot(1.5, 1.0) - 0.5, abs=1e-4)
    assert widest_gap(long.body, box.body, np.array(box.center)) == pytest.approx(distance(long, box), abs=1e-4)


def test_points_beside_a_body_are_parted_from_it() -> None:
    (box,) = solids(Region.model_validate({"center": (0, 0, 0), "size": (1, 2, 3)}).body)
    (drum,) = solids(Region.model_validate({"center": (0, 0, 0), "cylinder": {"radius": 0.5, "height": 2.0}}).body)
    assert len(box.edges) == 6
    assert np.allclose(np.abs(box.edges).sum(axis=1), 1.0)  # along the axes, both ways
    assert len(drum.edges) == 0
    points = np.array([[2.0, 0.0, 0.0], [2.5, 0.3, 0.4]])
    gap, way = box.beside(points, np.zeros((0, 3)))
    assert gap == pytest.approx(1.5)
    assert np.allclose(way, [1, 0, 0])
    aside = np.array([[3.0, 4.0, 0.2], [3.3, 4.4, -0.2]])
    gap, way = drum.beside(aside, np.zeros((0, 3)))
    assert gap == pytest.approx(4.5, abs=1e-3)
    assert np.allclose(way, [0.6, 0.8, 0.0], atol=2e-2)
    corner = np.array([[1.5, 2.0, 2.0]])
    gap, _ = box.beside(corner, (corner - [[0.5, 1.0, 1.5]]) / np.linalg.norm(corner - [[0.5, 1.0, 1.5]]))
    assert gap == pytest.approx(np.sqrt(1 + 1 + 0.25))


def test_a_body_grows_by_the_margin() -> None:
    rng = np.random.default_rng(4)
    for _ in range(40):
        region = Region.model_validate(random_solid(rng)[0])
        if len(region.body) > 1:
            continue
        (part,) = grown(region.body, 0.1)
        ((old,), (new,)) = solids(region.body), solids((part,))
        points = rng.normal(size=(200, 3))
        before, after = old.body.depths(points), new.body.depths(points)
        flat = not old.is_round
        assert np.all(after >= before + 0.1 - 1e-9) if not flat else np.allclose(after, before + 0.1)
        for one, other in zip(region.body[0], part, strict=True):
            assert other.linear == one.linear
            assert other.quadratic == one.quadratic
            if not np.any(one.quadratic):
                assert other.bound == pytest.approx(one.bound + 0.1 * float(np.linalg.norm(one.linear)))
    ball = Region.model_validate({"center": (0, 0, 0), "radii": (0.5, 0.4, 0.8)})
    ((wider,),) = grown(ball.body, 0.1)
    assert wider.bound == pytest.approx((1 + 0.1 / 0.4) ** 2)
