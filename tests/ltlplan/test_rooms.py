"""Regions of all shapes from mission to proved files: boxes, a cylinder, an L-shaped room, and a house whose rooms share walls."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import ltlplan
import verify
from flight.shapes import region_shapes
from ltlplan.systems.region_labels import Layout, apart
from verify.data import parse_mission
from verify.data.events import HoopMoves
from verify.data.mission import Mission
from verify.data.shapes.region import Region

HEAD = """format: 1
name: rooms
vehicle: crazyflie-2.1
workspace: {min: [-2.2, -2.2, 0.2], max: [2.2, 2.2, 2.1]}
margin: 0.05
agents: {quad0: {start: [0.0, 0.0, 1.0]}}
"""
SHAPES = (
    HEAD
    + """spec: {formula: "F a & F b & F c & G !(a & b)"}
regions:
  a: {center: [1.2, 0.0, 1.0], size: [0.8, 0.8, 0.8]}
  b: {center: [-1.0, 0.8, 1.0], cylinder: {radius: 0.35, height: 1.0}}
  c:
    union:
      - {prism: {polygon: [[-1.5, -1.2], [0.2, -1.2], [0.2, -0.7], [-1.5, -0.7]], z: [0.6, 1.4]}}
      - {center: [-1.25, -0.45, 1.0], size: [0.5, 0.5, 0.8]}
"""
)
HOUSE = (
    HEAD
    + """spec: {formula: "F kitchen & F bath & G !office"}
regions:
  hall: {prism: {polygon: [[-2, -0.6], [2, -0.6], [2, 0.6], [-2, 0.6]], z: [0.3, 1.9]}}
  kitchen: {prism: {polygon: [[-2, 0.6], [0, 0.6], [0, 2], [-2, 2]], z: [0.3, 1.9]}}
  bath: {prism: {polygon: [[0, 0.6], [2, 0.6], [2, 2], [0, 2]], z: [0.3, 1.9]}}
  office: {prism: {polygon: [[-2, -2], [2, -2], [2, -0.6], [-2, -0.6]], z: [0.3, 1.9]}}
environment: {edges: [[hall, kitchen], [hall, bath], [hall, office]]}
"""
)


@pytest.mark.slow
def test_shapes_are_flown_and_proved_again_from_files(tmp_path: Path, pace: float | str) -> None:
    result = ltlplan.run(parse_mission(SHAPES), tmp_path / "run", pace=pace)
    assert result.certificate.holds
    assert {visit.region for visit in result.plan.robots["quad0"].visits} == {"a", "b", "c"}
    assert verify.recheck(tmp_path / "run").holds
    assert verify.check_recording(tmp_path / "run" / "flight.csv", result.mission, max_speed=2.0).outcome == "holds"
    page = (tmp_path / "run" / "mission.yaml").read_text()
    assert "parts:" in page
    assert "union" not in page


@pytest.mark.slow
def test_rooms_that_share_a_wall_are_entered_straight_along_an_edge(tmp_path: Path) -> None:
    mission = parse_mission(HOUSE)
    result = ltlplan.run(mission, tmp_path / "run")
    assert result.certificate.holds
    word = result.plan.robots["quad0"].word
    assert frozenset({"hall", "bath"}) in word.letters
    assert not any({"bath", "kitchen"} <= letter for letter in word.letters)  # no edge joins them, though they share a wall
    assert verify.recheck(tmp_path / "run").holds


def test_a_wall_without_an_edge_is_not_crossed() -> None:
    shut = parse_mission(HOUSE.replace("[hall, kitchen], ", ""))
    with pytest.raises(ltlplan.Unsatisfiable):
        ltlplan.plan(shut)


@pytest.mark.slow
def test_an_l_shaped_room_is_held_across_its_seam(tmp_path: Path) -> None:
    """The start lies in one arm, the place to visit in the other, and the room is never left."""
    room = """spec: {formula: "F corner & G room"}
regions:
  room:
    union:
      - {prism: {polygon: [[-2, -0.6], [2, -0.6], [2, 0.6], [-2, 0.6]], z: [0.3, 1.9]}}
      - {prism: {polygon: [[-2, 0.6], [-0.5, 0.6], [-0.5, 2], [-2, 2]], z: [0.3, 1.9]}}
  corner: {center: [-1.25, 1.4, 1.0], size: [0.5, 0.5, 0.5]}
"""
    mission = parse_mission(HEAD.replace("[0.0, 0.0, 1.0]", "[-1.0, 0.0, 1.0]") + room)
    result = ltlplan.run(mission, tmp_path / "run")
    assert result.certificate.holds
    assert all("room" in letter for letter in result.plan.robots["quad0"].word.letters)


def test_floats_tell_which_regions_lie_apart() -> None:
    box = Region.model_validate({"center": (0.0, 0.0, 1.0), "size": (1.0, 1.0, 1.0)})
    for x, lie_apart in ((0.999, False), (1.0, False), (1.001, True)):
        assert apart(box, box.changed(center=(x, 0.3, 1.0))) == lie_apart
        post = Region.model_validate({"center": (x, 0.0, 1.0), "cylinder": {"radius": 0.5, "height": 1.0}})
        assert apart(box, post) == lie_apart
        assert apart(post, box) == lie_apart
        ball = Region(center=(x, 0.0, 1.0), radii=(0.5, 0.5, 0.5))
        assert apart(box, ball) == lie_apart


def test_robots_in_flight_are_seen_in_regions_of_every_shape() -> None:
    mission = parse_mission(SHAPES)
    points = np.random.default_rng(0).uniform(mission.workspace.min, mission.workspace.max, (500, 3))
    seen = Layout(mission).regions_at(points)
    for name, region in mission.regions.items():
        inside = region.level(points) <= 1.0
        assert 0 < inside.sum() < 250
        assert [name in here for here in seen] == inside.tolist()


def test_the_way_through_a_shared_wall_shows_both_names() -> None:
    layout = Layout(parse_mission(HOUSE))
    way = layout.way(layout.middles["hall"], layout.middles["bath"])
    assert way == (frozenset({"hall"}), frozenset({"hall", "bath"}), frozenset({"bath"}))
    assert layout.way(layout.middles["bath"], layout.middles["hall"]) == tuple(reversed(way))


def test_a_room_moves_in_a_changed_world() -> None:
    mission = parse_mission(SHAPES)
    after = HoopMoves(time=1.0, region="a", center=(1.0, 0.3, 1.0), yaw_deg=45.0).apply(mission)
    assert isinstance(after, Mission)
    assert after.regions["a"].level(np.array([1.5, 0.3, 1.0])) <= 1.0


def test_every_part_is_drawn() -> None:
    regions = parse_mission(SHAPES).regions
    assert [len(region_shapes(name, region, "red")) for name, region in regions.items()] == [2, 2, 3]
    body = region_shapes("b", regions["b"], "red")[0]
    points = np.stack([body["x"], body["y"], body["z"]], axis=1)
    assert np.abs(np.hypot(points[:, 0] + 1.0, points[:, 1] - 0.8) - 0.35).max() < 0.02
