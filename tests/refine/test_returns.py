"""A region twice in a row: the robot leaves it by enough and comes back, whatever the region's shape and what stands around it."""

from __future__ import annotations

import numpy as np

import ltlplan
import verify
from ltlplan import parse_mission
from ltlplan.pipeline import certified_team
from refine.single_robot.task import Pace
from tests.helpers.few import few_of
from verify.data import Mission, Trajectory

SPHERE = "a: {center: [0.3, 0, 1], radii: [0.3, 0.3, 0.3]}"
TURNED = "a: {center: [0.3, 0, 1], radii: [0.5, 0.2, 0.3], yaw_deg: 30}"
WIDE = "a: {center: [0, 0, 1], radii: [1.4, 1.1, 0.3]}"  # left upwards or downwards alone
HOOP = "a: {center: [0.3, 0, 1], yaw_deg: 40, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}"
AROUND = (
    "h: {center: [1.0, 0, 1], yaw_deg: 90, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}, "
    "i: {center: [0.3, 0.75, 1], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}"
)
TWICE, THRICE = "F(a & F(free & F a))", "F(a & F(free & F(a & F(free & F a))))"


def world(
    formula: str, *, regions: str = "", hoops: str = "", agents: str = "q: {start: [-1.2, 0, 1]}", more: str = ""
) -> Mission:
    return parse_mission(f"""
format: 1
name: returns
spec: {{formula: "{formula}"{more}}}
regions: {{{regions}}}
hoops: {{{hoops}}}
agents: {{{agents}}}
vehicle: crazyflie-2.1
separation: 0.2
workspace: {{min: [-1.6, -1.3, 0.2], max: [1.6, 1.3, 1.8]}}
""")


def stays(mission: Mission, flight: Trajectory, region: str) -> int:
    """Count by dense samples how often a flight comes within the margin of a region, having left it by the margin before."""
    shape = mission.all_regions[region]
    times = np.linspace(0.0, flight.duration, 20_001)
    offset = flight.evaluate(times)[:, :3] - np.array(shape.center)
    level = np.sqrt(np.einsum("ni,ij,nj->n", offset, np.array(shape.shape), offset))
    near = level <= 1.0 + mission.margin / min(shape.radii)
    deep = level < 1.0 - mission.margin / min(shape.radii)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], near, [False]]).astype(int)))
    assert all(deep[a:b].any() for a, b in edges.reshape(-1, 2))
    return len(edges) // 2


@few_of(
    2,
    ("mission", "count"),
    [
        (world(TWICE, regions=SPHERE), 2),
        (world(THRICE, regions=SPHERE), 3),
        (world(TWICE, regions=TURNED), 2),
        (world(TWICE, regions=WIDE, agents="q: {start: [-1.4, -1.1, 1]}"), 2),
        (world(TWICE, regions=SPHERE, hoops=AROUND), 2),
        (world(f"{TWICE} & F h", regions=SPHERE, hoops=AROUND), 2),
        (world(TWICE, regions=SPHERE, agents="q: {start: [0.3, 0, 1]}"), 2),
        (world(TWICE, hoops=HOOP), 2),
        (world("F(a & F(free & F G a))", hoops=HOOP), 2),
        (world(TWICE, hoops=HOOP, agents="q: {start: [0.3766, 0.0643, 1]}"), 2),  # in the region, in front of the opening
        (world("F(a & F(free & F G a))", hoops=HOOP, agents="q: {start: [0.3766, 0.0643, 1]}"), 2),
    ],
)
def test_a_region_is_left_and_visited_again(mission: Mission, count: int, pace: Pace) -> None:
    done = certified_team(ltlplan.plan(mission, seed=0, pace=pace))
    assert stays(mission, done.team["q"], "a") == count
    assert verify.judge(done.plan, done.team, largest=False).holds


def test_several_robots_leave_regions_and_visit_them_again(pace: Pace) -> None:
    regions = "a: {center: [0.5, 0.5, 1], radii: [0.3, 0.3, 0.3]}, b: {center: [0.5, -0.5, 1], radii: [0.3, 0.3, 0.3]}"
    agents = "q: {start: [0.5, 0.5, 1]}, r: {start: [-1, -0.5, 1]}"
    mission = world("F(free & F a) & F(b & F(free & F b)) & (!b U (free | a))", regions=regions, agents=agents)
    done = certified_team(ltlplan.plan(mission, seed=0, pace=pace))
    made = {name: tuple(visit.region for visit in robot.visits) for name, robot in done.plan.robots.items()}
    assert sum(visits.count("b") for visits in made.values()) >= 2
    for name, flight in done.team.items():
        for region in "ab":
            assert stays(mission, flight, region) == made[name].count(region)


def test_a_lap_leaves_the_region_that_it_begins_with(pace: Pace) -> None:
    mission = world("G F a & G F free", regions=SPHERE, more=", trace: infinite, repeat: 3")
    done = certified_team(ltlplan.plan(mission, seed=0, pace=pace))
    (flight,) = done.team.values()
    assert stays(mission, flight.flattened(3), "a") == 3


@few_of(2, "seed", range(7))
def test_random_regions_are_left_and_visited_again(seed: int, pace: Pace) -> None:
    rng = np.random.default_rng(seed)
    radii, centre = rng.uniform(0.12, 0.4, 3), rng.uniform([-0.5, -0.6, 0.8], [0.9, 0.6, 1.2])
    region = f"a: {{center: {centre.round(3).tolist()}, radii: {radii.round(3).tolist()}, yaw_deg: {rng.uniform(0, 90):.1f}}}"
    mission = world(THRICE if seed % 2 else TWICE, regions=region, agents="q: {start: [-1.3, -1.1, 1.5]}")
    done = certified_team(ltlplan.plan(mission, seed=0, pace=pace))
    assert stays(mission, done.team["q"], "a") == 2 + seed % 2
