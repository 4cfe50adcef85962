"""Plans that no team can fly are refused, by the name of what is in the way and with the figure that is too large or too small."""

from __future__ import annotations

import numpy as np
import pytest

from refine import refine
from refine.coordination.departures import DepartureConflict, ScheduledPath, departures
from refine.corridor.sampled_stays import violations
from refine.spline.least_snap import minimum_snap
from tests.helpers.motion.plans_by_hand import ball, room, straight, through
from verify.data import Infeasible, Plan
from verify.data.sections import Agent
from verify.data.shapes.region import Hoop, Region


def test_a_region_smaller_than_the_margin_is_refused() -> None:
    mission = room({"a": ball(0, 0, 0.04)}, {"q": Agent(start=(-1.5, 0.0, 1.0))})
    plan = Plan(mission=mission, robots={"q": straight((-1.5, 0, 1), (0, 0, 1), visits={1: "a"})})
    with pytest.raises(Infeasible, match=r"a visit needs more than 0\.051 m: the margin, 0\.05 m, and 1 mm"):
        refine(plan)


def test_a_hoop_smaller_than_the_vehicle_is_refused() -> None:
    hoop = Hoop(center=(0.0, 0.0, 1.0), radii=(0.2, 0.2, 0.2), opening=0.1, rim=0.02)
    mission = room({}, {"q": Agent(start=(-1.5, 0.0, 1.0))}).model_copy(update={"hoops": {"h": hoop}})
    plan = Plan(mission=mission, robots={"q": through(mission, "q", [("h", "F")])})
    with pytest.raises(Infeasible, match="leave no room"):
        refine(plan)


def test_a_waypoint_in_a_forbidden_region_is_refused() -> None:
    mission = room({"a": ball(0, 0), "b": ball(0.1, 0)}, {"q": Agent(start=(-1.5, 0.0, 1.0))})
    plan = Plan(mission=mission, robots={"q": straight((-1.5, 0, 1), (0, 0, 1), visits={1: "a"})})
    with pytest.raises(Infeasible, match="'b', which is not visited there") as caught:
        refine(plan)
    assert caught.value.witness is not None


@pytest.mark.slow
def test_a_walled_goal_is_refused_and_no_easy_way_was_missed() -> None:
    """The goal's shell is closed, so a dense search of straight ways finds none either."""
    shell = {f"s{i}": ball(float(np.cos(a)) * 0.8, float(np.sin(a)) * 0.8, 0.6) for i, a in enumerate(np.arange(6) * np.pi / 3)}
    lids = {
        "top": Region(center=(0.0, 0.0, 1.9), radii=(1.2, 1.2, 0.5)),
        "bottom": Region(center=(0.0, 0.0, 0.1), radii=(1.2, 1.2, 0.5)),
    }
    mission = room({"goal": ball(0, 0, 0.15), **shell, **lids}, {"q": Agent(start=(-2.5, 0.0, 1.0))})
    plan = Plan(mission=mission, robots={"q": straight((-2.5, 0, 1), (0, 0, 1), visits={1: "goal"})})
    with pytest.raises(Infeasible):
        refine(plan)
    angles = np.random.default_rng(0).normal(size=(400, 3))
    rays = angles / np.linalg.norm(angles, axis=1, keepdims=True) * 1.5 + np.array([0, 0, 1.0])
    line = np.array([0, 0, 1.0]) + np.linspace(0, 1, 100)[:, None, None] * (rays - np.array([0, 0, 1.0]))
    blocked = np.zeros(400, dtype=bool)
    for name, region in mission.regions.items():
        if name != "goal":
            blocked |= (region.level(line) <= 1.0).any(axis=0)
    inside = np.all((rays > [-3, -3, 0.2]) & (rays < [3, 3, 2.5]), axis=1)
    assert blocked[inside].all()


def test_violations_name_the_region_that_was_entered() -> None:
    mission = room({"a": ball(0, 0)}, {"q": Agent(start=(-1.5, 0.0, 1.0))})
    path = minimum_snap([[-1.5, 0, 1], [1.5, 0, 1]], [0.0, 5.0])
    found = violations(path, mission, "q", straight((-1.5, 0, 1), (1.5, 0, 1)))
    assert [witness.region for witness in found] == ["a"]
    assert "plan visits none" in found[0].sentence


def test_departures_that_cannot_be_are_reported() -> None:
    path = minimum_snap([[0.0, 0, 1], [1.0, 0, 1]], [0.0, 3.0])
    same = [ScheduledPath("a", path, (), 0.0), ScheduledPath("b", path, (), 0.0)]
    found = departures(same, distance=0.4, z_scale=1.0)
    assert isinstance(found, DepartureConflict)
    assert found.pair in (("a", "b"), ("b", "a"))
