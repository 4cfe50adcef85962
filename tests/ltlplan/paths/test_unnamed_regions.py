"""Paths beside regions that a formula does not name: as without them where they are clear of them, around them where not."""

from __future__ import annotations

import numpy as np

import ltlplan
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from refine import refine
from tests.helpers.few import few_of
from tests.helpers.missions.rooms_and_rests import fields_or_spots
from verify import judge
from verify.data import Plan

GOAL = ((3.0, 0.0), (1.0, 1.0))
MARGIN = 0.05


def planned(**beside: tuple[tuple[float, float], tuple[float, float]]) -> Plan:
    """Return the plan of one robot that flies from the origin to a goal, beside boxes."""
    return ltlplan.plan(fields_or_spots({"goal": GOAL, **beside}, formula="F goal"))


def distance(plan: Plan, box: tuple[tuple[float, float], tuple[float, float]]) -> float:
    """Return how near a plan's path comes to a box in x and y, by dense samples, m."""
    path = plan.robots["q"]
    at = np.linspace(0.0, path.times[-1], 2000)
    points = LeastSnapSpline(path.times).evaluate([waypoint.position for waypoint in path.waypoints], at)[:, :2]
    return float(np.linalg.norm(np.maximum(np.abs(points - box[0]) - np.array(box[1]) / 2.0, 0.0), axis=1).min())


@few_of(1, "edge", [0.08, 0.1, 0.5])
def test_a_path_beside_an_unnamed_region_is_flown_as_without_it(edge: float) -> None:
    """Legs are laid 9 cm from regions where they can be, so that one at 8 cm bent them."""
    alone, beside = planned(), planned(shelf=((1.5, edge + 0.2), (0.4, 0.4)))
    assert beside.robots == alone.robots
    assert beside.cost == alone.cost


@few_of(1, "edge", [-0.2, 0.0, 0.04])
def test_a_path_goes_around_an_unnamed_region_that_is_in_its_way(edge: float) -> None:
    alone, shelf = planned(), ((1.5, edge + 0.2), (0.4, 0.4))
    around = planned(shelf=shelf)
    assert distance(alone, shelf) < MARGIN
    assert distance(around, shelf) >= MARGIN
    assert alone.cost is not None
    assert around.cost is not None
    assert around.cost > alone.cost
    assert around.words == alone.words
    assert judge(around, refine(around, pace="nominal"), largest=False).holds


def test_of_two_unnamed_regions_the_one_that_is_not_in_the_way_changes_nothing() -> None:
    pillar = ((1.5, 0.2), (0.4, 0.4))
    one, two = planned(pillar=pillar), planned(pillar=pillar, shelf=((1.5, -0.6), (0.4, 0.4)))
    assert distance(one, ((1.5, -0.6), (0.4, 0.4))) > 2.0 * MARGIN
    assert two.robots == one.robots
