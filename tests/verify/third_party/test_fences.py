"""Fences: what the judge says of drones near polygons, against a dense sampler and in cases that are decided exactly."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.motion.fleets import sampled, wandering
from verify.third_party.fleet import Fleet, Flight, assemble
from verify.third_party.shows.fences import judge_fence
from verify.third_party.shows.own_limits import Fence

L_SHAPE = np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 3.0], [3.0, 3.0], [3.0, 8.0], [0.0, 8.0]])


def room_of(points: np.ndarray, fence: Fence) -> np.ndarray:
    """Return how far points are from the border, on the wrong side of it negative, by plain means."""
    inside, distance = np.zeros(len(points), dtype=bool), np.full(len(points), np.inf)
    for start, end in zip(fence.corners, np.roll(fence.corners, -1, axis=0), strict=True):
        along = end - start
        share = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
        distance = np.minimum(distance, np.linalg.norm(points - start - share[:, None] * along, axis=1))
        crossed = (start[1] > points[:, 1]) != (end[1] > points[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            inside ^= crossed & (points[:, 0] < start[0] + (points[:, 1] - start[1]) * along[0] / along[1])
    return np.where(inside == fence.inside, distance, -distance)


@few_of(2, "seed", range(6))
def test_the_judge_agrees_with_a_dense_sampler(seed: int) -> None:
    rng = np.random.default_rng(seed)
    fleet = wandering(4, 3, rng, common=bool(seed % 2), size=4.0)
    fence = Fence("f", bool(seed % 3), L_SHAPE + rng.uniform(-3.0, 0.0, 2))
    margin = float(rng.uniform(0.05, 0.5)) if seed % 2 else 0.0
    kept, broken = judge_fence(fleet, fence, Fraction(margin))
    times = np.linspace(0.0, float(fleet.end), 801)
    rooms = [room_of(sampled(fleet, drone, times)[:, :2], fence).min() for drone in range(len(fleet))]
    assert {found.drone for found in broken} == {drone for drone, room in enumerate(rooms) if room < margin}
    for found in broken:
        assert found.outcome == "fails"
        there = room_of(sampled(fleet, found.drone, np.array([found.time]))[:, :2], fence)[0]
        assert there == pytest.approx(-found.depth, abs=1e-6)
        assert there < margin
    if not broken:
        assert kept.low <= min(rooms) + 1e-9
        assert min(rooms) <= kept.low + 0.03
        assert kept.high == pytest.approx(min(rooms), abs=0.03)


def along(*points: tuple[float, float]) -> Fleet:
    """Return a drone that goes on straight lines, a second each."""
    corners = np.array([(*point, 1.0) for point in points])
    values = np.stack([corners[:-1], corners[1:]], -1)
    knots = np.stack([np.arange(float(len(points))), np.zeros(len(points))], -1)
    return assemble("show", "bernstein", [Flight("a", knots, values, np.ones(len(values), dtype=np.int8))])


@few_of(
    4,
    ("points", "margin", "keeps"),
    [
        (((0, 1), (0, 8), (3, 8)), 0, True),  # along the border
        (((1, 1), (3, 3), (1, 5)), 0, True),  # touches the inner corner
        (((3, 8), (3, 3), (8, 3)), 0, True),  # round it on the border
        (((1, 7), (7, 1)), 0, False),  # cuts it off
        (((2, 4), (4, 2)), 0, True),  # goes through the very corner
        (((2, 4), (4, np.nextafter(2.0, 3))), 0, False),
        (((0.5, 0.5), (7.5, 0.5)), 0.5, True),
        (((0.5, 0.5), (7.5, np.nextafter(0.5, 0))), 0.5, False),
        (((0.5, 1), (2.5, 1)), Fraction(1, 2), True),
        (((9, 9), (9, 10)), 0, False),
    ],
)
def test_what_lies_on_the_border_is_decided_exactly(
    points: tuple[tuple[float, float], ...], margin: float | Fraction, keeps: bool
) -> None:
    _, broken = judge_fence(along(*points), Fence("f", True, L_SHAPE), Fraction(margin))
    assert (not broken) == keeps
    _, broken = judge_fence(along(*points), Fence("f", False, L_SHAPE), Fraction(0))
    assert [found.outcome for found in broken] == ([] if points in (((9, 9), (9, 10)),) or _on_border(points) else ["fails"])


def _on_border(points: tuple[tuple[float, float], ...]) -> bool:
    return points in (((0, 1), (0, 8), (3, 8)), ((3, 8), (3, 3), (8, 3)))
