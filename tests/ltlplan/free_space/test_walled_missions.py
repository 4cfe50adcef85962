"""Planning between walls: what can be reached from where, words, costs and nominal paths."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

import ltlplan
from ltlplan.free_space.free_space import FreeSpace, Place
from ltlplan.paths.hoops.clearance import conflicts
from ltlplan.paths.hoops.keep_out import room
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.search.exact import assign
from ltlplan.systems.region_graph import RegionGraph
from tests.helpers.missions.walled_rooms import box, two_rooms
from verify.data import Mission, RobotPlan, Visit
from verify.data.shapes.solid_parts import solid_parts

HOOP: dict[str, Any] = {
    "center": (3.0, 2.0, 1.0), "yaw_deg": 90, "radii": (0.25, 0.2, 0.25), "opening": 0.25, "rim": 0.02, "reach": 0.4,
}  # fmt: skip


def with_hoop(formula: str) -> Mission:
    """The wall without a gap, but with a hoop in it."""
    plain = two_rooms(formula)
    wall = {"center": (2.0, 2.0, 1.0), "size": (4.0, 0.1, 2.0), "openings": ("hole",)}
    regions = {name: region for name, region in plain.regions.items() if name != "door"}
    return two_rooms(formula, regions=regions, obstacles={"wall": wall}, hoops={"hole": HOOP})


def reached(mission: Mission, region: str) -> set[str]:
    graph = RegionGraph(mission)
    return {transition.end.place for point in graph.middles(region) for transition in graph.transitions(point)} - {region}


def flown(plan: RobotPlan) -> np.ndarray:
    spline = LeastSnapSpline(plan.times, plan.cycle_waypoint)
    return spline.evaluate([w.position for w in plan.waypoints], np.linspace(plan.times[0], plan.times[-1], 4000))


def nearest(mission: Mission, plan: RobotPlan) -> float:
    parts = solid_parts(mission.obstacles, mission.hoops)
    return min(float(part.distances(flown(plan)).min()) for part in parts)


def test_a_door_that_fills_a_gap_is_the_only_way() -> None:
    mission = two_rooms("F b")
    assert reached(mission, "a") == {"door"}
    assert reached(mission, "door") == {"a", "b"}
    assert [visit.region for visit in assign(mission).robots["quad0"].visits] == ["door", "b"]


def test_a_door_that_leaves_a_gap_beside_it_is_flown_around() -> None:
    mission = two_rooms("F b", gap=1.2)
    narrow = mission.changed(regions={**mission.regions, "door": mission.regions["door"].changed(center=(2.6, 2.0, 1.0))})
    assert reached(narrow, "a") == {"b", "door"}


def test_a_word_that_needs_a_key_first_fetches_it() -> None:
    plan = ltlplan.plan(two_rooms("F b & (!door U a)")).robots["quad0"]
    assert [visit.region for visit in plan.visits] == ["a", "door", "b"]


def test_the_cost_is_what_is_flown_and_not_a_line_through_the_wall() -> None:
    cost = assign(two_rooms("F b")).cost
    assert cost == pytest.approx(math.dist((2.0, 0.6), (3.0, 2.0)) + math.dist((3.0, 2.0), (1.0, 3.2)), rel=0.03)


@pytest.mark.parametrize("method", ["exact", "mtac-e"])
def test_who_is_near_by_air_goes_not_who_is_near_through_the_wall(method: str) -> None:
    agents = {"near": {"start": (1.0, 1.5, 1.0)}, "far": {"start": (3.6, 3.0, 1.0)}}
    mission = two_rooms("F b", agents=agents, planner={"method": method, "iterations": 2, "samples": 20})
    plan = ltlplan.plan(mission)
    assert {name: bool(robot.visits) for name, robot in plan.robots.items()} == {"near": False, "far": True}
    if method == "mtac-e":
        assert any("By shortest ways around obstacles" in note and "a gap of 0.0 %" in note for note in plan.notes)


@pytest.mark.parametrize("formula", ["F b", "F b & F a"])
def test_paths_keep_vehicle_and_margin_from_walls(formula: str) -> None:
    mission = two_rooms(formula)
    plan = ltlplan.plan(mission).robots["quad0"]
    assert nearest(mission, plan) >= mission.vehicle.radius + mission.margin
    spline = LeastSnapSpline(plan.times)
    coefficients = spline.through([w.position for w in plan.waypoints])
    everywhere = [frozenset(mission.all_regions)] * (len(plan.times) - 1)
    assert not conflicts(coefficients, spline.durations, room(mission), everywhere)


def test_a_wall_is_a_conflict_at_all_times() -> None:
    mission = two_rooms("F b")
    line = np.zeros((1, 3, 8))
    line[0, :, 0], line[0, :, 1] = (1.0, 1.0, 1.0), (0.0, 2.0, 0.0)
    (found,) = conflicts(line, np.ones(1), room(mission), [frozenset(mission.all_regions)])
    assert (found.obstacle, found.name) == ("obstacle", "west")
    assert 0.3 <= found.share <= 0.7


def test_a_hoop_in_a_wall_is_flown_through_to_the_other_side() -> None:
    mission = with_hoop("F b")
    assert reached(mission, "a") == {"hole"}
    plan = ltlplan.plan(mission).robots["quad0"]
    assert [(visit.region, visit.direction) for visit in plan.visits] == [("hole", "F"), ("b", None)]
    assert nearest(mission, plan) >= mission.vehicle.radius + mission.margin


def test_who_comes_back_through_a_hoop_in_a_wall_visits_it_twice() -> None:
    plan = ltlplan.plan(with_hoop("F(b & F a)")).robots["quad0"]
    assert [(visit.region, visit.direction) for visit in plan.visits] == [
        ("hole", "F"),
        ("b", None),
        ("hole", "R"),
        ("a", None),
    ]


def test_a_hoop_to_be_visited_once_leaves_no_way_back() -> None:
    with pytest.raises(ltlplan.Unsatisfiable):
        ltlplan.plan(with_hoop("F(b & F a) & !(F(hole & F(!hole & F hole)))"))


def test_a_robot_between_walls_ends_where_it_should() -> None:
    mission = two_rooms("F a", agents={"quad0": {"start": (2.0, 0.6, 1.0), "end": (3.5, 3.5, 1.0)}})
    plan = ltlplan.plan(mission).robots["quad0"]
    assert [visit.region for visit in plan.visits] == ["a", "door"]
    assert plan.waypoints[-1].position == pytest.approx((3.5, 3.5, 1.0))


def test_rooms_that_share_a_doorway_are_entered_one_from_the_other() -> None:
    regions = {"south": box((2.0, 1.0, 1.0), (4.0, 2.0, 2.0)), "north": box((2.0, 3.0, 1.0), (4.0, 2.0, 2.0))}
    mission = two_rooms("F north", regions=regions)
    plan = ltlplan.plan(mission).robots["quad0"]
    assert [visit.region for visit in plan.visits] == ["south", "north"]
    assert nearest(mission, plan) >= mission.vehicle.radius + mission.margin


def test_a_region_to_be_left_aside_and_a_wall_are_flown_around_at_once() -> None:
    plain = two_rooms("F b & G !trap")
    mission = two_rooms("F b & G !trap", regions={**plain.regions, "trap": box((2.6, 1.4, 1.0), (0.5, 0.3, 2.0))})
    plan = ltlplan.plan(mission).robots["quad0"]
    assert [visit.region for visit in plan.visits] == ["door", "b"]
    assert np.min(mission.regions["trap"].level(flown(plan))) > 1.0


def test_lengths_are_those_of_the_ways() -> None:
    mission = two_rooms("F b")
    space = FreeSpace.of(mission)
    assert space is not None
    assert FreeSpace.of(mission.model_copy()) is space
    places = [Place(region.center, frozenset({name})) for name, region in mission.regions.items()]
    for one, other in itertools.permutations(places, 2):
        (length,) = space.lengths(one, [other])
        way = space.roadmap().way(np.array(one.point), np.array(other.point), one.inside | other.inside)
        assert math.isfinite(length) == (way is not None)
        if way is not None:
            assert length == pytest.approx(np.linalg.norm(np.diff(way, axis=0), axis=1).sum(), rel=0.03)


def test_a_robot_that_begins_at_a_hoop_leaves_on_its_side() -> None:
    mission = with_hoop("F a")
    (visit,) = [Visit(region="a")]
    plan = ltlplan.plan(mission.changed(agents={"quad0": {"start": (3.0, 1.85, 1.0)}}))
    assert plan.robots["quad0"].visits[-1].region == visit.region


QUICK = {"iterations": 1, "samples": 20}


def test_a_patrol_passes_the_door_both_ways() -> None:
    plan = ltlplan.plan(two_rooms("true", spec={"formula": "G F a & G F b", "trace": "infinite"}, planner=QUICK)).robots[
        "quad0"
    ]
    word = plan.word
    assert word.cycle is not None
    shown = [next(iter(letter)) for letter in word.cycle if letter]
    assert sorted(shown) == ["a", "b", "door", "door"]


def test_the_dearest_robot_is_told_by_ways() -> None:
    agents = {"near": {"start": (1.6, 1.5, 1.0)}, "behind": {"start": (3.4, 3.5, 1.0)}}
    plan = ltlplan.plan(two_rooms("F b & F a", agents=agents, planner={**QUICK, "objective": "longest"}))
    assert {name: robot.visits[-1].region for name, robot in plan.robots.items()} == {"near": "a", "behind": "b"}
    assert plan.complete
