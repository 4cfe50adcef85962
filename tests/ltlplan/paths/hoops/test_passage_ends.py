"""Hoops at whose control points a region stands are flown through all the same: the flight is certified, and keeps clear where it is sampled."""

import math
import random

import numpy as np
import pytest
from scipy import ndimage

from ltlplan.paths.hoops import avoid, route
from ltlplan.paths.hoops.keep_out import room
from ltlplan.paths.hoops.passage_ends import passage_ends
from ltlplan.pipeline import certified_team, plan
from tests.helpers.few import few_of
from tests.helpers.missions.hoops import small_mission
from verify.data import Mission, Visit, parse_mission

_MISSION = """
format: 1
name: grazed
vehicle: crazyflie-2.1
spec: {{formula: "{formula}", trace: {trace}}}
workspace: {{min: [-3, -3, 0.2], max: [3, 3, 3]}}
hoops: {{h: {{center: [0, 0, 1.2], yaw_deg: {yaw}, radii: [{size}, {size}, {size}], opening: {opening}, rim: 0.02}}}}
regions: {{a: {{center: {region}, radii: [{radius}, {radius}, {radius}]}}}}
agents: {{quad0: {{start: {start}}}}}
"""


def _grazed(**changes: object) -> Mission:
    base = {"formula": "F h & G !a", "trace": "finite", "yaw": 0, "size": 0.3, "opening": 0.3, "radius": 0.4}
    return parse_mission(_MISSION.format(**{**base, "region": [0.55, -0.17, 1.03], "start": [0.38, -1.75, 1.2], **changes}))


_BESIDE = {"region": [0.495, -0.158, 1.2], "radius": 0.3, "size": 0.2, "start": [-1.28, -1.38, 1.2]}
_PLACES = {
    "at the front": {},
    "at the rear, where the ring is wider than the hoop's region": {
        "region": [-0.5, 0.16, 1.2],
        "radius": 0.3,
        "size": 0.2,
        "start": [1.28, -1.38, 1.2],
    },
    "over the axis inside the hoop's region": {
        "yaw": 45,
        "size": 0.4,
        "region": [-0.262, -0.47, 1.246],
        "radius": 0.2,
        "start": [0.7, 1.25, 1.2],
    },
    "come to first, then left for the hoop": {"formula": "F (a & F h)", **_BESIDE},
    "come to after the hoop": {"formula": "F (h & F a)", **_BESIDE},
    "for ever": {"formula": "G F h & G !a", "trace": "infinite"},
}


@few_of(2, "case", _PLACES)
def test_a_hoop_is_flown_through_where_a_region_stands_at_its_control_points(case, pace):
    mission = _grazed(**_PLACES[case])
    own, ends = mission.hoops["h"], passage_ends(mission.hoops["h"], room(mission), "h")
    apart = [np.linalg.norm(np.abs(end - own.center) - own.reach * np.abs(own.normal)) for end in ends.outer("F")]
    assert max(apart) > 0.01, "the hoop's own control points serve: nothing is tried here"
    done = certified_team(plan(mission, seed=1, pace=pace))
    assert all(claim.outcome == "holds" for claim in done.certificate.claims)
    _keeps_when_sampled(mission, done.team["quad0"])


def _keeps_when_sampled(mission, trajectory):
    """Assert by dense samples that a flight comes into the hoop, keeps off its ring, and keeps out of `a` where it must."""
    at = np.linspace(0.0, trajectory.duration, 20_000)
    path = trajectory.evaluate(at)[:, :3]
    hoop, far = mission.hoops["h"], path - np.array(mission.regions["a"].center)
    assert np.min(_from_ring(path, hoop)) > mission.vehicle.radius + mission.margin - 1e-9
    inside = np.linalg.norm(path - np.array(hoop.center), axis=1) < hoop.inner_radius - mission.margin
    assert inside.any()
    if "G !a" in mission.spec.formula:
        assert np.min(np.linalg.norm(far, axis=1)) > mission.regions["a"].inner_radius + mission.margin - 1e-9


def _from_ring(points, hoop):
    """Distances of points from a hoop's ring, m. Shape (..., 3) to (...)."""
    offset = points - np.array(hoop.center)
    along = offset @ np.array(hoop.normal)
    across = np.linalg.norm(offset - along[..., None] * np.array(hoop.normal), axis=-1)
    beside = np.maximum(np.maximum(hoop.opening - across, across - hoop.opening - hoop.rim), 0.0)
    return np.hypot(beside, np.maximum(np.abs(along) - hoop.rim / 2, 0.0))


def test_a_hoop_in_front_of_a_wall_is_left_and_entered_again_in_the_room_that_there_is(pace):
    hoops = "h0: {center: [1.5, 0, 1], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02, reach: 0.4}"
    mission = small_mission(hoops=hoops, sequence="h0F h0R", workspace="{min: [-2, -2, 0.2], max: [1.95, 2, 2]}")
    assert all(claim.outcome == "holds" for claim in certified_team(plan(mission, seed=1, pace=pace)).certificate.claims)


def test_a_hoop_whose_own_control_points_are_clear_keeps_them():
    mission = _grazed(region=[1.5, 1.5, 1.2])
    ends = passage_ends(mission.hoops["h"], room(mission), "h")
    assert ends.before is None
    assert ends.beyond is None
    assert np.allclose(ends.points.front, [0.45, 0.0, 1.2], atol=1e-12)


def test_a_region_in_the_middle_of_which_a_hoop_s_avoid_point_lies_is_flown_to():
    mission = _grazed(region=[-0.5, 0.0, 1.2], yaw=90, opening=0.25, radius=0.2, start=[-0.446, 1.411, 1.2])
    path = route(mission, "quad0", [Visit(region="a"), Visit(region="h")])
    assert [visit.region for visit in path.visits] == ["a", "h"]
    way = avoid(mission, room(mission), np.array([-0.5, 0.0, 1.2]), np.array([0.0, 0.45, 1.2]), {"a"})
    assert all(np.linalg.norm(point.position - [-0.5, 0.0, 1.2]) > 0.05 for point in way)


def _reachable(mission):
    """Tell by flood over a grid whether the hoop's region can be come to without touching `a` or a ring."""
    step, hoop, region = 0.03, mission.hoops["h"], mission.regions["a"]
    axes = [np.arange(-2.1, 2.1, step), np.arange(-2.1, 2.1, step), np.arange(0.3, 2.6, step)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    clear = _from_ring(points, hoop) > mission.vehicle.radius + mission.margin
    clear &= np.linalg.norm(points - np.array(region.center), axis=-1) > region.inner_radius + mission.margin
    held = np.linalg.norm(points - np.array(hoop.center), axis=-1) < hoop.inner_radius - mission.margin
    parts, _ = ndimage.label(clear)
    start = tuple(round((x - axis[0]) / step) for x, axis in zip(mission.agents["quad0"].start, axes, strict=True))
    return bool(np.any(held & (parts == parts[start]))) if parts[start] else False


@pytest.mark.slow
def test_random_hoops_that_a_flood_over_a_grid_reaches_are_flown_to(pace):
    rng = random.Random(3)
    certified = 0
    for _ in range(30):
        yaw, size, radius = rng.uniform(0, 180), rng.choice([0.2, 0.3, 0.4, 0.5]), rng.choice([0.2, 0.3, 0.4, 0.5])
        opening, gap = rng.choice([0.25, 0.3, 0.35]), rng.choice([-0.05, -0.02, 0.0, 0.01, 0.02, 0.05, 0.1])
        way = np.array([rng.gauss(0, 1), rng.gauss(0, 1), rng.gauss(0, 0.4)])
        place = np.array([0.0, 0.0, 1.2]) + way / np.linalg.norm(way) * (radius + gap + rng.choice([size, opening + 0.02]))
        angle = rng.uniform(0, 2 * math.pi)
        start = [round(1.6 * math.cos(angle), 3), round(1.6 * math.sin(angle), 3), 1.2]
        mission = _grazed(
            yaw=yaw, size=size, radius=radius, opening=opening, region=[round(float(x), 4) for x in place], start=start
        )
        if not _reachable(mission):
            continue
        done = certified_team(plan(mission, seed=1, pace=pace))
        assert all(claim.outcome == "holds" for claim in done.certificate.claims)
        _keeps_when_sampled(mission, done.team["quad0"])
        certified += 1
    assert certified >= 25
