"""A passage is inside its hoop's region by the margin as long as the opening is near, however much wider the opening is."""

from __future__ import annotations

import numpy as np
import pytest

import ltlplan
import verify
from ltlplan import parse_mission
from ltlplan.pipeline import certified_team
from refine import refine
from verify.data import Infeasible, Mission, mission_to_yaml
from verify.data.rules.passage_room import room_in_region


def gate(radii: list[float], opening: float, *, yaw: float = 0.0, margin: float = 0.05, pitch: float = 0.0) -> Mission:
    return parse_mission(f"""
format: 1
name: gate
spec: {{formula: "F a & F goal"}}
hoops: {{a: {{center: [0, 0.1, 1.1], yaw_deg: {yaw}, pitch_deg: {pitch}, radii: {radii}, opening: {opening}, rim: 0.02, reach: 0.4}}}}
regions: {{goal: {{center: [1.2, -0.7, 0.8], radii: [0.2, 0.2, 0.2]}}}}
agents: {{q: {{start: [-1.2, -0.6, 0.7]}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-1.6, -1.6, 0.2], max: [1.6, 1.6, 2.0]}}
margin: {margin}
""")


@pytest.mark.parametrize("seed", range(10))
def test_the_room_is_what_dense_points_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mission = gate(
        rng.uniform(0.12, 0.4, 3).round(3).tolist(), 0.3, yaw=float(rng.uniform(0, 90)), pitch=float(rng.uniform(-40, 40))
    )
    hoop, margin = mission.hoops["a"], float(rng.uniform(0.01, 0.06))
    room = room_in_region(hoop, margin)
    normal = np.array(hoop.normal)
    along = rng.uniform(-margin, margin, 20_000)
    side = np.cross(normal, rng.normal(size=(20_000, 3)))
    points = np.array(hoop.center) + along[:, None] * normal + room * side / np.linalg.norm(side, axis=1)[:, None]
    farthest = float(np.sqrt(hoop.level(points)).max())
    inside = 1.0 - margin / min(hoop.radii)
    assert inside - 0.03 < farthest <= inside + 1e-9


@pytest.mark.parametrize("seed", range(8))
def test_visits_contain_their_passages_where_openings_are_wide(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mission = gate(
        rng.uniform(0.14, 0.2, 3).round(3).tolist(), round(float(rng.uniform(0.27, 0.36)), 3), yaw=float(rng.uniform(-40, 40))
    )
    done = certified_team(ltlplan.plan(mission, seed=0))
    assert done.rounds == 1
    assert verify.judge(done.plan, done.team, largest=False).holds


def test_a_region_too_small_for_its_passage_is_the_reason() -> None:
    mission = gate([0.09, 0.09, 0.09], 0.25)
    with pytest.raises(Infeasible, match=r"'a' reaches .* so no visit could contain a passage. Give it a larger region"):
        refine(ltlplan.plan(mission, seed=0))


SHAPES = {
    "box": "size: [0.5, 0.6, 0.5]",
    "cylinder": "cylinder: {radius: 0.3, height: 0.6}",
    "prism": "prism: {polygon: [[-0.3, -0.3], [0.3, -0.2], [0.2, 0.5], [-0.35, 0.4]], z: [0.7, 1.6]}",
    "union": "union: [{center: [-0.15, 0.1, 1.1], size: [0.5, 0.7, 0.8]}, {center: [0.25, 0.2, 1.1], size: [0.3, 0.5, 0.7]}]",
}


def gate_of(shape: str, *, yaw: float, pitch: float = 0.0, reach: float = 0.65, formula: str = "F a & F goal") -> Mission:
    return parse_mission(f"""
format: 1
name: gate
spec: {{formula: "{formula}"}}
hoops: {{a: {{center: [0, 0.1, 1.1], yaw_deg: {yaw}, pitch_deg: {pitch}, {shape}, opening: 0.3, rim: 0.02, reach: {reach}}}}}
regions: {{goal: {{center: [1.2, -0.7, 0.8], radii: [0.2, 0.2, 0.2]}}}}
agents: {{q: {{start: [-1.2, -0.6, 0.7]}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-1.6, -1.6, 0.2], max: [1.6, 1.6, 2.0]}}
""")


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("seed", range(3))
def test_the_room_in_a_region_of_another_shape_is_what_dense_points_say(shape: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    mission = gate_of(SHAPES[shape], yaw=float(rng.uniform(-90, 90)), pitch=float(rng.uniform(-40, 40)), reach=0.3)
    hoop, margin = mission.hoops["a"], float(rng.uniform(0.01, 0.06))
    room, normal = room_in_region(hoop, margin), np.array(hoop.normal)
    along = rng.uniform(-margin, margin, 20_000)
    side = np.cross(normal, rng.normal(size=(20_000, 3)))
    side /= np.linalg.norm(side, axis=1)[:, None]
    depths = [hoop.measures.depths(along[:, None] * normal + far * side) for far in (room, room + 0.03)]
    assert depths[0].min() >= margin - 1e-5  # of a quadric in 256 directions
    assert depths[1].min() < margin or shape == "union"  # several of its parts may hold more than the best one does


def test_a_shape_that_says_where_it_is_stays_there_whatever_the_ring_does() -> None:
    mission = gate_of(SHAPES["prism"], yaw=70.0)
    hoop = mission.hoops["a"]
    assert hoop.center == (0.0, 0.1, 1.1)
    corners = np.array([[-0.3, -0.3, 1.0], [0.3, -0.2, 1.0], [0.2, 0.5, 1.0], [-0.35, 0.4, 1.0]])
    middle = corners.mean(axis=0)
    assert np.all(hoop.level(middle + 0.999 * (corners - middle)) <= 1.0)
    assert np.all(hoop.level(middle + 1.001 * (corners - middle)) > 1.0)
    assert parse_mission(mission_to_yaml(mission)) == mission
    turned = hoop.changed(yaw_deg=160.0)
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    about = np.array(hoop.center) + 0.999 * (corners - np.array(hoop.center)) @ quarter.T
    assert np.all(turned.level(about) <= 1.0)


@pytest.mark.parametrize("shape", ["box", *(pytest.param(name, marks=pytest.mark.slow) for name in SHAPES if name != "box")])
def test_rings_stand_in_regions_of_all_shapes(shape: str) -> None:
    for formula in ("F a & F goal", "F(goal & F G a)"):
        done = certified_team(ltlplan.plan(gate_of(SHAPES[shape], yaw=20.0, formula=formula), seed=0))
        assert verify.judge(done.plan, done.team, largest=False).holds
