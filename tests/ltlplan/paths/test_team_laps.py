"""Laps of a team as they are laid: they do not swing to and fro, and are certified as they are flown."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from ltlplan import plan
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.paths.team_laps import cost_of_all_laps
from ltlplan.pipeline import certified_team
from ltlplan.report.summary import plan_lines
from tests.helpers.missions.worlds import world
from verify.data import Mission, RobotPlan

FORMULA = "G F a & G F b & G F c"


@pytest.fixture
def patrol() -> Mission:
    places = {"a": (0.69, 1.03), "b": (-0.32, -0.96), "c": (0.05, -0.2)}
    radii = dict.fromkeys(places, 0.3)
    found = world(FORMULA, robots=2, regions=places, radii=radii, trace="infinite", team="joint", repeat=2)
    return found.changed(planner=found.planner.model_copy(update={"visits": "middle"}))


def turned(robot: RobotPlan) -> float:
    """Return how far a robot's flight goes beyond its straight legs, as a share of them, by dense samples of its planned spline."""
    at = [i for i in (0, robot.cycle_waypoint, len(robot.waypoints) - 1) if i is not None]
    flown = straight = 0.0
    for first, last in itertools.pairwise(at):
        points = np.array([w.position for w in robot.waypoints[first : last + 1]])
        if len(points) < 2:
            continue
        times = np.array(robot.times[first : last + 1]) - robot.times[first]
        path = LeastSnapSpline(times).evaluate(points, np.linspace(0.0, times[-1], 4000))
        flown += float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
        straight += float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    return 0.0 if straight == 0.0 else flown / straight - 1.0


def metres_of(robot: RobotPlan) -> tuple[float, float]:
    """Return how long the way to a robot's laps is and one of them, by dense samples of its planned splines, m."""
    found = []
    for first, last in ((0, robot.cycle_waypoint or 0), (robot.cycle_waypoint or 0, len(robot.waypoints) - 1)):
        points = np.array([waypoint.position for waypoint in robot.waypoints[first : last + 1]])
        times = np.array(robot.times[first : last + 1]) - robot.times[first]
        dense = LeastSnapSpline(times).evaluate(points, np.linspace(0.0, times[-1], 4000)) if len(points) > 1 else points
        found.append(float(np.linalg.norm(np.diff(dense, axis=0), axis=1).sum()))
    return found[0], found[1]


def test_a_teams_cost_is_of_prefix_and_one_lap_and_says_so(patrol: Mission) -> None:
    made = plan(patrol)
    metres = {name: metres_of(robot) for name, robot in made.robots.items() if not robot.hovers}
    assert metres
    assert made.cost == pytest.approx(sum(made.robots[name].cost for name in made.robots))
    for name, (once, lap) in metres.items():
        assert made.robots[name].cost == pytest.approx(once + lap, rel=1e-3)
        assert cost_of_all_laps(patrol, name, made.robots[name]) == pytest.approx(once + 2.0 * lap, rel=1e-3)
    assert made.lower_bound is not None
    assert made.lower_bound <= made.cost
    assert "of prefix and one lap (exact" in "\n".join(plan_lines(made))


def test_laps_of_a_team_do_not_swing(patrol: Mission, monkeypatch: pytest.MonkeyPatch) -> None:
    steady = plan(patrol)
    monkeypatch.setattr("ltlplan.paths.team_laps.without_swings", lambda mission, name, path: path)
    swinging = plan(patrol)
    assert max(turned(robot) for robot in swinging.robots.values()) > 0.5, "nothing swings here"
    assert max(turned(robot) for robot in steady.robots.values()) < 0.25
    assert steady.words == swinging.words
    assert steady.cost < 0.9 * swinging.cost
    assert certified_team(steady).certificate.holds
