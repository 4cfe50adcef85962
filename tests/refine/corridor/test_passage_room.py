"""A passage is inside its hoop's region by the margin as long as the opening is near, however much wider the opening is."""

from __future__ import annotations

import numpy as np
import pytest

import ltlplan
import verify
from ltlplan import parse_mission
from ltlplan.pipeline import certified_team
from refine import refine
from verify.data import Infeasible, Mission
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
    with pytest.raises(Infeasible, match=r"'a' has radii .* so no visit could contain a passage. Give it larger `radii`"):
        refine(ltlplan.plan(mission, seed=0))
