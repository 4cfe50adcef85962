"""The shipped missions with walls, doors, shelves and houses: loaded, planned, and flown clear of what is solid by samples of our own."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pytest

import ltlplan
import verify
from ltlplan.report.views import views_html
from refine import refine
from tests.helpers.few import few_of
from tests.helpers.missions.shipped import WORLD_MISSIONS
from tests.helpers.pages import MOST_BYTES
from verify.data import Mission, Plan
from verify.data.shapes.solid_parts import solid_parts

ASKED = {
    "door-puzzle": {"goal", *(f"{what}{k}" for what in ("door", "key") for k in range(5))},
    "meeting": {"gate", "dock", "home"},
    "office": {"kitchen", "library", "lab", "studio", "mail", "meeting"},
    "warehouse": {"packing", "assembly", "count_north", "count_south"},
    "wall-swap": {"goal0", "goal1", "goal2", "goal3"},
    "window-inspection": {"north", "east", "south", "west"},
}


@functools.cache
def planned(name: str) -> Plan:
    return ltlplan.plan(ltlplan.load_mission(name))


def clear_of_solids(mission: Mission, points: np.ndarray, keep: float) -> bool:
    """Tell whether points, m, are so far from all that is solid. Shape (n, 3)."""
    return all(part.distances(points).min() > keep for part in solid_parts(mission.obstacles, mission.hoops))


@few_of(1, "name", sorted(WORLD_MISSIONS, key=lambda name: name != "meeting"))
def test_a_mission_of_the_world_is_shared_by_its_robots_along_ways_that_are_there(name: str) -> None:
    plan = planned(name)
    mission = plan.mission
    visited = {visit.region for robot in plan.robots.values() for visit in robot.visits}
    assert ASKED.get(name, set()) <= visited
    for robot, flown in plan.robots.items():
        at = np.array([waypoint.position for waypoint in flown.waypoints])
        assert clear_of_solids(mission, at, mission.vehicle_of(robot).radius), robot
        only = [mission.all_regions[visit.region].only for visit in flown.visits]
        assert all(kinds is None or mission.agents[robot].robot in kinds for kinds in only), robot
    assert views_html(mission).count("<svg viewBox") == 3


@pytest.mark.slow
@pytest.mark.parametrize("name", WORLD_MISSIONS)
def test_a_mission_of_the_world_is_certified_and_flown_clear_of_what_is_solid(name: str, tmp_path: Path) -> None:
    result = ltlplan.run(name, tmp_path / "run")
    assert all(claim.outcome == "holds" for claim in result.certificate.claims)
    assert {"obstacles"} <= {claim.name for claim in result.certificate.claims}
    mission = verify.recheck(tmp_path / "run").mission
    for robot, trajectory in result.team.items():
        planned = trajectory.evaluate(np.arange(0.0, trajectory.duration, 1e-3))[:, :3]
        assert clear_of_solids(mission, planned, mission.vehicle_of(robot).radius + mission.margin - 1e-9), robot
    for index, robot in enumerate(result.log.robots):
        assert clear_of_solids(mission, result.log.position[:, index], mission.vehicle_of(robot).radius), robot
    assert (tmp_path / "run" / "report.html").stat().st_size <= MOST_BYTES


@pytest.mark.slow
def test_robots_that_change_places_cannot_pass_above_each_other_and_end_where_they_are_meant_to() -> None:
    mission = ltlplan.load_mission("wall-swap")
    low, high = mission.workspace.min[2], mission.workspace.max[2]
    assert high - low - 2 * mission.margin < mission.separation + 2 * mission.margin
    plan = planned("wall-swap")
    ends = {name: robot.visits[-1].region for name, robot in plan.robots.items()}
    assert ends == {"quad0": "goal0", "quad1": "goal1", "quad2": "goal2", "quad3": "goal3"}
    team = refine(plan)
    assert verify.judge(plan, team, largest=False).holds
