"""Robots that fly one at a time between meetings, by name or the last ones first."""

from __future__ import annotations

import pytest

from ltlplan import plan
from ltlplan.pipeline import certified_team
from refine.coordination.meeting_orders import one_at_a_time
from tests.helpers.missions.patterns import Case, Pattern
from tests.helpers.motion.plans_by_hand import ball, room, straight
from verify.data import Plan
from verify.data.plan import Meeting
from verify.data.sections import Agent


def test_either_order_keeps_the_meetings() -> None:
    """Both robots fly to r, wait there for each other, and fly on to s."""
    starts = {"a": (-2.0, 1.0, 1.0), "b": (-2.0, -1.0, 1.0)}
    mission = room({"r": ball(-1, 0, 0.8), "s": ball(1, 0, 0.8)}, {name: Agent(start=start) for name, start in starts.items()})
    robots = {name: straight(start, (-1, 0, 1), (1, 0, 1), visits={1: "r", 2: "s"}) for name, start in starts.items()}
    meetings = (Meeting(first=("a", 0), then=("b", 1)), Meeting(first=("b", 0), then=("a", 1)))
    asked = Plan(mission=mission, robots=robots, meetings=meetings)
    by_name = {*meetings, Meeting(first=("a", 0), then=("b", 0)), Meeting(first=("a", 1), then=("b", 1))}
    assert set(one_at_a_time(asked)) == by_name
    last_first = {*meetings, Meeting(first=("b", 0), then=("a", 0)), Meeting(first=("b", 1), then=("a", 1))}
    assert set(one_at_a_time(asked, last_first=True)) == last_first


@pytest.mark.slow  # ten seconds: ways that do not cross are tried before
def test_a_robot_comes_past_the_place_of_one_that_comes_later() -> None:
    pattern = Pattern("all, and all elsewhere", "", False, "F(all(home) & F all(c))", "finite", ())
    assert certified_team(plan(Case(pattern, 3, "joint").mission)).certificate.holds
