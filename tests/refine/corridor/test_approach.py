"""Places in front of an opening that is not flown through: what is clear of rim and opening can be flown from and to."""

from __future__ import annotations

import numpy as np
import pytest

import verify
from refine import refine
from refine.corridor.planned import corridor_of
from tests.helpers.motion.plans_by_hand import ball, robot_plan, room, straight, through
from verify.data import Infeasible, Mission, Plan, Visit, Waypoint
from verify.data.sections import Agent
from verify.data.shapes.region import Hoop

GATE = Hoop(center=(0.0, 0.0, 1.2), radii=(0.05, 0.05, 0.05), opening=0.4, rim=0.02)  # flown through along x


def assert_certified(mission: Mission, plan: Plan) -> None:
    certificate = verify.judge(plan, refine(plan), largest=False)
    assert [claim.sentence for claim in certificate.claims if claim.outcome != "holds"] == []


def hall(start: tuple[float, float, float], **hoops: Hoop) -> Mission:
    return room({"goal": ball(2.0, 0.5)}, {"q": Agent(start=start)}, hoops={"gate": GATE, **hoops}, margin=0.02)


@pytest.mark.parametrize("side", [-1, 1])
def test_a_flight_may_begin_in_front_of_an_opening(side: int) -> None:
    start = (0.08 * side, 0.15, 1.3)
    mission = hall(start)
    plan = Plan(mission=mission, robots={"q": straight(start, (2.0, 0.5, 1.0), visits={1: "goal"})})
    corridor = corridor_of(mission, "q", plan.robots["q"])
    assert corridor.points[1][0] * side > 0.1  # straight out first, whichever way the goal is
    np.testing.assert_allclose(corridor.points[1][1:], start[1:])
    assert_certified(mission, plan)


def test_a_flight_may_end_there_and_turn_within_it() -> None:
    start, first, last = (2.0, -1.0, 1.0), (0.06, -0.1, 1.2), (0.08, 0.1, 1.25)
    mission = hall(start)
    plan = Plan(mission=mission, robots={"q": straight(start, first, last)})
    legs = corridor_of(mission, "q", plan.robots["q"]).legs
    assert [len(leg.approaches) for leg in legs][-2:] == [1, 1]
    assert_certified(mission, plan)


@pytest.mark.slow
def test_a_passage_may_set_out_from_the_bay_of_another_hoop() -> None:
    """Its rear control point is 0.08 m in front of the first hoop's opening."""
    start = (-2.0, 0.0, 1.0)
    other = Hoop(center=(0.32, 0.3, 1.2), radii=(0.05, 0.05, 0.05), yaw_deg=62.0, opening=0.4, rim=0.02, reach=0.35)
    second = other.model_copy(update={"center": tuple(np.array([0.08, 0.0, 1.2]) + 0.35 * np.array(other.normal))})
    mission = hall(start, second=second)
    plan = Plan(mission=mission, robots={"q": through(mission, "q", [("second", "F")])})
    assert any(leg.approaches and leg.cylinder is not None for leg in corridor_of(mission, "q", plan.robots["q"]).legs)
    assert_certified(mission, plan)


def test_the_control_points_of_a_short_reach_lie_in_the_bay_of_their_own_hoop() -> None:
    start = (-2.0, 0.0, 1.0)
    short = GATE.model_copy(update={"reach": 0.09})
    mission = room({"goal": ball(2.0, 0.5)}, {"q": Agent(start=start)}, hoops={"gate": short}, margin=0.02)
    assert_certified(mission, Plan(mission=mission, robots={"q": through(mission, "q", [("gate", "F")])}))


def test_a_passage_between_two_approach_corridors_that_meet() -> None:
    """Three gates in a row, so near each other that the passage of the middle one is all in the approach corridors of the others."""
    gates = {
        name: Hoop(center=(x, 0.0, 1.2), radii=(0.018, 0.018, 0.018), opening=0.4, rim=0.02, reach=0.06)
        for name, x in (("first", 0.0), ("middle", 0.12), ("last", 0.206))
    }
    start = (0.06, 0.0, 1.2)
    mission = room({"goal": ball(2.0, 0.5)}, {"q": Agent(start=start)}, hoops=gates, margin=0.007)
    plan = Plan(mission=mission, robots={"q": through(mission, "q", [("middle", "F")])})
    assert [len(leg.approaches) for leg in corridor_of(mission, "q", plan.robots["q"]).legs] == [2, 1]
    path = refine(plan, pace="nominal")["q"].evaluate(np.linspace(0.0, 3.0, 999))[:, :3]  # else its end may move
    assert np.linalg.norm(path[:, 1:] - start[1:], axis=1).max() < 1e-3
    assert (path[0, 0], path[-1, 0]) == pytest.approx((0.06, 0.18), abs=1e-3)


@pytest.mark.parametrize(
    ("place", "said"),
    [((0.01, 0.1, 1.2), "0.0100 m from the opening of 'gate'"), ((0.05, 0.0, 1.55), "from the rim of 'gate'")],
)
def test_a_point_in_the_opening_or_at_the_rim_is_named(place: tuple[float, float, float], said: str) -> None:
    start = (2.0, -1.0, 1.0)
    mission = hall(start)
    points = [Waypoint(position=start, role="start"), Waypoint(position=place, role="end")]
    with pytest.raises(Infeasible, match=said):
        refine(Plan(mission=mission, robots={"q": robot_plan(points)}))


def test_an_end_in_the_opening_just_passed_is_refused_at_once() -> None:
    start = (-2.0, 0.0, 1.0)
    mission = hall(start)
    passing = through(mission, "q", [("gate", "F")])
    points = [*passing.waypoints, Waypoint(position=(0.01, 0.1, 1.2), role="end")]
    plan = Plan(mission=mission, robots={"q": robot_plan(points, (Visit(region="gate", direction="F"),))})
    with pytest.raises(Infeasible, match=r"0\.0100 m from the opening of 'gate'"):
        refine(plan)
