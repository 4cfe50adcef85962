"""Paths around walls, through doors and openings: clear by the vehicle's radius and the margin, told by samples and school geometry."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from refine import refine
from refine.corridor.legs import space_for
from refine.corridor.planned import corridor_of, hovering_corridor
from refine.corridor.relocation import moved_into_the_clear
from refine.obstacles.solid_body import SolidBody, solid_bodies
from tests.helpers.few import few_of
from tests.helpers.missions.rooms_by_hand import MARGIN, Box, along, from_boxes, passage, sampled, walled
from tests.helpers.motion.plans_by_hand import robot_plan
from tests.helpers.motion.solids import random_solid
from verify.data import Infeasible, Plan, Visit, Waypoint, parse_mission
from verify.data.shapes.obstacle import Obstacle

NEED = 0.07 + MARGIN
"""m: radius of the vehicle and margin."""
NEAR = NEED + 2e-3
"""m: where plans turn corners."""

CORNER: dict[str, Box] = {"wall": ((0, -1, 1), (0.05, 4.9, 4))}
DOOR: dict[str, Box] = {"left": ((0, -1.585, 1), (0.1, 2.83, 2)), "right": ((0, 1.585, 1), (0.1, 2.83, 2))}
NARROW: dict[str, Box] = {"left": ((0, -1.5614, 1), (0.1, 2.8772, 2)), "right": ((0, 1.5614, 1), (0.1, 2.8772, 2))}
ANGLE: dict[str, Box] = {
    "low": ((0, -0.25, 1), (6, 0.2, 2)),
    "up": ((-1.65, 1.65, 1), (3, 3, 2)),
    "right": ((0.25, 1.4, 1), (0.2, 3.2, 2)),
}
PIPE: dict[str, Box] = {
    "left": ((0, -0.63, 1), (3, 1, 2)),
    "right": ((0, 0.63, 1), (3, 1, 2)),
    "above": ((0, 0, 1.63), (3, 1, 1)),
    "below": ((0, 0, 0.37), (3, 1, 1)),
}
ROOMS = {
    "around the end of a wall": (
        CORNER,
        (-2, -2, 1),
        (2, 2, 1),
        [(-0.025 - NEAR, 1.45 + NEAR, 1), (0.025 + NEAR, 1.45 + NEAR, 1)],
    ),
    "a door, 10 cm wider than needed": (
        DOOR,
        (-2, -2, 1),
        (2, 2, 1),
        [(-0.05 - NEAR, -0.17 + NEAR, 1), (0.05 + NEAR, 0.17 - NEAR, 1)],
    ),
    "a door, 5 mm wider than needed": (NARROW, (-2, -2, 1), (2, 2, 1), [(-0.05 - NEAR, 0, 1), (0.05 + NEAR, 0, 1)]),
    "a corridor with a right angle": (ANGLE, (-2, 0, 1), (0, 2, 1), [(0, 0, 1)]),
    "a pipe that the robot nearly fills": (PIPE, (-2, 0, 1), (2, 0, 1), [(-1.7, 0, 1), (1.7, 0, 1)]),
    "points whose straight legs cut the corner": (CORNER, (-2, -2, 1), (2, 2, 1), [(-0.3, 1.5, 1), (0.3, 1.5, 1)]),
    "no guide around a wall": (CORNER, (-2, -2, 1), (2, 2, 1), []),
}


@few_of(2, "which", ROOMS)
def test_paths_stay_clear_of_walls(which: str) -> None:
    walls, start, goal, guides = ROOMS[which]
    flight = refine(along(walled(walls, start=start, goal=goal), *guides))["q"]
    assert from_boxes(sampled(flight), walls) >= NEED
    assert np.linalg.norm(sampled(flight)[-1] - goal) < 0.2


@pytest.mark.slow  # a nonlinear programme each
@pytest.mark.parametrize("which", ["around the end of a wall", "a corridor with a right angle"])
def test_the_fastest_path_stays_clear_too(which: str) -> None:
    walls, start, goal, guides = ROOMS[which]
    plan = along(walled(walls, start=start, goal=goal), *guides)
    flight = refine(plan, pace="time")["q"]
    assert from_boxes(sampled(flight), walls) >= NEED
    assert flight.duration < refine(plan)["q"].duration


def turned(point: Sequence[float]) -> tuple[float, float, float]:
    """A quarter turn about z."""
    return (-point[1], point[0], point[2])


@pytest.mark.parametrize("which", ["around the end of a wall", "a corridor with a right angle"])
def test_a_turned_room_gives_a_turned_flight(which: str) -> None:
    walls, start, goal, guides = ROOMS[which]
    other: dict[str, Box] = {name: (turned(at), (size[1], size[0], size[2])) for name, (at, size) in walls.items()}
    flight = refine(along(walled(walls, start=start, goal=goal), *guides))["q"]
    again = refine(along(walled(other, start=turned(start), goal=turned(goal)), *map(turned, guides)))["q"]
    assert again.duration == pytest.approx(flight.duration, rel=1e-6)
    points = sampled(flight, 100)
    assert np.allclose(sampled(again, 100), np.stack([-points[:, 1], points[:, 0], points[:, 2]], axis=1), atol=1e-4)


def test_a_wall_of_two_halves_is_flown_around_as_the_whole_one_is() -> None:
    _, start, goal, guides = ROOMS["around the end of a wall"]
    whole = walled(CORNER, start=start, goal=goal)
    halves = {"union": [{"center": [0, y, 1], "size": [0.05, 2.45, 4]} for y in (-2.225, 0.225)]}
    parted = whole.model_copy(update={"obstacles": {"wall": Obstacle.model_validate(halves)}})
    one, other = (refine(along(mission, *guides))["q"] for mission in (whole, parted))
    assert other.duration == pytest.approx(one.duration, rel=1e-6)
    assert from_boxes(sampled(other), CORNER) >= NEED


HOOP = "hoops: {{gate: {{center: [0, 0, 1], radii: [0.25, 0.25, 0.25], opening: {opening}, rim: 0.02, reach: {reach}}}}}"


@few_of(1, ("thick", "opening", "reach"), [(0.05, 0.2, 0.4), (0.05, 0.13, 0.4), (0.6, 0.2, 0.42), (0.6, 0.2, 0.5)])
def test_a_wall_with_an_opening_is_passed_through_it_alone(thick: float, opening: float, reach: float) -> None:
    walls: dict[str, Box] = {"wall": ((0, 0, 1), (thick, 5.9, 2))}
    more = HOOP.format(opening=opening, reach=reach)
    mission = walled(walls, start=(-1.5, -1.5, 1), goal=(1.5, 1.5, 1), more=more, hole="gate")
    points = sampled(refine(along(mission, *passage("gate", 0.0, reach)))["q"])
    beside = np.abs(points[:, 0]) < thick / 2 + NEED
    far = np.linalg.norm(points[beside, 1:] - (0, 1), axis=1)
    assert beside.any()
    in_it = np.abs(points[:, 0]) < thick / 2
    assert np.linalg.norm(points[in_it, 1:] - (0, 1), axis=1).max() <= opening - NEED
    ahead = np.maximum(np.abs(points[beside, 0]) - thick / 2, 0.0)
    assert np.all(np.hypot(ahead, np.maximum(opening - far, 0.0)) >= NEED - 1e-9)


@few_of(1, "legs_drawn", [16, 40])
def test_a_plane_parts_a_leg_from_each_grown_part_wherever_they_lie_apart(legs_drawn: int) -> None:
    rng = np.random.default_rng(3)
    mission = walled(CORNER, start=(-2, -2, 1), goal=(2, 2, 1))
    parted = met = 0
    for _ in range(legs_drawn):
        data, holds = random_solid(rng)
        bodies = solid_bodies(mission.model_copy(update={"obstacles": {"a": Obstacle.model_validate(data)}}), 0.15)
        a, b = rng.uniform([-2, -2, 0], [2, 2, 2], (2, 3))
        legs = a + np.linspace(0, 1, 60)[:, None] * (b - a)
        pushes = rng.normal(size=(10, 60, 3))
        reached = (legs + 0.15 * pushes / np.linalg.norm(pushes, axis=2, keepdims=True)).reshape(-1, 3)
        planes = [body.plane(a, b) for body in bodies]
        outside = np.min([body.signed_distance(legs) for body in bodies], axis=0)
        if all(plane is not None for plane in planes):
            parted += 1
            assert np.all(holds(reached) < 1e-9)
            assert outside.min() > -1e-9
            points = rng.uniform([-2, -2, 0], [2, 2, 2], (2000, 3))
            inside = points[holds(points) >= 0]
            for plane in planes:
                assert plane is not None
                assert min(plane.normal @ a, plane.normal @ b) >= plane.offset
            assert np.all(np.any([inside @ p.normal < p.offset - 0.15 + 1e-9 for p in planes if p is not None], axis=0))
        else:
            met += 1
            assert outside.min() < 5e-3
    assert parted > legs_drawn // 10
    assert met > legs_drawn // 10


def test_far_obstacles_change_nothing() -> None:
    far: dict[str, Box] = {
        f"far{k}": ((x, y, 1), (0.1, 0.1, 1)) for k, (x, y) in enumerate([(-2.5, 2.5), (2.5, -2.5), (0, 2.8)])
    }
    guides = [(-0.2, 1.6, 1), (0.2, 1.6, 1)]
    alone, more = (
        refine(along(walled(walls, start=(-2, -2, 1), goal=(2, 2, 1)), *guides))["q"] for walls in (CORNER, {**CORNER, **far})
    )
    assert alone.coefficients.tobytes() == more.coefficients.tobytes()


def test_a_point_in_a_wall_is_refused_by_name() -> None:
    plan = along(walled(CORNER, start=(-2, -2, 1), goal=(2, 2, 1)), (-0.1, 0, 1))
    with pytest.raises(Infeasible, match=r"waypoint .* too near to obstacle wall") as refusal:
        refine(plan)
    assert refusal.value.witness is not None
    assert refusal.value.witness.claim == "obstacles"


def test_a_robot_that_hovers_beside_a_wall_may_not_step_into_it() -> None:
    mission = walled(CORNER, start=(-2, -2, 1), goal=(2, 2, 1))
    for x in (-0.025 - NEED - 2e-4, -1.0):
        corridor = hovering_corridor(mission, "q", np.array([x, 0.0, 1.0]), 3)
        for leg in corridor.legs:
            assert [body.name for body in leg.obstacles if body.name.startswith("obstacle")] == ["obstacle wall"]


@pytest.mark.slow
def test_visits_move_out_of_obstacles() -> None:
    mission = walled({"post": ((2, 2.1, 1), (0.1, 0.1, 2))}, start=(-2, -2, 1), goal=(2, 2, 1))
    mission = mission.changed(regions={"goal": mission.regions["goal"].changed(center=(2.0, 1.8, 1.0))})
    robot = along(mission).robots["q"]
    at = robot.waypoints[-1].model_copy(update={"position": (2.0, 1.95, 1.0)})
    moved = moved_into_the_clear(mission, "q", robot_plan([robot.waypoints[0], at], robot.visits)).waypoints[-1]
    assert from_boxes(np.array([moved.position]), {"post": ((2, 2.1, 1), (0.1, 0.1, 2))}) >= NEED
    assert mission.regions["goal"].level(np.array(moved.position)) < 1


def test_witnesses_ask_for_more_room() -> None:
    plan = along(walled(CORNER, start=(-2, -2, 1), goal=(2, 2, 1)), (-0.3, 1.7, 1), (0.3, 1.7, 1))
    mission = plan.mission
    wide = corridor_of(mission, "q", plan.robots["q"], clearance=0.011)
    assert all(
        body.growth == pytest.approx(NEED + 0.011) for leg in wide.legs for body in leg.obstacles if isinstance(body, SolidBody)
    )
    assert len(space_for(mission, "q", 0.0).bodies.solids) == 1


TWO = """
format: 1
name: two
spec: {formula: F west & F east}
regions: {west: {center: [-2, 0, 1], size: [0.8, 0.8, 0.6]}, east: {center: [2, 0, 1], size: [0.8, 0.8, 0.6]}}
agents: {a: {start: [-2, 0.2, 1]}, b: {start: [2, -0.2, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-3, -0.6, 0.6], max: [3, 0.6, 1.4]}
separation: 0.15
margin: 0.05
obstacles:
  top: {center: [0, 0.55, 1], size: [0.3, 0.3, 2]}
  bottom: {center: [0, -0.55, 1], size: [0.3, 0.3, 2]}
"""


def test_two_robots_that_change_places_through_a_gap_stay_clear_of_its_sides() -> None:
    mission = parse_mission(TWO)
    robots = {}
    for name, own, other, x in (("a", "west", "east", -2.0), ("b", "east", "west", 2.0)):
        points = [
            Waypoint(position=mission.agents[name].start, role="start", region=own, visit=0),
            Waypoint(position=(-x, mission.agents[name].start[1], 1.0), role="centre", region=other, visit=1),
        ]
        robots[name] = robot_plan(points, (Visit(region=own), Visit(region=other)))
    team = refine(Plan(mission=mission, robots=robots))
    walls: dict[str, Box] = {"top": ((0, 0.55, 1), (0.3, 0.3, 2)), "bottom": ((0, -0.55, 1), (0.3, 0.3, 2))}
    for name, flight in team.items():
        points = sampled(flight)
        assert from_boxes(points, walls) >= NEED
        assert abs(points[-1, 0] - (2.0 if name == "a" else -2.0)) < 0.4
