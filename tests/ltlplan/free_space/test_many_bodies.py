"""Worlds of many obstacles and regions."""

from __future__ import annotations

import numpy as np
import pytest

import ltlplan
from ltlplan.free_space.free_space import FreeSpace
from ltlplan.search.relevant_places import places_that_matter
from ltlplan.systems.region_labels import Layout
from tests.helpers.missions.walled_rooms import box, shelves, two_rooms


@pytest.mark.slow
def test_of_many_regions_those_that_shut_nothing_need_no_stop() -> None:
    mission = shelves(16, "F at3_7 & F at8_2")
    assert places_that_matter(mission, Layout(mission)) == {"at3_7", "at8_2"}
    plan = ltlplan.plan(mission.model_copy(update={"planner": mission.planner.model_copy(update={"iterations": 1})}))
    assert {visit.region for visit in plan.robots["quad0"].visits} == {"at3_7", "at8_2"}


@pytest.mark.slow
def test_of_many_regions_a_door_is_kept() -> None:
    mission = shelves(16, "F at3_2")
    wall = {"wall": box((7.0, 10.0, 1.0), (14.0, 0.1, 2.0))}
    mission = mission.changed(
        obstacles={**mission.obstacles, **two_rooms("true", obstacles=wall).obstacles},
        regions={**mission.regions, **two_rooms("true", regions={"door": box((17.5, 10.0, 1.0), (7.0, 0.3, 2.0))}).regions},
    )
    assert places_that_matter(mission, Layout(mission)) == {"at3_2"}
    behind = mission.changed(spec={"formula": "F at3_12"})
    assert places_that_matter(behind, Layout(behind)) is None


@pytest.mark.slow
def test_two_hundred_of_each_agree_with_straight_lines_where_nothing_stands_between() -> None:
    mission = shelves(20, "F at0_0")
    space = FreeSpace.of(mission)
    assert space is not None
    rng = np.random.default_rng(0)
    names = sorted(mission.regions)
    for one, other in rng.choice(names, (40, 2)):
        start, end = np.array(mission.regions[one].center), np.array(mission.regions[other].center)
        way = space.way(start, end, {one, other})
        assert way is not None
        length = np.linalg.norm(np.diff(way, axis=0), axis=1).sum()
        straight = float(np.linalg.norm(end - start))
        assert straight - 1e-9 <= length <= 1.5 * straight + 1.0
