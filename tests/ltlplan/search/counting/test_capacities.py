"""How many robots a region holds at most: never fewer than were placed in it, and exact for the balls that geometry knows."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from ltlplan.search.counting.capacities import Room
from tests.helpers.missions.worlds import world
from verify.data.shapes.region import Region

APART = 0.4


def room(x: float, y: float, z: float, *, z_scale: float = 1.0) -> Room:
    return Room(Region(center=(0.0, 0.0, 1.0), radii=(x, y, z)), APART, 0.05, z_scale)


@pytest.mark.parametrize(
    ("robots", "radius"),
    [
        (2, 1 / 2),
        (3, 1 / math.sqrt(3)),
        (4, math.sqrt(3 / 8)),
    ],  # of the ball around a pair, a triangle, a tetrahedron of edge 1
)
def test_a_ball_holds_a_simplex_just_when_it_is_around_it(robots: int, radius: float) -> None:
    needed = radius * APART + 0.05
    assert room(*[needed + 1e-4] * 3).most(5) >= robots
    assert room(*[needed - 1e-4] * 3).most(5) == robots - 1
    assert room(*[needed / 1.5] * 3).scale_for(robots) == pytest.approx(1.5, abs=0.01)


def test_no_more_robots_are_ever_placed_than_there_is_said_to_be_room_for() -> None:
    rng = np.random.default_rng(3)
    tight = 0
    for _ in range(60):
        radii, z_scale = rng.uniform(0.1, 0.35, 3), rng.choice([1.0, 0.5, 2.0])
        less = radii - 0.05  # no more than the region less the margin
        points = rng.uniform(-1.0, 1.0, (2000, 3)) * less
        points = points[np.sum((points / less) ** 2, axis=1) <= 1.0] * (1.0, 1.0, z_scale)
        points, placed = points[np.argsort(-np.linalg.norm(points, axis=1))], 0
        while len(points):
            points, placed = points[np.linalg.norm(points - points[0], axis=1) >= APART], placed + 1
        most = room(*radii, z_scale=z_scale).most(12)
        assert most >= min(placed, 12)
        tight += most == placed
    assert tight > 15


def test_long_and_flat_rooms_are_cut_into_boxes() -> None:
    assert [room(length, 0.06, 0.06).most(10) for length in (0.2, 0.5, 1.0, 1.5)] == [1, 3, 5, 8]
    assert room(0.04, 1.0, 1.0).most(10) == 0, "nowhere inside by the margin"


def test_what_robots_keep_is_the_mission_s() -> None:
    mission = world("F(count(a) >= 2)", robots=2, team="joint", extra="separation: 0.5\nseparation_z: 0.25\nmargin: 0.02")
    found = Room.of(mission, "a")
    assert (found.apart, found.z_scale) == (pytest.approx(0.5 + 2 * 2 * 0.02), 2.0)
    pairs = [mission.least_distance(*pair) for pair in itertools.combinations(mission.agents, 2)]
    assert found.apart >= max(pairs)
