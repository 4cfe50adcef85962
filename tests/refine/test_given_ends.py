"""Robots whose end lies in a region that others visit too end just there: only visits are moved beside each other."""

from __future__ import annotations

import pytest

import ltlplan
import verify
from ltlplan.pipeline import certified_team
from refine.corridor.relocation import movable
from verify.data import parse_mission

_END = (1.6, 0.1)


def crowded(*, other_end: tuple[float, float] | None, end: tuple[float, float] = _END) -> str:
    """Return a mission of two robots that visit one region, in which one of them is to end."""
    theirs = "" if other_end is None else f", end: [{other_end[0]}, {other_end[1]}, 1]"
    return f"""format: 1
name: ends
spec: {{formula: F a.right & F b.right, team: joint}}
regions: {{right: {{center: [1.5, 0, 1], size: [0.9, 0.9, 0.2]}}}}
agents: {{b: {{start: [-1, -0.8, 1]{theirs}}}, a: {{start: [-1, 0.8, 1], end: [{end[0]}, {end[1]}, 1]}}}}
vehicle: crazyflie-2.1
planner: {{pace: nominal}}
workspace: {{min: [-2, -2, 0.9], max: [2, 2, 1.1]}}
"""


@pytest.mark.parametrize(("other_end", "end"), [(None, _END), ((-1.6, -0.8), _END), ((-1.6, -0.8), (1.5, 0.0))])
def test_a_robot_ends_where_it_is_to_though_others_visit_that_region(
    other_end: tuple[float, float] | None, end: tuple[float, float]
) -> None:
    done = certified_team(ltlplan.plan(parse_mission(crowded(other_end=other_end, end=end))))
    plan = done.plan
    assert verify.certify(plan, done.team).holds
    assert not movable(plan.mission, "a", plan.robots["a"], plan.robots["a"].waypoints[-1])
    assert plan.robots["a"].waypoints[-1].position[:2] == end
