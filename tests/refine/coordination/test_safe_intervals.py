"""Waits on the way: the search over (point, time) is held to trying all waits, and its flights to the judge."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import verify
from refine import refine, split
from refine.coordination import safe_intervals
from refine.coordination.departures import GRID, Orders
from refine.feedback import feedback_of
from refine.single_robot.flight import robot_flight
from refine.single_robot.task import Problem, RefinementOptions, RobotFlight
from tests.helpers.few import few_of
from tests.helpers.motion.plans_by_hand import ball, robot_plan, room, straight, through
from tests.helpers.motion.random_plans import random_plan
from verify.data import Infeasible, Plan, Waypoint
from verify.data.sections import Agent
from verify.data.shapes.region import Hoop
from verify.data.validation.spacing import Spacing

SPACING = Spacing(0.4, 1.0)
WAITS = np.arange(12) * 4 * GRID
RESTS = RefinementOptions("nominal", 1000.0, 31, rests=True)


def robots(seed: int) -> dict[str, RobotFlight]:
    """Two robots on polylines that cross somewhere, at rest at each corner, on the grid of times."""
    rng = np.random.default_rng(seed)
    corners = {name: np.c_[rng.uniform(-1.2, 1.2, size=(3, 2)), np.ones(3)] for name in ("a", "b")}
    mission = room({"far": ball(2.5, 2.5)}, {name: Agent(start=tuple(points[0])) for name, points in corners.items()})
    plan = Plan(mission=mission, robots={name: straight(*points) for name, points in corners.items()})
    alone = {name: robot_flight(Problem(plan, feedback_of(plan, ()), RESTS, SPACING), name) for name in corners}
    return {name: safe_intervals.on_time_grid(mission, robot) for name, robot in alone.items()}


def end_of(robot: RobotFlight, waits: np.ndarray) -> float:
    return float(waits.sum() + robot.path.duration)


@few_of(4, "seed", range(12))
def test_no_waits_end_earlier_than_those_that_are_found(seed: int) -> None:
    first, second = robots(seed).values()
    steps = int(np.ceil((first.path.duration + second.path.duration + 2 * WAITS.max()) / GRID)) + 2
    track = safe_intervals.track_of(first, np.array([0.0, 1.5]), steps, SPACING)
    found = safe_intervals.earliest_waits(second, [track], steps, SPACING)

    def keeps_apart(waits: np.ndarray) -> bool:
        points, reach, _ = safe_intervals.track_of(second, waits, steps, SPACING)
        gap = np.linalg.norm(points - track[0], axis=1) - reach - track[1]
        return bool(gap.min() >= SPACING.distance + safe_intervals.SCHEDULE_CLEARANCE)

    tried = [np.array(waits) for waits in itertools.product(WAITS, repeat=2)]
    good = [end_of(second, waits) for waits in tried if keeps_apart(waits)]
    if found is None:
        assert not good
        return
    points, *_ = safe_intervals.track_of(second, found, steps, SPACING)
    assert np.linalg.norm(points - track[0], axis=1).min() >= SPACING.distance
    assert end_of(second, found) <= min(good, default=np.inf)


def test_some_of_these_need_waits_and_some_cannot_be_helped() -> None:
    """The test above would pass on pairs that never meet."""
    kinds = set()
    for seed in range(12):
        first, second = robots(seed).values()
        steps = int(np.ceil((first.path.duration + second.path.duration + 2 * WAITS.max()) / GRID)) + 2
        track = safe_intervals.track_of(first, np.array([0.0, 1.5]), steps, SPACING)
        found = safe_intervals.earliest_waits(second, [track], steps, SPACING)
        kinds.add("none" if found is None else "on the way" if found[1] > 0.0 else "at the start" if found[0] > 0.0 else "free")
    assert kinds >= {"none", "free", "at the start"}


@pytest.mark.slow
def test_a_team_that_only_waits_can_part_is_flown() -> None:
    """Each robot's last place is on the other one's way out of a hoop, in opposite orders."""
    plan = random_plan(979)
    team = refine(plan)
    hovers = [
        name
        for name, flight in team.items()
        if any(not flight.coefficients[piece, :3, 1:].any() for piece in range(1, len(flight)))
    ]
    assert hovers == ["q1"]
    assert verify.judge(plan, team, largest=False).holds


def test_a_plan_that_no_waits_can_mend_is_refused() -> None:
    """Two robots that are to end at one point, which is no region that has room for both."""
    starts = {"a": (-1.5, 0.3, 1.0), "b": (-1.5, -0.3, 1.0)}
    mission = room({"far": ball(2.5, 2.5)}, {name: Agent(start=start) for name, start in starts.items()})
    plan = Plan(mission=mission, robots={name: straight(start, (1.0, 0.0, 1.0)) for name, start in starts.items()})
    with pytest.raises(Infeasible, match=r"[ab] and [ab] end 0\.0000 m from each other; 0\.401 m is needed"):
        refine(plan)


@pytest.mark.slow
def test_a_team_that_only_waits_can_part_is_flown_at_the_plans_own_times_with_a_note() -> None:
    plan, said = random_plan(979), list[str]()
    team, nominal = refine(plan, pace="time", note=said.append), refine(plan, pace="nominal")
    assert verify.judge(plan, team, largest=False).holds
    assert max(each.duration for each in team.values()) <= max(each.duration for each in nominal.values())
    assert any("plan's own times" in sentence for sentence in said)


@pytest.mark.slow
def test_flights_that_may_rest_are_split_where_they_wait() -> None:
    plan = random_plan(979)
    team = refine(plan, max_pieces=5, too_long="rest")
    assert max(len(flight) for flight in team.values()) > 5
    parts = {name: split(flight, 5) for name, flight in team.items()}
    assert all(len(part) <= 5 for cut in parts.values() for part in cut)
    assert verify.judge(plan, team, largest=False).holds


def test_one_that_hovers_with_a_hold_of_its_own_is_no_obstacle() -> None:
    starts = {"a": (-1.5, 0.0, 1.0), "b": (1.5, 1.5, 1.0)}
    mission = room({"far": ball(2.5, 2.5)}, {name: Agent(start=start) for name, start in starts.items()})
    idle = straight(starts["b"]).model_copy(update={"hold": 2.0})
    plan = Plan(mission=mission, robots={"a": straight(starts["a"], (1.0, 0.0, 1.0)), "b": idle})
    alone = {name: robot_flight(Problem(plan, feedback_of(plan, ()), RESTS, SPACING), name) for name in starts}
    found = safe_intervals.schedule_safe_intervals(plan, [alone], SPACING, 31)
    assert found is not None
    assert found[1] == {"a": 0.0, "b": 2.0}


@pytest.mark.slow
def test_robots_far_away_do_not_keep_two_from_parting() -> None:
    """One ends in front of a gate that the other has to pass first; a plan of many robots has too many orders to try all."""
    gate = Hoop(center=(0.0, 0.0, 1.2), radii=(0.05, 0.05, 0.05), opening=0.4, rim=0.02)
    starts = {"q0": (1.5, 1.5, 1.2), "q1": (-2.0, 0.0, 1.2)}
    starts |= {f"far{i}": (-2.0 + i, -2.5, 1.2) for i in range(4)}
    mission = room(
        {"far": ball(2.5, 2.5)}, {name: Agent(start=start) for name, start in starts.items()}, hoops={"gate": gate}, margin=0.02
    )
    robots = {name: straight(start, (start[0], -2.0, 1.2)) for name, start in starts.items()}
    robots["q0"] = straight(starts["q0"], (0.3, 0.0, 1.2))
    passing = through(mission, "q1", [("gate", "F")])
    points = [*passing.waypoints, Waypoint(position=(2.0, -0.3, 1.2), role="end")]
    robots["q1"] = robot_plan(points, passing.visits)
    plan = Plan(mission=mission, robots={name: robots[name] for name in starts})
    assert verify.judge(plan, refine(plan), largest=False).holds


def test_of_many_robots_whoever_is_stuck_goes_first() -> None:
    names = tuple("abcdefg")
    orders = Orders(names, 20)
    seen = []
    for order in orders:
        seen.append(order)
        if len(seen) == 1:
            orders.stuck(order, "e")
    assert seen[0] == names
    assert seen[1] == tuple("eabcdfg")
    assert len(set(seen)) == len(seen) == 7
    assert set(Orders(names[:4], 48)) == set(itertools.permutations(names[:4]))
