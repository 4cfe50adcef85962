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
from tests.helpers.rooms_and_rests import room_with_a_corner
from verify import judge
from verify.data import LtlplanError

AROUND_THE_CORNER = math.dist((1.4, -1.2), (-1.05, -0.75)) + math.dist((-1.05, -0.75), (-1.5, 0.9))
"""m; the shortest way that keeps a margin of 5 cm from the room's inner edge."""

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


def test_where_a_room_is_too_narrow_nothing_is_said_of_hoops() -> None:
    narrow = room_with_a_corner()
    tight = narrow.changed(margin=0.45)
    with pytest.raises(LtlplanError) as refused:
        ltlplan.plan(tight)
    assert "hoop" not in str(refused.value)
