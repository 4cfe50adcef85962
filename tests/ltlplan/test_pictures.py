"""The page of pictures shows the plan itself."""

from __future__ import annotations

import pytest

import ltlplan
from ltlplan.missions import load_mission
from ltlplan.report.pictures import pictures_html


@pytest.mark.parametrize("name", ["firefighting", "hoops-ltl"])
def test_what_is_shown_is_what_is_planned(name: str) -> None:
    mission = load_mission(name)
    page = pictures_html(mission, seed=3)
    plan = ltlplan.plan(mission, seed=3)
    for robot, path in plan.robots.items():
        if len(path.waypoints) < 2:
            assert f"{robot} stays at its start" in page
        else:
            assert f"after cross-entropy {path.cost:.3f}." in page
