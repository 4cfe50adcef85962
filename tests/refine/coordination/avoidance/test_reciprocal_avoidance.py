"""Robots that departures alone cannot keep apart: they swap places, or one hovers where the other one has to pass."""

from __future__ import annotations

import numpy as np
import pytest

import verify
from refine import refine
from refine.coordination.avoidance.conflict_intervals import mover
from refine.coordination.avoidance.reciprocal_avoidance import avoid_by_rule
from refine.corridor.fitting import fit
from refine.corridor.planned import corridor_of
from refine.single_robot.task import Pace
from tests.helpers.few import few_of
from tests.helpers.motion.plans_by_hand import ball, straight
from verify.data import Infeasible, Mission, Plan, RobotPlan, Trajectory
from verify.data.sections import Agent, Box, Spec
from verify.data.shapes.region import Region
from verify.data.vehicle import load_vehicle

ASKED = 0.4
"""Separation 0.3 m and twice the margin 0.05 m."""


def hall(half: float, robots: dict[str, RobotPlan], regions: dict[str, Region] | None = None, **agent) -> Plan:
    """A hall along x that is so wide to both sides, and low."""
    agents = {name: Agent(start=robot.waypoints[0].position, **agent) for name, robot in robots.items()}
    mission = Mission(
        name="hall",
        spec=Spec(formula="true"),
        regions=regions or {"far": ball(2.7, 0.0, 0.1)},
        agents=agents,
        vehicle=load_vehicle("crazyflie-2.1"),
        workspace=Box(min=(-3.0, -half, 0.85), max=(3.0, half, 1.15)),
    )
    return Plan(mission=mission, robots=robots)


def swap(half: float, **agent) -> Plan:
    return hall(half, {"p": straight((-1.5, 0, 1), (1.5, 0, 1)), "q": straight((1.5, 0, 1), (-1.5, 0, 1))}, **agent)


def certified(plan: Plan, pace: Pace = 0.7) -> dict[str, Trajectory]:
    team = refine(plan, pace=pace)
    certificate = verify.judge(plan, team, largest=False)
    assert [claim.sentence for claim in certificate.claims if claim.outcome != "holds"] == []
    assert all(len(flight) <= 31 and flight.is_float32 for flight in team.values())
    times = np.linspace(0.0, max(flight.duration for flight in team.values()), 4000)
    where = [flight.evaluate(times)[:, :3] for flight in team.values()]
    gaps = [np.linalg.norm(a - b, axis=1).min() for i, a in enumerate(where) for b in where[:i]]
    assert min(gaps) >= ASKED
    return team


@few_of(1, "half", [0.32, 0.7])
@pytest.mark.slow
def test_two_robots_swap_places_through_a_hall(half: float) -> None:
    team = certified(swap(half))
    np.testing.assert_allclose(team["p"].evaluate(100.0)[:3], [1.5, 0, 1], atol=1e-6)
    np.testing.assert_allclose(team["q"].evaluate(100.0)[:3], [-1.5, 0, 1], atol=1e-6)
    if half < 0.4:  # neither could go around the other one alone
        aside = [np.abs(flight.evaluate(np.linspace(0, 7, 2000))[:, 1]).max() for flight in team.values()]
        assert min(aside) > ASKED - (half - 0.05)


@few_of(1, "pace", ["nominal", 0.7])
def test_robots_that_look_ahead_swap_places_within_their_limits(pace: Pace) -> None:
    team = certified(swap(0.45, heading="path"), pace)
    np.testing.assert_allclose(team["p"].evaluate(100.0)[:3], [1.5, 0, 1], atol=1e-6)


@few_of(1, "pace", ["nominal", 0.7])
def test_a_hall_too_narrow_for_two_is_refused(pace: Pace) -> None:
    """Cross-section less the margin: 0.3 by 0.2 m, whose diagonal is shorter than the distance."""
    with pytest.raises(Infeasible, match=r"No departure times keep .* apart, and no giving way does") as caught:
        refine(swap(0.2), pace=pace)
    assert caught.value.witness is not None
    assert caught.value.witness.claim == "separation"


def test_a_robot_that_hovers_in_the_way_steps_aside_and_comes_back() -> None:
    team = certified(hall(0.38, {"p": straight((-1.5, 0, 1), (1.5, 0, 1)), "q": straight((0, 0, 1))}))
    np.testing.assert_allclose(team["q"].evaluate(100.0)[:3], [0, 0, 1], atol=1e-6)
    assert np.abs(team["q"].evaluate(np.linspace(0, 7, 2000))[:, 1]).max() > 0.05


def test_a_robot_that_hovers_in_a_wide_hall_is_flown_around() -> None:
    team = certified(hall(0.9, {"p": straight((-1.5, 0, 1), (1.5, 0, 1)), "q": straight((0, 0, 1))}))
    assert team["q"].duration == 1.0


def test_visits_are_kept_while_giving_way_and_others_depart_later() -> None:
    regions = {"a": ball(-0.8, 0.3, 0.2), "b": ball(0.8, -0.3, 0.2)}
    robots = {
        "p": straight((-1.5, 0, 1), (-0.8, 0.3, 1), (1.5, 0, 1), visits={1: "a"}),
        "q": straight((1.5, 0, 1), (0.8, -0.3, 1), (-1.5, 0, 1), visits={1: "b"}),
        "r": straight((-2.5, 0, 1), (-2.2, 0, 1)),
    }
    team = certified(hall(0.6, robots, regions))
    assert team["r"].duration > 0


@few_of(1, "pace", ["nominal", 0.7])
def test_the_same_encounter_gives_the_same_bytes(pace: Pace) -> None:
    first, second = refine(swap(0.4), pace=pace), refine(swap(0.4), pace=pace)
    assert [flight.digest() for flight in first.values()] == [flight.digest() for flight in second.values()]


def circle(robots: int, across: int) -> Plan:
    """Robots on a circle, each bound for the place of the one so many further; straight ways meet in or near the middle."""
    at = [(1.4 * np.cos(2 * np.pi * k / robots), 1.4 * np.sin(2 * np.pi * k / robots), 1.0) for k in range(robots)]
    return hall(1.6, {f"r{k}": straight(at[k], at[(k + across) % robots]) for k in range(robots)})


@few_of(1, ("robots", "across"), [(3, 1), (6, 3), (5, 2), (4, 2)])
def test_teams_swap_places_across_a_circle(robots: int, across: int) -> None:
    """With even numbers all straight ways cross at one point and each end is another one's start: departures cannot do."""
    plan = circle(robots, across)
    certified(plan)
    nominal = refine(plan, pace="nominal")
    for name, robot in plan.robots.items():
        np.testing.assert_allclose(nominal[name].evaluate(100.0)[:3], robot.waypoints[-1].position, atol=1e-5)


def test_three_robots_give_way_to_each_other_at_once() -> None:
    """Two pairs that swap places share a robot's way: whoever meets an encounter joins it."""
    at = [(1.4 * np.cos(a), 1.4 * np.sin(a), 1.0) for a in (0.0, 2.1, 4.2)]
    flown = {f"r{k}": straight(at[k], at[(k + 1) % 3]) for k in range(3)}
    movers = tuple(
        mover(corridor_of(plan.mission, name, robot), fit(corridor_of(plan.mission, name, robot)), 0.0, frozenset())
        for plan in [hall(1.6, flown)]
        for name, robot in plan.robots.items()
    )
    tight = next(avoid_by_rule(movers, 1.6, 1.0))
    times = np.linspace(0.0, 1.0, 400)
    where = [path.sample(times).reshape(-1, 3) for path in tight]
    assert len({len(points) for points in where}) == 1
    gaps = [np.linalg.norm(a - b, axis=1).min() for i, a in enumerate(where) for b in where[:i]]
    assert min(gaps) >= 1.6 - 1e-3
    straight_gaps = [
        np.linalg.norm(a.path.sample(times).reshape(-1, 3) - b.path.sample(times).reshape(-1, 3), axis=1).min()
        for i, a in enumerate(movers)
        for b in movers[:i]
    ]
    assert min(straight_gaps) < 1.6


@few_of(1, "pace", ["nominal", 0.7])
def test_robots_with_the_same_goal_region_take_turns_in_it(pace: Pace) -> None:
    regions = {"goal": ball(0.0, 0.0, 0.3)}
    robots = {
        f"r{k}": straight((1.4 * x, 1.4 * y, 1), (0.1 * x, 0.1 * y, 1), (-1.4 * y, 1.4 * x, 1.05), visits={1: "goal"})
        for k, (x, y) in enumerate([(1.0, 0.1), (-0.1, 1.0), (-1.0, -0.1), (0.3, -1.0)])
    }
    team = certified(hall(1.8, robots, regions), pace)
    times = np.linspace(0.0, max(flight.duration for flight in team.values()), 4000)
    inside = [np.linalg.norm(flight.evaluate(times)[:, :3] - [0.0, 0.0, 1.0], axis=1) <= 0.3 for flight in team.values()]
    assert all(np.any(one) for one in inside)


@few_of(1, "pace", ["nominal", 0.7])
def test_a_team_too_large_for_its_hall_is_refused_with_names_time_and_distance(pace: Pace) -> None:
    crowd = {"p": straight((-1.5, 0, 1), (1.5, 0, 1)), "q": straight((1.5, 0, 1), (-1.5, 0, 1)), "r": straight((0, 0, 1))}
    with pytest.raises(Infeasible, match=r"they come within [\d.]+ m at [\d.]+ s, 0\.401 m is needed") as caught:
        refine(hall(0.2, crowd), pace=pace)
    witness = caught.value.witness
    assert witness is not None
    assert {witness.robot, witness.other} <= {"p", "q", "r"}
    assert witness.time is not None
    assert witness.limit == pytest.approx(0.4005)
