"""Courses that cannot be flown, and missions that ask for none, are refused by the name of the hoop and with what to change."""

import numpy as np
import pytest

from ltlplan.missions import load_mission
from ltlplan.paths.hoops import Blocked, SplineBlocked, avoid, route, route_sequence
from ltlplan.paths.hoops.keep_out import room
from tests.helpers.missions.hoops import REGIONS, crowded, small_mission
from verify.data import BadInput, Visit, parse_mission


def test_a_start_too_near_a_ring_is_refused_and_said_to_be():
    mission = crowded([(0.0, 0.0, 1.0, 0.0), (1.2, 0.0, 1.0, 0.0)])
    with pytest.raises(Blocked, match=r"\(0.05, 0.28, 1.00\) itself is nearer to it than"):
        avoid(mission, room(mission), np.array([0.05, 0.28, 1.0]), np.array([1.5, 0.0, 1.0]))


def test_a_hoop_whose_both_sides_are_blocked_is_refused_by_name():
    hoops = (
        "h0: {center: [1.2, 0, 1], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}\n"
        "wall: {center: [0, 0, 1], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}"
    )
    mission = small_mission(hoops=hoops, workspace="{min: [-2, -0.31, 0.69], max: [2, 0.31, 1.31]}")
    with pytest.raises(Blocked, match="'wall' stands in the way") as refused:
        route_sequence(mission)
    assert refused.value.region == "wall"
    assert refused.value.exit_code == 4
    assert "wall or outside the workspace" in str(refused.value)


def test_a_spline_without_room_is_refused_by_name():
    # behind the hoop the wall leaves no room to turn back, though every control point is inside
    hoops = "h0: {center: [1.5, 0, 1], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02, reach: 0.25}"
    mission = small_mission(hoops=hoops, sequence="h0F h0R", workspace="{min: [-2, -2, 0.2], max: [1.75, 2, 2]}")
    with pytest.raises(SplineBlocked, match="workspace"):
        route_sequence(mission)


@pytest.mark.parametrize(
    ("robot", "visits", "cycle", "match"),
    [
        ("quad9", [], None, "not an agent. Did you mean 'quad0'"),
        ("quad0", [Visit(region="hop0")], None, "not a region. Did you mean"),
        ("quad0", [Visit(region="hoop0")], 2, "0 to 1"),
    ],
)
def test_what_does_not_exist_is_refused(robot, visits, cycle, match):
    with pytest.raises(BadInput, match=match):
        route(load_mission("hoops-ltl"), robot, visits, cycle)


def test_an_end_is_not_dropped_for_a_cycle():
    mission = load_mission("hoops-sequence")
    assert mission.agents["quad0"].end is not None
    with pytest.raises(BadInput, match="a cycle never ends"):
        route(mission, "quad0", [Visit(region="hoop0")], 0)


def test_missions_without_a_sequence_are_refused():
    with pytest.raises(BadInput, match="no `sequence`"):
        route_sequence(load_mission("hoops-ltl"))


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"sequence": "h0"}, "lacks its side"),
        ({"sequence": "h1F"}, "not a hoop"),
        ({"hoops": "h0: {center: [0, 0, 1], radii: [0.2, 0, 0.2], opening: 0.25, rim: 0.02}"}, "greater than 0"),
        ({"hoops": "h0: {center: [1.9, 0, 1], radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}"}, "control point"),
    ],
)
def test_missions_with_bad_hoops_are_refused(change, match):
    with pytest.raises(BadInput, match=match):
        small_mission(**change)


def test_a_hoop_named_twice_is_refused():
    text = "h0: {center: [0, 0, 1], radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}"
    with pytest.raises(BadInput, match="duplicate"):
        small_mission(hoops=f"{text}\n{text}")


def test_an_end_inside_the_last_region_is_reached_and_elsewhere_refused():
    text = REGIONS.format(start="[-1, 0, 1]").replace("G F a & G F b, trace: infinite", "F a")
    mission = parse_mission(text.replace("start: [-1, 0, 1]", "start: [-1, 0, 1], end: [0.1, 0, 1]"))
    plan = route(mission, "quad0", [Visit(region="a")])
    assert plan.waypoints[-1].position == (0.1, 0.0, 1.0)
    assert "a" in plan.word.letters[-1]
    with pytest.raises(BadInput, match="lies in or at 'a'"):
        route(mission, "quad0", [Visit(region="b")])
    outside = parse_mission(text.replace("start: [-1, 0, 1]", "start: [-1, 0, 1], end: [-1, 1, 1]"))
    plan = route(outside, "quad0", [Visit(region="a")])
    assert plan.waypoints[-1].position == (-1.0, 1.0, 1.0)
    assert plan.word.letters[-1] == frozenset()


def test_an_end_in_the_hoop_that_is_flown_through_last_is_refused_with_that_reason():
    mission = small_mission(agents="quad0: {start: [-1.2, 0, 1], end: [0.07, 0, 1]}")
    with pytest.raises(BadInput, match="'h0', a hoop that is flown through, and so left again"):
        route_sequence(mission)


def test_control_points_too_near_their_own_ring_are_refused_with_what_to_change():
    hoops = "h0: {center: [0, 0, 1], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02, reach: 0.05}"
    with pytest.raises(Blocked, match="set a larger `reach`") as refused:
        route_sequence(small_mission(hoops=hoops))
    assert refused.value.region == "h0"
