"""Limits of legs as refinement keeps them: what it makes is certified, in houses, across seams and through regions that overlap."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import ltlplan
from refine import refine
from tests.helpers.few import few_of
from tests.helpers.motion.flights import plan_of, small_mission
from verify import judge
from verify.certificate import Certificate
from verify.data.mission import Mission
from verify.data.plan import Plan, Visit, Waypoint

APART = """a: {center: [1.2, 0.0, 1.0], radii: [0.25, 0.25, 0.25]}
b: {center: [2.4, 0.0, 1.0], radii: [0.25, 0.25, 0.25]}"""
OVERLAPPING = """a: {center: [1.2, 0.0, 1.0], radii: [0.4, 0.4, 0.4]}
b: {center: [1.85, 0.0, 1.0], radii: [0.4, 0.4, 0.4]}"""
NEAR = OVERLAPPING.replace("1.85", "2.05")
NESTED = """h: {center: [2.0, 0.0, 1.0], radii: [1.2, 0.8, 0.8]}
a: {center: [1.6, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}
b: {center: [2.4, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}"""


def limited(regions: str, leg: str, *, formula: str = "true", trace: str = "finite") -> Mission:
    return small_mission(formula, regions=regions, margin=0.03, trace=trace, extra=f"limits: {{legs: {{{leg}}}}}")


def straight_plan(mission: Mission, visits: str) -> Plan:
    """Lead from the start through the middles of regions, at 0.45 m/s."""
    plan = plan_of(mission, {"r0": [Visit(region=region) for region in visits]})
    points = [(0.0, 0.0, 1.0), *(mission.all_regions[region].center for region in visits)]
    waypoints = [Waypoint(position=points[0], role="start")]
    waypoints += [
        Waypoint(position=point, role="centre", region=region, visit=index)
        for index, (region, point) in enumerate(zip(visits, points[1:], strict=True))
    ]
    lengths = [float(np.linalg.norm(np.subtract(b, a))) for a, b in itertools.pairwise(points)]
    times = [0.0, *(length / 0.45 for length in itertools.accumulate(lengths))]
    robot = plan.robots["r0"].model_copy(update={"waypoints": tuple(waypoints), "times": tuple(times)})
    return plan.model_copy(update={"robots": {"r0": robot}})


def assert_kept(certificate: Certificate) -> None:
    assert not [claim.sentence for claim in certificate.claims if claim.outcome != "holds"]
    found = [claim for claim in certificate.claims if claim.name.startswith("limits.legs")]
    assert found
    assert all(claim.bound is not None and claim.bound > 0.1 * claim.limit for claim in found), [c.sentence for c in found]


@pytest.mark.parametrize("pace", ["nominal", pytest.param("time", marks=pytest.mark.slow)])
@few_of(
    1,
    ("formula", "trace", "leg"),
    [
        ("F (a & F b)", "finite", "b: {speed: 0.25}"),
        ("G F a & G F b", "infinite", "a: {speed: 0.25}"),
        ("G F a & G F b", "infinite", "b: {acceleration: 0.3}"),
    ],
)
def test_planned_flights_keep_the_limits_of_their_legs(formula, trace, leg, pace):
    plan = ltlplan.plan(limited(APART, leg, formula=formula, trace=trace), seed=0)
    assert_kept(judge(plan, refine(plan, pace=pace), largest=False))


@few_of(
    2,
    ("regions", "visits", "leg"),
    [
        (OVERLAPPING, "ab", "b: {speed: 0.25}"),
        (NEAR, "ab", "b: {speed: 0.25, acceleration: 0.4}"),
        (NESTED, "hab", "a: {speed: 0.25}"),
        (NESTED, "hab", "b: {speed: 0.25}"),
    ],
)
def test_a_leg_through_a_region_around_the_next_one_is_slow_from_where_the_way_begins(regions, visits, leg):
    plan = straight_plan(limited(regions, leg), visits)
    assert_kept(judge(plan, refine(plan), largest=False))
