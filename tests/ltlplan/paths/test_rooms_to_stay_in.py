"""Rooms with corners are the free space of legs that may not leave them."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import ltlplan
from ltlplan.free_space.free_space import FreeSpace
from ltlplan.free_space.staying_inside import stays_inside, way_inside
from ltlplan.search.exact import assign
from refine import refine
from refine.single_robot.task import Pace
from tests.helpers.few import few_of
from tests.helpers.missions.rooms_and_rests import room_with_a_corner
from verify import judge
from verify.data import LtlplanError, parse_mission

AROUND_THE_CORNER = math.dist((1.4, -1.2), (-1.05, -0.75)) + math.dist((-1.05, -0.75), (-1.5, 0.9))
"""m; the shortest way that keeps a margin of 5 cm from the room's inner edge."""

_BODIES = """
format: 1
name: bodies
spec: {formula: F room}
regions:
  room:
    union:
      - {center: [0, 0, 1], radii: [0.4, 0.4, 0.4]}
      - {center: [0.5, 0, 1], radii: [0.4, 0.3, 0.4]}
      - {center: [0.9, 0.3, 1], size: [0.6, 0.5, 0.15]}
      - {center: [-0.5, 0, 1], cylinder: {radius: 0.3, height: 0.3}}
agents: {a: {start: [-1.5, -0.9, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-2, -1, 0.5], max: [2, 1, 1.5]}
"""

ROOMS = [
    dict(zip(("mirrored", "turned", "touching"), each, strict=True)) for each in itertools.product((False, True), repeat=3)
]


@few_of(1, "paces", [("nominal",), ("nominal", 0.7)])
@few_of(1, "room", ROOMS)
def test_the_way_around_a_corner_is_flown_and_proved(room: dict[str, bool], paces: tuple[Pace, ...]) -> None:
    mission = room_with_a_corner(**room)
    made = ltlplan.plan(mission)
    assert AROUND_THE_CORNER <= made.cost <= 1.12 * AROUND_THE_CORNER
    for pace in paces:
        assert judge(made, refine(made, pace=pace), largest=False).holds


@few_of(1, "room", ROOMS)
def test_the_search_counts_the_way_around_the_corner(room: dict[str, bool]) -> None:
    found = assign(room_with_a_corner(**room))
    assert AROUND_THE_CORNER - 1e-6 <= found.cost <= 1.001 * AROUND_THE_CORNER


def test_a_way_stays_as_deep_as_it_is_told_to() -> None:
    mission = room_with_a_corner()
    start, end, space = np.array([1.4, -1.2, 1.0]), np.array([-1.5, 0.9, 1.0]), FreeSpace.of(mission)
    for slack in (0.0, 0.04, 0.2):
        way = way_inside(space, ["room"], (start, end), ("room", "corner"), slack)
        assert way is not None
        assert np.all(stays_inside(mission.regions["room"], way[:-1], way[1:], mission.margin + slack))
    assert not stays_inside(mission.regions["room"], start[None], end[None], 0.0)[0]
    assert way_inside(space, ["room"], (start, end), ("room", "corner"), 0.6) is None  # the room is 1 m wide


@pytest.mark.parametrize("deep", [0.0, 0.05])
def test_lines_that_stay_inside_are_so_deep_at_each_sample(deep: float) -> None:
    """Boxes, balls and a cylinder in one region; the samples may miss a gap between two bodies that is as short as their distance."""
    region, rng = parse_mission(_BODIES).regions["room"], np.random.default_rng(3)
    middle, half = np.array(region.center), np.array(region.measures.half_lengths)
    starts, ends = (middle + rng.uniform(-1.0, 1.0, (500, 3)) * half for _ in range(2))
    found = stays_inside(region, starts, ends, deep)
    least = np.minimum(deep, np.minimum(*(region.measures.depths(points - middle) for points in (starts, ends))))
    samples = [region.measures.depths(starts + share * (ends - starts) - middle) for share in np.linspace(0.0, 1.0, 300)]
    deepest = np.min(samples, axis=0) - least
    assert np.all(deepest[found] >= -2e-9)
    assert np.mean(found == (deepest >= -1e-9)) >= 0.99
    assert 0.05 < np.mean(found) < 0.95


def test_where_a_room_is_too_narrow_nothing_is_said_of_hoops() -> None:
    narrow = room_with_a_corner()
    tight = narrow.changed(margin=0.45)
    with pytest.raises(LtlplanError) as refused:
        ltlplan.plan(tight)
    assert "hoop" not in str(refused.value)
