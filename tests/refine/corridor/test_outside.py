"""Places just outside regions, where robots hover that have left them."""

from __future__ import annotations

import numpy as np
import pytest

from refine.corridor.outside import comes_after, left_last, moved_outside
from refine.obstacles.keep_out_bodies import keep_out
from tests.helpers.motion.plans_by_hand import straight
from verify.data import Plan, Waypoint, parse_mission
from verify.data.plan import Precedence, Role

MISSION = """format: 1
name: outside
spec: {formula: F a}
regions: {a: {center: [0, 0, 1], SHAPE}}
agents: {q: {start: [-1.5, 0, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-2, -2, 0.2], max: [2, 2, 1.8]}
"""


@pytest.mark.parametrize("shape", ["size: [0.4, 1.6, 0.2]", "radii: [0.2, 0.8, 0.1]", "cylinder: {radius: 0.5, height: 0.2}"])
@pytest.mark.parametrize("way", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 1.0, 0.0)])
def test_other_places_lie_no_nearer_to_a_long_region(shape: str, way: tuple[float, float, float]) -> None:
    mission = parse_mission(MISSION.replace("SHAPE", shape))
    body = mission.regions["a"]
    scales = np.linspace(0.0, 2.0, 4001)[:, None]
    ends = np.array([0.0, 0.0, 1.0]) + scales * np.array(way)
    end = ends[np.argmax(body.measures.depths(ends - np.array(body.center)) <= -0.07)]
    x, y, z = end.tolist()
    leg = (Waypoint(position=(0, 0, 1), role="centre", region="a"), Waypoint(position=(x, y, z), role="via", region="a"))
    other = moved_outside(mission, "q", "a", leg, [keep_out("b", end, 0.4, 1.0)])
    assert other is not None
    assert np.linalg.norm(np.array(other.position) - end) >= 0.4
    assert body.level(np.array(other.position)) >= body.level(end) - 1e-6


def test_who_comes_after_whom_follows_precedences_and_own_visits() -> None:
    mission = parse_mission(MISSION.replace("SHAPE", "radii: [0.4, 0.4, 0.2]").replace("{q:", "{p: {start: [1, 1, 1]}, q:"))
    robot = straight((-1.0, 0.0, 1.0), (0.0, 0.0, 1.0), (1.0, 0.0, 1.0), visits={1: "a", 2: "a"})
    waits = (Precedence(first=("p", 0), then=("q", 0)), Precedence(first=("q", 1), then=("p", 1), done="entered"))
    plan = Plan(mission=mission, robots={"p": robot, "q": robot}, precedences=waits)
    assert comes_after(plan, "p", 0) == {("q", 0), ("q", 1)}
    assert comes_after(plan, "p", 1) == comes_after(plan, "q", 0) == set()  # to have entered is not to have left


@pytest.mark.parametrize(
    ("last", "left"),
    [
        ((("centre", "a"), ("via", "a")), "a"),
        ((("centre", "a"), ("via", "a"), ("via", None)), "a"),  # as improved paths end: where the region is left, and outside
        ((("centre", "a"), ("via", None)), "a"),
        ((("centre", "a"),), None),
        ((("centre", "a"), ("end", None)), None),
        ((("centre", "a"), ("via", "b"), ("via", None)), None),
    ],
)
def test_a_region_is_left_last_by_whatever_points_lead_out_of_it(
    last: tuple[tuple[Role, str | None], ...], left: str | None
) -> None:
    mission = parse_mission(MISSION.replace("SHAPE", "radii: [0.4, 0.4, 0.2]"))
    robot = straight(*((-1.0 + 0.5 * i, 0.0, 1.0) for i in range(1 + len(last))), visits={1: "a"})
    points = [
        point.model_copy(update={"role": role, "region": region})
        for point, (role, region) in zip(robot.waypoints[1:], last, strict=True)
    ]
    assert left_last(mission, robot.model_copy(update={"waypoints": (robot.waypoints[0], *points)})) == left
