"""Visits are moved within their regions where another robot hovers at the planned point."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

import verify
from refine import refine
from refine.corridor.meeting_places import moved_apart, moved_to_meet
from refine.corridor.relocation import relocations
from tests.helpers.few import few_of
from tests.helpers.motion.plans_by_hand import ball, room, straight
from verify.data import Infeasible, Plan
from verify.data.sections import Agent
from verify.data.shapes.obstacle import Obstacle
from verify.data.shapes.region import Region


def meeting(radius: float) -> Plan:
    """Two robots that are sent to the same point of one region, where both would hover in the end."""
    starts = {"a": (-1.5, 0.3, 1.0), "b": (-1.5, -0.3, 1.0)}
    mission = room({"goal": ball(1.0, 0.0, radius)}, {name: Agent(start=start) for name, start in starts.items()})
    robots = {name: straight(start, (1.0, 0.0, 1.0), visits={1: "goal"}) for name, start in starts.items()}
    return Plan(mission=mission, robots=robots)


def test_two_robots_sent_to_one_point_end_beside_each_other() -> None:
    plan = meeting(0.8)
    team = refine(plan)
    ends = [flight.evaluate(np.array([flight.duration]))[0, :3] for flight in team.values()]
    assert np.linalg.norm(ends[0] - ends[1]) >= plan.mission.separation
    assert verify.judge(plan, team, largest=False).holds


def test_a_region_without_room_for_two_is_refused() -> None:
    with pytest.raises(Infeasible, match="apart"):
        refine(meeting(0.15))


@pytest.mark.parametrize(("robots", "radius"), [(2, 0.35), (3, 0.35), (4, 0.4)])
@pytest.mark.parametrize("counted", [False, True])
def test_those_who_end_in_a_region_take_places_beside_each_other_where_its_middle_leaves_no_room(
    robots: int, radius: float, counted: bool
) -> None:
    starts = {name: (-1.5, 0.6 * i, 1.0) for i, name in enumerate("abcd"[:robots])}
    mission = room({"goal": ball(1.0, 0.0, radius)}, {name: Agent(start=start) for name, start in starts.items()})
    flights = {name: straight(start, (1.0, 0.0, 1.0), visits={1: "goal"}) for name, start in starts.items()}
    moved = (moved_to_meet if counted else moved_apart)(Plan(mission=mission, robots=flights), 0.42, 1.0)
    last = [robot.waypoints[-1].position for robot in moved.robots.values()]
    assert all(math.dist(one, other) >= 0.42 for one, other in itertools.combinations(last, 2))
    assert all(math.dist(place, (1.0, 0.0, 1.0)) < radius - mission.margin for place in last)


@pytest.mark.parametrize("move", [moved_apart, moved_to_meet])
def test_more_than_a_region_has_places_for_are_refused(move: Callable[[Plan, float, float], Plan]) -> None:
    with pytest.raises(
        Infeasible, match=r"'goal' is too small: 2 robots are to be in it together \(a, b\), and no 2 places 0.600 m"
    ):
        move(meeting(0.35), 0.6, 1.0)


def test_robots_that_meet_exchange_their_places_so_that_ways_are_short() -> None:
    starts = {"a": (-1.5, 0.3, 1.0), "b": (0.9, -1.4, 1.0), "c": (1.1, 1.6, 1.0)}
    mission = room({"goal": ball(1.0, 0.0, 1.0)}, {name: Agent(start=start) for name, start in starts.items()})
    robots = {name: straight(start, (1.0, 0.0, 1.0), visits={1: "goal"}) for name, start in starts.items()}
    plan = Plan(mission=mission, robots=robots)
    found = [moved_to_meet(plan, 0.5, 1.0, nearest=nearest) for nearest in (False, True)]
    places = [[plan.robots[name].waypoints[1].position for name in starts] for plan in found]
    assert sorted(places[0]) == sorted(places[1])
    squares = [sum(math.dist(starts[name], at) ** 2 for name, at in zip(starts, own, strict=True)) for own in places]
    least = min(
        sum(math.dist(start, at) ** 2 for start, at in zip(starts.values(), order, strict=True))
        for order in itertools.permutations(places[0])
    )
    assert squares[1] == pytest.approx(least)
    assert squares[1] < squares[0]


@pytest.mark.parametrize(("radius", "places"), [(1.0, 3), (0.34, 2), (0.2, 1)])
def test_robots_share_places_where_a_region_has_too_few_and_who_ends_there_has_its_own(radius: float, places: int) -> None:
    """Robot a only passes; b ends in the region, and c where there is room for two."""
    starts = {"a": (-1.5, 0.3, 1.0), "b": (0.9, -1.4, 1.0), "c": (1.1, 1.6, 1.0)}
    mission = room({"goal": ball(1.0, 0.0, radius)}, {name: Agent(start=start) for name, start in starts.items()})
    goal, beyond = (1.0, 0.0, 1.0), (2.5, 0.0, 1.0)
    stay = {"a": False, "b": True, "c": places > 1}
    robots = {name: straight(starts[name], goal, *(() if stay[name] else (beyond,)), visits={1: "goal"}) for name in starts}
    moved = moved_to_meet(Plan(mission=mission, robots=robots), 0.5, 1.0)
    at = {name: robot.waypoints[1].position for name, robot in moved.robots.items()}
    assert len(set(at.values())) == places
    ends = [at[name] for name in starts if stay[name]]
    assert all(math.dist(one, other) >= 0.5 for one, other in itertools.combinations(ends, 2))


@pytest.mark.parametrize("robots", [2, 3])
def test_robots_that_end_just_outside_a_region_end_apart_and_outside(robots: int) -> None:
    plan = leaving(robots)
    body = plan.mission.regions["goal"]
    last = [robot.waypoints[-1] for robot in moved_apart(plan, 0.5, 1.0).robots.values()]
    assert last[0] == plan.robots["a"].waypoints[-1]
    assert all(math.dist(one.position, other.position) >= 0.5 for one, other in itertools.combinations(last, 2))
    assert all(body.level(np.array(each.position)) == pytest.approx(body.level(np.array(last[0].position))) for each in last)


def test_who_ends_outside_keeps_clear_of_other_regions() -> None:
    plan = leaving(2)
    near = {"near": ball(1.0, 0.9, 0.35), "far": ball(1.0, -0.9, 0.35)}
    mission = plan.mission.model_copy(update={"regions": {**plan.mission.regions, **near}})
    moved = moved_apart(plan.model_copy(update={"mission": mission}), 0.5, 1.0)
    place = np.array(moved.robots["b"].waypoints[-1].position)
    assert place.tolist() != list(plan.robots["b"].waypoints[-1].position)
    assert all(region.level(place) > 1.0 for region in mission.regions.values())


def leaving(robots: int) -> Plan:
    """Robots that visit one point of a region and leave it for one point just outside, where all would hover in the end."""
    starts = {name: (-1.5, 0.6 - 0.6 * i, 1.0) for i, name in enumerate("abc"[:robots])}
    mission = room({"goal": ball(1.0, 0.0, 0.5)}, {name: Agent(start=start) for name, start in starts.items()})
    flights = {name: straight(start, (1.0, 0.0, 1.0), (1.7, 0.0, 1.0), visits={1: "goal"}) for name, start in starts.items()}
    for name, robot in flights.items():
        last = robot.waypoints[-1].model_copy(update={"region": "goal", "role": "via"})
        flights[name] = robot.model_copy(update={"waypoints": (*robot.waypoints[:-1], last)})
    return Plan(mission=mission, robots=flights)


@few_of(2, "order", list(itertools.permutations(("idle", "guest", "other"))))
def test_a_visit_keeps_clear_of_a_robot_that_never_moves(order: tuple[str, ...]) -> None:
    starts = {"idle": (1.0, 0.35, 1.0), "guest": (-1.5, 0.0, 1.0), "other": (-1.5, 1.5, 1.0)}
    robots = {
        "idle": straight(starts["idle"]),
        "guest": straight(starts["guest"], (1.0, -0.05, 1.0), (2.0, -1.5, 1.0), visits={1: "goal"}),
        "other": straight(starts["other"], (1.0, 2.0, 1.0)),
    }
    mission = room({"goal": ball(1.0, -0.4, 0.6)}, {name: Agent(start=starts[name]) for name in order}, separation=0.4)
    plan = Plan(mission=mission, robots={name: robots[name] for name in order})
    moved = moved_apart(plan, 0.5, 1.0)
    assert np.linalg.norm(np.subtract(moved.robots["guest"].waypoints[1].position, starts["idle"])) > 0.5
    assert moved.robots["other"] == plan.robots["other"]
    assert verify.judge(plan, refine(plan), largest=False).holds


def test_what_is_far_apart_is_left_alone() -> None:
    starts = {"a": (-1.5, 0.3, 1.0), "b": (-1.5, -0.3, 1.0)}
    mission = room(
        {"goal": ball(1.0, 0.0, 0.8)},
        {name: Agent(start=start) for name, start in starts.items()},
    )
    robots = {name: straight(start, (1.0, start[1], 1.0), visits={1: "goal"}) for name, start in starts.items()}
    plan = Plan(mission=mission, robots=robots)
    assert moved_apart(plan, 0.5, 1.0) == plan


def walled(planned: tuple[float, float, float]) -> Plan:
    """A region with a wall in it, a robot that is sent to one side of it, and one that hovers there."""
    starts = {"guest": (-1.5, planned[1], 1.0), "idle": (1.0, -0.5, 1.0)}
    goal = Region.model_validate({"center": (1.0, 0.0, 1.0), "size": (1.8, 1.8, 1.0)})
    mission = room({"goal": goal}, {name: Agent(start=start) for name, start in starts.items()})
    wall = Obstacle.model_validate({"center": (1.0, 0.1, 1.0), "size": (4.0, 0.05, 6.0)})
    robots = {"guest": straight(starts["guest"], planned, visits={1: "goal"}), "idle": straight(starts["idle"])}
    return Plan(mission=mission.model_copy(update={"obstacles": {"wall": wall}}), robots=robots)


@few_of(1, "planned", [(1.0, -0.1, 1.0), (1.1, -0.12, 1.1)])
def test_a_visit_is_not_moved_behind_a_wall(planned: tuple[float, float, float]) -> None:
    """Behind it lie places that are nearer in a straight line, and those that are farthest."""
    plan = walled(planned)
    moved = moved_apart(plan, 0.7, 1.0).robots["guest"].waypoints[1].position
    assert np.linalg.norm(np.subtract(moved, (1.0, -0.5, 1.0))) > 0.7
    assert moved[1] < 0.0
    assert np.linalg.norm(np.subtract(moved, planned)) > 0.45  # to where nothing is taken behind the wall
    others = relocations(plan.mission, "guest", plan.robots["guest"], (), (), 4)
    assert len(others) == 4
    assert all(other.waypoints[1].position[1] < 0.0 for other in others)
