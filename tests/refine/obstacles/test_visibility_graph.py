"""Shortest ways between boxes: clear of them, as short as on a fine grid, and none only where the grid has none either."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from refine.obstacles.inflated_bodies import InflatedBodies, grown_bodies
from refine.obstacles.visibility_graph import Roadmap
from tests.helpers.few import few_of
from tests.helpers.motion.box_worlds import Boxes, grid_length
from verify.data.shapes.region import Region

CLEARANCE, SIDE = 0.2, 4.0
LOW, HIGH = np.array([0.0, 0.0, 0.2]), np.array([SIDE, SIDE, 1.8])


def roadmap(boxes: Boxes, soft: dict[str, Region] | None = None) -> Roadmap:
    solids = [
        body for k, one in enumerate(boxes.regions()) for body in grown_bodies(f"box{k}", one.center, one.body, CLEARANCE)
    ]
    others = [body for name, one in (soft or {}).items() for body in grown_bodies(name, one.center, one.body, 0.05)]
    return Roadmap(LOW, HIGH, solids, others, np.array([1.0]))


def dense(way: np.ndarray) -> np.ndarray:
    return np.concatenate([np.linspace(a, b, 200) for a, b in itertools.pairwise(way)])


def length(way: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())


def box(center: tuple[float, float, float], size: tuple[float, float, float]) -> Region:
    return Region.model_validate({"center": center, "size": size})


@few_of(6, "seed", range(20))
def test_ways_in_random_rooms_agree_with_a_fine_grid(seed: int) -> None:
    rng = np.random.default_rng(seed)
    boxes = Boxes.random(rng, int(rng.integers(2, 9)), SIDE)
    found = roadmap(boxes)
    candidates = np.column_stack([np.round(rng.uniform(0.3, SIDE - 0.3, (40, 2)) / 0.04) * 0.04, np.full(40, 1.0)])
    start, end = candidates[boxes.distances(candidates) > 1.3 * CLEARANCE][:2]
    way = found.way(start, end, room=0.1)
    generous = grid_length(boxes, CLEARANCE - 0.04, (start, end), SIDE, 0.04)
    strict = grid_length(boxes, 1.1 * CLEARANCE + 0.04, (start, end), SIDE, 0.04)
    if way is None:
        assert math.isinf(strict)
        return
    assert not math.isinf(generous)
    assert np.all(boxes.distances(dense(way)) >= CLEARANCE)
    shortest = found.way(start, end)
    assert shortest is not None
    assert np.linalg.norm(end - start) - 1e-9 <= length(shortest) <= min(length(way), strict) + 1e-6
    back = found.way(end, start)
    assert back is not None
    assert length(back) == pytest.approx(length(shortest), rel=0.02)


def test_bevels_keep_a_growth_within_a_tenth_of_the_clearance() -> None:
    (body,) = grown_bodies("box", (0.0, 0.0, 0.0), box((0.0, 0.0, 0.0), (1.0, 0.1, 0.6)).body, 1.0)
    boxes = Boxes(np.zeros((1, 3)), np.array([[1.0, 0.1, 0.6]]), np.zeros(1))
    points = np.random.default_rng(0).uniform(-2.0, 2.0, (20_000, 3))
    distances, inside = boxes.distances(points), body.holds(points)
    assert np.all(inside[distances < 1.0])
    assert not np.any(inside[distances > 1.0 / math.cos(math.pi / 8) ** 2])


@pytest.mark.slow
def test_segments_meet_what_dense_points_on_them_lie_in() -> None:
    rng = np.random.default_rng(3)
    shapes = [
        Region(center=(0.2, 0.1, 0.0), radii=(0.4, 0.2, 0.3), yaw_deg=30),
        Region.model_validate({"center": (-0.3, 0.4, 0.1), "cylinder": {"radius": 0.3, "height": 0.5}}),
        box((0.3, -0.5, 0.0), (0.2, 0.9, 0.4)),
    ]
    bodies = InflatedBodies([body for k, one in enumerate(shapes) for body in grown_bodies(str(k), one.center, one.body, 0.05)])
    starts, ends = rng.uniform(-1, 1, (1000, 3)), rng.uniform(-1, 1, (1000, 3))
    met = bodies.meets(starts, ends)
    shares = np.linspace(0, 1, 400)[:, None, None]
    points = (starts + shares * (ends - starts)).reshape(-1, 3)
    sampled = np.any([body.holds(points).reshape(400, 1000) for body in bodies.bodies], axis=(0, 1))
    assert np.all(met[sampled])
    assert np.mean(met ^ sampled) < 0.01


def test_a_region_closes_a_gap_to_ways_that_may_not_enter_it() -> None:
    wall = Boxes(np.array([[0.9, 2.0, 1.0], [3.1, 2.0, 1.0]]), np.array([[1.8, 0.1, 2.4]] * 2), np.zeros(2))
    found = roadmap(wall, {"door": box((2.0, 2.0, 1.0), (0.4, 0.1, 2.4))})
    start, end = np.array([1.0, 1.0, 1.0]), np.array([1.0, 3.0, 1.0])
    assert found.way(start, end) is None  # 0.4 m wide
    wider = Boxes(wall.centers + np.array([[-0.1, 0, 0], [0.1, 0, 0]]), wall.sizes, wall.yaws)
    found = roadmap(wider, {"door": box((2.0, 2.0, 1.0), (0.6, 0.1, 2.4))})
    assert found.way(start, end) is None
    way = found.way(start, end, {"door"}, room=0.1)
    assert way is not None
    assert np.all(wider.distances(dense(way)) >= CLEARANCE)
    crossing = dense(way)[np.argmin(np.abs(dense(way)[:, 1] - 2.0))]
    assert crossing[0] == pytest.approx(2.0, abs=0.1)


def test_a_low_wall_is_passed_above() -> None:
    low = Boxes(np.array([[2.0, 2.0, 0.5]]), np.array([[4.5, 0.1, 1.0]]), np.zeros(1))
    way = roadmap(low).way(np.array([2.0, 1.0, 0.6]), np.array([2.0, 3.0, 0.6]))
    assert way is not None
    assert dense(way)[:, 2].max() == pytest.approx(1.0 + CLEARANCE, abs=0.03)
    assert np.all(low.distances(dense(way)) >= CLEARANCE)


def test_a_window_in_a_wall_is_found() -> None:
    centers = np.array([[0.9, 2.0, 1.0], [3.1, 2.0, 1.0], [2.0, 2.0, 0.3], [2.0, 2.0, 1.8]])
    sizes = np.array([[1.6, 0.1, 2.4], [1.6, 0.1, 2.4], [0.6, 0.1, 1.0], [0.6, 0.1, 0.8]])
    window = Boxes(centers, sizes, np.zeros(4))
    way = roadmap(window).way(np.array([0.5, 0.5, 1.0]), np.array([3.5, 3.5, 1.0]))
    assert way is not None
    assert np.all(window.distances(dense(way)) >= CLEARANCE)


def moved(boxes: Boxes, turn: float, by: np.ndarray) -> Boxes:
    """The same boxes turned about the room's middle and shifted."""
    cos, sin = np.cos(turn), np.sin(turn)
    matrix = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    middle = np.array([SIDE / 2, SIDE / 2, 0.0])
    return Boxes((boxes.centers - middle) @ matrix.T + middle + by, boxes.sizes, boxes.yaws + turn)


@pytest.mark.parametrize("seed", range(4))
def test_a_turned_world_has_turned_ways(seed: int) -> None:
    boxes = Boxes.random(np.random.default_rng(seed), 5, SIDE)
    points = np.array([[0.3, 0.3, 1.0], [3.7, 3.7, 1.0], [0.3, 3.7, 1.0]])
    (start, end, *_) = [*points[boxes.distances(points) > CLEARANCE], *points][:2]
    turned = moved(boxes, np.pi / 2, np.zeros(3))
    there = [
        moved(Boxes(point[None], np.ones((1, 3)), np.zeros(1)), np.pi / 2, np.zeros(3)).centers[0] for point in (start, end)
    ]
    one, other = roadmap(boxes).way(start, end), roadmap(turned).way(*there)
    assert (one is None) == (other is None)
    if one is not None and other is not None:
        assert length(one) == pytest.approx(length(other), rel=1e-3)


def test_a_scaled_world_has_scaled_ways() -> None:
    boxes = Boxes(np.array([[2.0, 2.0, 1.0]]), np.array([[2.0, 0.1, 2.4]]), np.zeros(1))
    twice = Boxes(2 * boxes.centers, 2 * boxes.sizes, boxes.yaws)
    large = [
        body for k, one in enumerate(twice.regions()) for body in grown_bodies(f"box{k}", one.center, one.body, 2 * CLEARANCE)
    ]
    start, end = np.array([2.0, 1.0, 1.0]), np.array([2.2, 3.0, 1.0])
    one = roadmap(boxes).way(start, end)
    other = Roadmap(2 * LOW, 2 * HIGH, large, [], np.array([2.0])).way(2 * start, 2 * end)
    assert one is not None
    assert other is not None
    assert 2 * length(one) == pytest.approx(length(other), rel=5e-3)


def test_a_box_its_halves_and_a_prism_are_passed_alike() -> None:
    whole = Region.model_validate({"center": (2.0, 2.0, 1.0), "size": (2.0, 0.4, 2.4)})
    halves = Region.model_validate(
        {"union": [{"size": (1.0, 0.4, 2.4), "center": (1.5, 2.0, 1.0)}, {"size": (1.0, 0.4, 2.4), "center": (2.5, 2.0, 1.0)}]}
    )
    prism = Region.model_validate({"prism": {"polygon": [(1.0, 1.8), (3.0, 1.8), (3.0, 2.2), (1.0, 2.2)], "z": (-0.2, 2.2)}})
    found: list[float] = []
    for body in (whole, halves, prism):
        solids = grown_bodies("body", body.center, body.body, CLEARANCE)
        way = Roadmap(LOW, HIGH, solids, [], np.array([1.0])).way(np.array([2.0, 1.0, 1.0]), np.array([2.3, 3.0, 1.0]))
        assert way is not None
        found.append(length(way))
    assert found == pytest.approx([found[0]] * 3, rel=1e-6)


def test_round_posts_are_passed_close() -> None:
    post = Region.model_validate({"center": (2.0, 2.0, 1.0), "cylinder": {"radius": 0.5, "height": 2.4}})
    solids = grown_bodies("post", post.center, post.body, CLEARANCE)
    way = Roadmap(LOW, HIGH, solids, [], np.array([1.0])).way(np.array([2.0, 0.5, 1.0]), np.array([2.0, 3.5, 1.0]))
    assert way is not None
    off = np.linalg.norm(dense(way)[:, :2] - 2.0, axis=1)
    assert 0.7 <= off.min() <= 0.71
    tangent, arc = math.sqrt(1.5**2 - 0.7**2), 0.7 * 2 * math.asin(0.7 / 1.5)
    assert 2 * tangent + arc <= length(way) <= 1.03 * (2 * tangent + arc)
