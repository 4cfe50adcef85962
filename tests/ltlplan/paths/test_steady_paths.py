"""Paths that are flown as they are laid: no dearer than a little over their straight legs, whatever points were put on these before."""

from __future__ import annotations

import itertools
import math

import pytest

from ltlplan.paths.improvement import without_swings
from tests.helpers.few import few_of
from tests.helpers.missions.rooms_and_rests import shared_machine
from verify.data import RobotPlan, Visit, Waypoint, Word
from verify.data.plan import Role
from verify.data.shapes.inequalities import Point

MISSION = shared_machine(2)
OUT_AND_BACK: tuple[Point, ...] = ((0.0, 1.2, 1.0), (0.921, 0.35, 1.0), (1.12, 0.166, 1.0), (0.889, 0.379, 1.0))


def laid(points: tuple[Point, ...], speed: float = 0.45) -> RobotPlan:
    """Return a path to the machine and out again, at one speed throughout."""
    times = [0.0, *itertools.accumulate(math.dist(a, b) / speed for a, b in itertools.pairwise(points))]
    vias: list[Role] = ["via"] * (len(points) - 3)
    roles: list[Role] = ["start", *vias, "centre", "via"]
    waypoints = [
        Waypoint(
            position=point,
            role=role,
            region="machine" if len(points) - k <= 3 else None,
            visit=0 if len(points) - k <= 3 else None,
        )
        for k, (point, role) in enumerate(zip(points, roles, strict=True))
    ]
    word = Word((frozenset(), frozenset({"machine"}), frozenset()))
    plan = RobotPlan(word=word, visits=(Visit(region="machine"),), waypoints=tuple(waypoints), times=tuple(times))
    return plan.model_copy(update={"cost": 1e3})


@few_of(1, "end", [0.6, 1.0, 1.4])
def test_a_path_that_turns_back_costs_little_more_than_its_legs(end: float) -> None:
    points = ((OUT_AND_BACK[0][0] - end, *OUT_AND_BACK[0][1:]), *OUT_AND_BACK[1:])
    steady = without_swings(MISSION, "a", laid(points))
    legs = sum(math.dist(a, b) for a, b in itertools.pairwise(points))
    assert steady.cost < 1.06 * legs


@pytest.mark.parametrize("shares", [(0.5,), (0.3, 0.8)])
def test_points_that_lie_on_a_leg_decide_nothing(shares: tuple[float, ...]) -> None:
    (a, b, *rest), plain = OUT_AND_BACK, without_swings(MISSION, "a", laid(OUT_AND_BACK))
    between = [(a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), 1.0) for s in shares]
    steady = without_swings(MISSION, "a", laid((a, *between, b, *rest)))
    assert steady.cost <= 1.05 * plain.cost
    assert steady.times[-1] <= plain.times[-1] + 1e-9
