"""Many robots that fly at once: those that meet swerve, all together, and nobody waits."""

from __future__ import annotations

import math

import numpy as np
import pytest

import verify
from refine import refine
from refine.coordination.avoidance.conflict_intervals import cut_legs, mover
from refine.coordination.avoidance.joint_bending import Beginning, bend_apart
from refine.corridor.fitting import fit
from refine.corridor.planned import corridor_of
from refine.single_robot.task import Pace
from tests.helpers.motion.plans_by_hand import ball, straight
from verify.data import Infeasible, Mission, Plan, RobotPlan, Trajectory
from verify.data.sections import Agent, Box, Spec
from verify.data.validation.spacing import Spacing
from verify.data.vehicle import load_vehicle

Point = tuple[float, float, float]


def hall(robots: dict[str, RobotPlan], half: Point = (6.0, 6.0, 1.5)) -> Plan:
    """A hall around (0, 0, 2) that reaches so far to all sides."""
    agents = {name: Agent(start=robot.waypoints[0].position) for name, robot in robots.items()}
    low, high = ((-half[0], -half[1], 2 - half[2]), (half[0], half[1], 2 + half[2]))
    mission = Mission(
        name="hall",
        spec=Spec(formula="true"),
        regions={"far": ball(half[0] - 0.2, 0.0, 0.1)},
        agents=agents,
        vehicle=load_vehicle("crazyflie-2.1"),
        workspace=Box(min=low, max=high),
    )
    return Plan(mission=mission, robots=robots)


def circle(count: int, radius: float) -> dict[str, RobotPlan]:
    """Robots that fly to the opposite sides of a circle, all through its middle."""
    angles = 2 * math.pi * np.arange(count) / count
    sides = np.stack([radius * np.cos(angles), radius * np.sin(angles)], axis=1).round(4).tolist()
    return {f"q{i}": straight((x, y, 2.0), (-x, -y, 2.0)) for i, (x, y) in enumerate(sides)}


def longest(team: dict[str, Trajectory]) -> float:
    return max(flight.duration for flight in team.values())


def refused(plan: Plan, team: dict[str, Trajectory]) -> list[str]:
    return [claim.sentence for claim in verify.judge(plan, team, largest=False).claims if claim.outcome != "holds"]


@pytest.mark.slow
def test_robots_on_a_circle_change_sides_at_once_and_whoever_meets_nobody_flies_on() -> None:
    lone = straight((-2.0, -5.0, 2.0), (0.0, -5.0, 2.0))
    plan = hall({**circle(6, 1.5), "lone": lone})
    team = refine(plan)
    assert refused(plan, team) == []
    alone = {name: refine(hall({name: robot}))[name] for name, robot in plan.robots.items() if name in ("q0", "lone")}
    assert longest(team) <= 1.1 * alone["q0"].duration
    assert team["lone"].digest() == alone["lone"].digest()
    again = refine(plan)
    assert all(team[name].digest() == again[name].digest() for name in team)


def test_whoever_rests_where_another_flies_arrives_with_it(pace: Pace) -> None:
    """The short flights end, each, where a long one passes by later, in a hall too narrow to pass."""
    ends = {f"s{i}": straight((i - 2.0, 0.0, 2.0), (i - 1.4, 0.0, 2.0)) for i in range(4)}
    plan = hall({"long": straight((-4.0, 0.0, 2.0), (4.0, 0.0, 2.0)), **ends}, (6.0, 0.8, 0.4))
    assert refused(plan, refine(plan, pace=pace)) == []


@pytest.mark.slow
@pytest.mark.parametrize("count", [5, 18])
def test_two_robots_that_nothing_parts_are_named(count: int) -> None:
    """Robots that turn the order around in which they stand in a tube, where no two of them pass."""
    places = np.linspace(-5.0, 5.0, count + count % 2).tolist()[:count]
    robots = {f"q{i}": straight((x, 0.0, 2.0), (-x, 0.0, 2.0)) for i, x in enumerate(places)}
    with pytest.raises(Infeasible, match=r"No departure times keep q\d+ and q\d+ apart") as caught:
        refine(hall(robots, (6.0, 0.15, 0.15)))
    assert caught.value.witness is not None
    assert caught.value.witness.claim == "separation"
    assert caught.value.witness.other in robots


def test_bent_points_keep_what_is_not_free_and_the_distance() -> None:
    plan = hall(circle(5, 1.5))
    movers = []
    for name, robot in plan.robots.items():
        corridor = corridor_of(plan.mission, name, robot)
        movers.append(cut_legs(mover(corridor, fit(corridor), 0.0, frozenset()), [8]))
    right, left = bend_apart(movers, Spacing(0.4, 1.0), Beginning(0.02, 2, 0.2))
    for bent in (right, left):
        assert bent.least >= 0.4
        for each, points in zip(movers, bent.points, strict=True):
            assert np.array_equal(points[[0, -1]], each.path.nodes[[0, -1]])
            assert not np.allclose(points[1:-1], each.path.nodes[1:-1], atol=0.01)
    assert not np.allclose(right.points[0], left.points[0], atol=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("count", "radius"), [(20, 3.0), (12, 1.2), (40, 6.0)])
def test_many_robots_change_sides_within_a_tenth_of_one_alone(count: int, radius: float) -> None:
    plan = hall(circle(count, radius), (radius + 2.0, radius + 2.0, 1.8))
    team = refine(plan)
    assert refused(plan, team) == []
    assert longest(team) <= 1.1 * refine(hall({"q0": plan.robots["q0"]}, (radius + 2.0, 1.0, 1.0)))["q0"].duration
