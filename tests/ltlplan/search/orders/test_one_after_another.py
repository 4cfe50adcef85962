"""Plans whose robots fly one after another, and bounds on robots that others help, against the search over all interleavings."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest

from ltlplan.allocation import Context
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.exact import _no_plan, under_precedences  # pyright: ignore[reportPrivateUsage]
from ltlplan.search.orders import planning
from ltlplan.search.orders.planning import OrderedTeam
from ltlplan.search.problem import Problem
from tests.helpers.missions.own_places import own_places
from tests.ltlplan.search.orders.test_against_brute_force import TEAMS
from tests.ltlplan.search.orders.test_dearest_robot import PARTS
from verify import check_planned_order
from verify.data import Mission, Plan, RobotPlan, parse_mission

PARCEL = "F(p & carry & (carry U (d0 & !carry)))"


def carriers(count: int) -> Mission:
    """Robots, each of which may carry a parcel; a robot that rests with free hands breaks the formula whenever it is read."""
    starts = "\n".join(f"  r{i}: {{start: [{i - 2}, -2, 1]}}" for i in range(count))
    return parse_mission(
        f"""
format: 1
name: carriers
spec: {{formula: '{PARCEL}', trace: finite, team: own}}
regions:
  p: {{center: [0, 2, 1], radii: [0.3, 0.3, 0.3]}}
  d0: {{center: [2, 0, 1], radii: [0.3, 0.3, 0.3]}}
robot:
  initial: free
  states: {{free: [], c: [carry]}}
  actions: [{{from: free, to: c, at: p}}, {{from: c, to: free, at: d0}}]
agents:
{starts}
vehicle: crazyflie-2.1
workspace: {{min: [-4, -4, 0.2], max: [8, 4, 2]}}
planner: {{pace: nominal}}
"""
    )


def team_of(mission: Mission) -> OrderedTeam:
    problem = Problem(mission, DEFAULT_BUDGET, None, None, {}, lambda _: None, _no_plan)
    return OrderedTeam(problem.each, Marks(problem.automata, problem.known), joint=False)


def test_six_robots_carry_before_one_brings_its_parcel() -> None:
    """A product of 262 144 nodes; the checker proves what is found."""
    mission = carriers(6)
    found = under_precedences(mission, Context(np.random.default_rng(0)))
    assert sum(any(visit.region == "d0" for visit in robot.visits) for robot in found.robots.values()) == 1
    assert all(robot.visits[0].region == "p" for robot in found.robots.values())
    assert len(found.precedences) == 5
    assert found.lower_bound is not None
    assert found.lower_bound < found.cost
    assert not found.complete
    point = {"position": (0.0, 0.0, 1.0), "role": "start"}
    robots = {
        name: RobotPlan.model_validate({"word": robot.word, "visits": robot.visits, "waypoints": [point], "times": [0.0]})
        for name, robot in found.robots.items()
    }
    assert check_planned_order(Plan(mission=mission, robots=robots, precedences=found.precedences)).outcome == "holds"


def test_a_team_that_flies_one_after_another_pays_no_less_than_all_interleavings(monkeypatch: pytest.MonkeyPatch) -> None:
    mission = carriers(2)
    best = team_of(mission).cheapest(Budget(states=200_000))
    monkeypatch.setattr(planning, "_LARGE", 0)
    turns = team_of(mission).cheapest(Budget(states=200_000))
    assert best is not None
    assert turns is not None
    assert turns.bound <= best.cost <= turns.cost + 1e-6
    assert turns.precedences


@pytest.mark.parametrize(("seed", "cases"), [(0, 15), pytest.param(1, 300, marks=pytest.mark.slow)])
def test_bounds_and_courses_of_random_teams_agree_with_all_interleavings(
    seed: int, cases: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng, compared = Random(seed), 0
    for _ in range(cases):
        parts, may_enter = rng.sample(PARTS, rng.randint(2, 4)), rng.choice(TEAMS)
        mission = own_places(" & ".join(f"({part})" for part in parts), may_enter)
        try:
            best = team_of(mission).cheapest(Budget(states=20_000))
        except TooLarge:
            continue
        with monkeypatch.context() as patched:
            patched.setattr(planning, "_LARGE", 0)
            turns = team_of(mission).cheapest(Budget(states=20_000))
        assert (best is None) == (turns is None), (parts, may_enter)
        if best is not None and turns is not None:
            assert turns.bound <= best.cost + 1e-6, (parts, may_enter)
            assert best.cost <= turns.cost + 1e-6, (parts, may_enter)
            compared += 1
    assert compared
