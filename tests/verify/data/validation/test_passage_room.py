"""How wide a passage may be for its region to contain it, against dense points."""

from __future__ import annotations

import numpy as np
import pytest

from refine.corridor.passage_room import room_in_region
from tests.helpers.few import few_of
from tests.helpers.missions.gates import SHAPES, gate, gate_of
from verify.data import mission_to_yaml, parse_mission


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


@pytest.mark.parametrize("shape", SHAPES)
@few_of(1, "seed", range(3))
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
