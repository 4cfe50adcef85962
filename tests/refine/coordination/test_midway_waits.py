"""Waits for planned precedences: outside of regions, and kept when robots have to give way to each other afterwards."""

from __future__ import annotations

import numpy as np
import pytest

import verify
from refine import refine
from refine.coordination.midway_waits import with_hovers
from refine.corridor.planned import corridor_of
from refine.corridor.points import with_rests
from refine.feedback import feedback_of
from refine.single_robot.flight import robot_flight
from refine.single_robot.task import Pace, Problem, RefinementOptions
from tests.helpers.few import few_of
from tests.helpers.motion.plans_by_hand import ball, room, straight
from verify.data import BadInput, Mission, Plan
from verify.data.plan import Precedence
from verify.data.sections import Agent
from verify.data.validation.spacing import spacing_of

A, B = (-2.0, 1.0, 1.0), (-2.0, -1.0, 1.0)
REGIONS = {"r0": ball(-1, 1, 0.2), "r1": ball(0.5, 1, 0.2), "s0": ball(-1, -1, 0.2), "s1": ball(2, -1, 0.2)}
WAITS = (Precedence(first=("a", 0), then=("b", 0)), Precedence(first=("b", 1), then=("a", 1)))


def mission() -> Mission:
    return room(REGIONS, {"a": Agent(start=A), "b": Agent(start=B)})


def plan(a_ends: tuple[float, float, float], b_ends: tuple[float, float, float], *via: tuple[float, float, float]) -> Plan:
    a = straight(A, (-1, 1, 1), *via, (0.5, 1, 1), a_ends, visits={1: "r0", 2 + len(via): "r1"})
    b = straight(B, (-1, -1, 1), (2, -1, 1), b_ends, visits={1: "s0", 2: "s1"})
    return Plan(mission=mission(), robots={"a": a, "b": b}, precedences=WAITS)


@few_of(1, "via", [(), ((-0.3, 1.2, 1.0),)])
def test_waits_are_kept_when_robots_give_way_afterwards(via: tuple, pace: Pace) -> None:
    """After b's second visit their ways cross, while a has been waiting for it on the way."""
    asked = plan((2.0, -1.5, 1.0), (2.0, 0.0, 1.0), *via)
    team = refine(asked, pace=pace)
    for name, robot in asked.robots.items():
        end = team[name].evaluate(np.array([team[name].duration]))[0, :3]
        np.testing.assert_allclose(end, robot.waypoints[-1].position, atol=1e-4)
    claims = verify.judge(asked, team, largest=False).claims
    assert [claim.sentence for claim in claims if claim.outcome != "holds"] == []


def test_a_robot_waits_outside_of_the_region_that_others_wait_for_it_to_leave(pace: Pace) -> None:
    asked = plan((0.5, 2.0, 1.0), (2.0, 0.0, 1.0))
    corridor, stops = with_rests(corridor_of(asked.mission, "a", asked.robots["a"]), asked.mission, frozenset({1}))
    assert not REGIONS["r0"].level(corridor.points[stops[1]]) <= 1.0
    assert len(corridor) == 4
    team = refine(asked, pace=pace)
    assert verify.judge(asked, team, largest=False).holds
    left = team["a"].evaluate(np.linspace(0, team["a"].duration, 4000))[:, :3]
    waits = np.all(np.diff(left, axis=0) == 0.0, axis=1)
    assert waits.any() or pace == "nominal"  # then it may come later in the stead of waiting
    assert np.sqrt(REGIONS["r0"].level(left[1:][waits])).min(initial=np.inf) > 1.0


def test_a_course_with_hovers_has_a_leg_for_each_piece() -> None:
    asked = plan((0.5, 2.0, 1.0), (2.0, 0.0, 1.0))
    options = RefinementOptions("nominal", 1000.0, 31, rests=True)
    robot = robot_flight(Problem(asked, feedback_of(asked, ()), options, spacing_of(asked.mission)), "a")
    held = with_hovers(robot, {1: 2.0, 2: 0.0, 3: 0.5})
    assert held.corridor is not None
    assert len(held.corridor) == len(held.path) == len(robot.path) + 2
    np.testing.assert_allclose(held.corridor.points, held.path.nodes, atol=1e-9)
    assert held.path.duration == pytest.approx(robot.path.duration + 2.5)
    assert [piece for piece, duration in enumerate(held.path.durations) if duration in (2.0, 0.5)] == [1, 4]


@pytest.mark.parametrize("visit", [("a", 5), ("a", -1), ("c", 0)])
def test_precedences_of_visits_that_there_are_not_are_named(visit: tuple[str, int]) -> None:
    asked = plan((0.5, 2.0, 1.0), (2.0, 0.0, 1.0))
    wrong = asked.model_copy(update={"precedences": (Precedence(first=visit, then=("b", 0)),)})
    with pytest.raises(BadInput, match=f"visit {visit[1]} of {visit[0]}, which has"):
        refine(wrong)


def test_holds_may_be_long_but_not_endless() -> None:
    asked = plan((0.5, 2.0, 1.0), (2.0, 0.0, 1.0)).model_copy(update={"precedences": ()})
    robots = {name: robot.model_copy(update={"hold": 700.0}) for name, robot in asked.robots.items()}
    held = asked.model_copy(update={"robots": robots})
    assert all(flight.durations[0] == 700.0 for flight in refine(held).values())
    robots["a"] = robots["a"].model_copy(update={"hold": 1e6})
    with pytest.raises(BadInput, match=r"1e\+06 s"):
        refine(asked.model_copy(update={"robots": robots}))
