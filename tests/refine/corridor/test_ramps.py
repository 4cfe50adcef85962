"""Legs from rest to rest get points at which a robot has gathered speed."""

from __future__ import annotations

import numpy as np
import pytest

from refine import refine
from refine.corridor.planned import corridor_of
from refine.corridor.points import with_ramps
from tests.helpers.motion.plans_by_hand import ball, room, straight
from verify.data import Plan
from verify.data.sections import Agent


def two_fields() -> Plan:
    """One robot that flies straight through two fields."""
    starts = {"a": Agent(start=(-1.5, 0.0, 1.0))}
    mission = room({"near": ball(0.0, 0.0, 0.3), "far": ball(1.5, 0.0, 0.3)}, starts)
    robot = straight((-1.5, 0.0, 1.0), (0.0, 0.0, 1.0), (1.5, 0.0, 1.0), visits={1: "near", 2: "far"})
    return Plan(mission=mission, robots={"a": robot})


def test_legs_between_rests_are_cut_and_halts_stay_where_they_are() -> None:
    plan = two_fields()
    corridor = corridor_of(plan.mission, "a", plan.robots["a"])
    ramped, halts = with_ramps(corridor, {1: 1}, 60)
    assert len(ramped) == len(corridor) + 4
    assert np.allclose(ramped.points[halts[1]], corridor.points[1])
    assert ramped.durations.sum() == pytest.approx(corridor.durations.sum())
    assert len(with_ramps(corridor, {}, 60)[0]) == len(corridor)
    assert with_ramps(corridor, {1: 1}, len(corridor) + 3) == (corridor, {1: 1})


def test_a_robot_that_flies_from_rest_to_rest_is_fast_on_most_of_its_way() -> None:
    starts = {"a": Agent(start=(-1.5, 0.0, 1.0))}
    mission = room({"far": ball(1.5, 0.0, 0.3)}, starts)
    plan = Plan(mission=mission, robots={"a": straight((-1.5, 0.0, 1.0), (1.5, 0.0, 1.0), visits={1: "far"})})
    flight = refine(plan, pace=1.0)["a"]
    speeds = np.linalg.norm(flight.evaluate(np.linspace(0.0, flight.duration, 200), 1)[:, :3], axis=1)
    assert speeds.mean() >= 0.6 * speeds.max()
