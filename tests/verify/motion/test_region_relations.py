"""Which regions are proved disjoint or nested, of all shapes: held to linear programmes, samples and school geometry."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

from tests.helpers.motion.solids import Holds, random_solid
from verify.data.shapes.inequalities import Inequality
from verify.data.shapes.region import Region
from verify.model_checking.timeline import Relations
from verify.motion.convex_bodies import ConvexPart, are_apart
from verify.motion.regions import relations


def related(**bodies: dict[str, Any]) -> Relations:
    regions = {name: Region.model_validate(data) for name, data in bodies.items()}
    return relations(SimpleNamespace(all_regions=regions))  # type: ignore[arg-type]


def faces(region: Region, part: int) -> tuple[np.ndarray, np.ndarray]:
    normals = np.array([one.linear for one in region.body[part]])
    return normals, np.array([one.bound for one in region.body[part]]) + normals @ np.array(region.center)


def depth_together(a: Region, b: Region) -> float:
    """How deep a point can lie in both of two polyhedra, of any of their parts; below zero where they are apart."""
    best = -np.inf
    for i in range(len(a.body)):
        for j in range(len(b.body)):
            normals, bounds = (np.concatenate(rows) for rows in zip(faces(a, i), faces(b, j), strict=True))
            lengths = np.linalg.norm(normals, axis=1, keepdims=True)
            found = linprog([0, 0, 0, -1], np.hstack([normals, lengths]), bounds, bounds=[(None, None)] * 4)
            best = max(best, -found.fun)
    return float(best)


def polyhedron(rng: np.random.Generator) -> Region:
    while True:
        region = Region.model_validate(random_solid(rng)[0])
        if not any(any(map(any, one.quadratic)) for part in region.body for one in part):
            return region


def test_polyhedra_are_apart_exactly_where_a_linear_programme_says_so() -> None:
    rng = np.random.default_rng(0)
    apart = together = 0
    for _ in range(20):
        a, b = polyhedron(rng), polyhedron(rng)
        deep = depth_together(a, b)
        if abs(deep) < 1e-9:
            continue
        proved = ("a", "b") in relations(SimpleNamespace(all_regions={"a": a, "b": b})).disjoint  # type: ignore[arg-type]
        assert proved == (deep < 0)
        apart, together = apart + proved, together + (not proved)
    assert min(apart, together) > 4


@pytest.mark.parametrize(("gap", "apart"), [(0.1, True), (0.001, True), (-0.001, False)])
def test_round_parts_beside_each_other_are_told_apart_along_no_axis_and_not_from_centre_to_centre(
    gap: float, apart: bool
) -> None:
    """Two alike ellipsoids, turned by 30 degrees: only planes between their nearest points hold them apart."""
    turn = np.array([[np.sqrt(3), -1.0, 0.0], [1.0, np.sqrt(3), 0.0], [0.0, 0.0, 2.0]]) / 2
    form = turn @ np.diag([1.0, 0.3**-2, 0.3**-2]) @ turn.T
    x, y, z = (tuple(row) for row in ((form + form.T) / 2).tolist())
    body = (Inequality(quadratic=(x, y, z)),)
    beside = turn @ np.array([0.5, (0.3 + gap / 2) * np.sqrt(4 - 0.25), 0.0])  # they would touch there, but for the gap
    first, second = ConvexPart((0.0, 0.0, 1.0), body), ConvexPart((float(beside[0]), float(beside[1]), 1.0), body)
    assert are_apart(first, second) == are_apart(second, first) == apart


def common_points(first: Holds, second: Holds, rng: np.random.Generator) -> float:
    """How deep a point can lie in both, as far as drawing around the best ones finds, nearer and nearer."""
    points = rng.uniform([-2.5, -2.5, -1.0], [2.5, 2.5, 3.0], (40_000, 3))
    spread = 0.2
    for _ in range(40):
        depth = np.minimum(first(points), second(points))
        best = points[np.argsort(-depth)[:40]]
        points = np.concatenate([best, (best[:, None] + rng.normal(size=(40, 40, 3)) * spread).reshape(-1, 3)])
        spread *= 0.75
    return float(depth.max())


def test_no_point_lies_in_two_regions_that_are_proved_disjoint() -> None:
    rng = np.random.default_rng(1)
    told = 0
    for _ in range(8):
        (a, in_a), (b, in_b) = random_solid(rng), random_solid(rng)
        proved = ("a", "b") in related(a=a, b=b).disjoint
        deep = common_points(in_a, in_b, rng)
        if proved:
            assert deep < 1e-9
            told += 1
        else:
            assert deep > -0.02  # a proof was found wherever they are clearly apart
    assert told > 0


def test_every_point_of_a_region_that_is_proved_nested_lies_in_the_other() -> None:
    rng = np.random.default_rng(2)
    told = 0
    for _ in range(30):
        (a, in_a), (b, in_b) = random_solid(rng), random_solid(rng)
        grown = {"center": [0.0, 0.0, 1.0], "size": [1.9, 1.9, 1.3]}
        found = related(a=a, b=b, c=grown).nested
        points = rng.uniform([-2, -2, -1], [2, 2, 3], (4000, 3))
        tests = {
            "a": in_a(points),
            "b": in_b(points),
            "c": (np.array([0.95, 0.95, 0.65]) - np.abs(points - [0, 0, 1])).min(axis=1),
        }
        for inner, outer in found:
            assert not np.any((tests[inner] > 1e-9) & (tests[outer] < -1e-9))
            told += 1
    assert told > 5


def test_rooms_that_share_a_wall_are_neither_disjoint_nor_nested() -> None:
    found = related(
        a={"center": [0.0, 0.0, 1.0], "size": [2.0, 2.0, 2.0]}, b={"center": [2.0, 0.5, 1.0], "size": [2.0, 2.0, 2.0]}
    )
    assert not found.disjoint
    assert not found.nested
    assert related(
        a={"center": [0.0, 0.0, 1.0], "size": [2.0, 2.0, 2.0]}, b={"center": [2.000001, 0.5, 1.0], "size": [2.0, 2.0, 2.0]}
    ).disjoint


@pytest.mark.parametrize(
    ("inner", "outer"),
    [
        ({"center": [0.0, 0.0, 1.0], "size": [1.0, 1.0, 1.0]}, {"center": [0.5, 0.0, 1.0], "size": [2.0, 1.0, 1.0]}),
        ({"center": [0.0, 0.0, 1.0], "radii": [0.5, 0.5, 0.5]}, {"center": [0.0, 0.0, 1.0], "size": [1.1, 1.1, 1.1]}),
        ({"center": [0.0, 0.0, 1.0], "size": [1.0, 1.0, 1.0]}, {"center": [0.0, 0.0, 1.0], "radii": [0.9, 0.9, 0.9]}),
        (
            {"center": [0.1, 0.0, 1.0], "cylinder": {"radius": 0.3, "height": 1.0}},
            {"center": [0.0, 0.0, 1.0], "size": [0.9, 0.9, 1.0]},
        ),
        (
            {"center": [0.0, 0.0, 1.0], "size": [0.5, 0.5, 1.0]},
            {"center": [0.0, 0.0, 1.0], "cylinder": {"radius": 0.36, "height": 1.0}},
        ),
        (
            {"center": [0.0, 0.0, 1.0], "cylinder": {"radius": 0.3, "height": 0.5}},
            {"center": [0.0, 0.0, 1.0], "cylinder": {"radius": 0.3, "height": 1.0}},
        ),
        (
            {"center": [0.1, 0.0, 1.0], "cylinder": {"radius": 0.3, "height": 0.5}},
            {"center": [0.0, 0.0, 1.0], "cylinder": {"radius": 0.45, "height": 1.0}},
        ),
        (
            {"center": [0.5, 0.0, 1.0], "size": [0.5, 0.5, 0.5]},
            {
                "union": [
                    {"center": [0.0, 0.0, 1.0], "size": [1.0, 1.0, 1.0]},
                    {"center": [1.0, 0.0, 1.0], "size": [1.0, 1.0, 1.0]},
                ]
            },
        ),
    ],
)
def test_what_lies_in_another_is_proved(inner: dict[str, Any], outer: dict[str, Any]) -> None:
    assert related(a=inner, b=outer).nested == {("a", "b")}


def test_parts_that_cross_without_a_corner_in_each_other_are_told() -> None:
    """Two beams turned against each other, one above the other: only a direction across two edges parts them."""
    beams = [
        {"prism": {"polygon": [[-1.0, -0.05], [1.0, -0.05], [1.0, 0.05], [-1.0, 0.05]], "z": [0.0, 0.1]}},
        {"prism": {"polygon": [[-0.05, -1.0], [0.05, -1.0], [0.05, 1.0], [-0.05, 1.0]], "z": [0.1001, 0.2]}},
    ]
    assert related(a=beams[0], b=beams[1]).disjoint
    beams[1]["prism"]["z"] = [0.0999, 0.2]
    assert not related(a=beams[0], b=beams[1]).disjoint


@pytest.mark.parametrize("scale", [1.0, 1e-300, 1e-170, 2.72e-162, 1e160, 1e300])
def test_how_long_normals_are_written_says_nothing_of_relations(scale: float) -> None:
    """Lengths of such normals vanish or overflow as floats; a cube of 2 m stays one."""
    rows = [
        {"linear": [sign * scale * (k == axis) for k in range(3)], "bound": scale} for axis in range(3) for sign in (1.0, -1.0)
    ]
    found = related(
        a={"center": [0, 0, 0], "parts": [rows]},
        b={"center": [2.01, 0, 0], "parts": [rows]},
        c={"center": [1.99, 0, 0], "parts": [rows]},
        ball={"center": [0, 0, 0], "radii": [0.9, 0.9, 0.9]},
    )
    assert set(map(frozenset, found.disjoint)) == {frozenset("ab"), frozenset({"b", "ball"}), frozenset({"c", "ball"})}
    assert found.nested == {("ball", "a")}
