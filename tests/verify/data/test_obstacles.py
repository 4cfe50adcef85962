"""Obstacles in mission files: what is read, what is refused in which words, and that missions without them are what they were."""

import re

import pytest

from verify.data import BadInput, Mission, MissionError, mission_to_yaml, parse_mission
from verify.data.shapes.obstacle import Obstacle
from verify.data.shapes.solid_parts import solid_parts

TEXT = """
format: 1
name: window
spec: {formula: F door & F r0}
hoops:
  door: {center: [0, 0, 1], radii: [0.2, 0.2, 0.2], opening: 0.3, rim: 0.02}
regions:
  r0: {center: [1, 0, 1], radii: [0.2, 0.2, 0.2]}
obstacles:
  wall: {center: [0, 0, 1], size: [0.05, 2.0, 2.0], openings: [door]}
robot: {initial: idle, states: {idle: [ready]}}
agents: {quad0: {start: [-1.0, 0, 1.0]}}
vehicle: crazyflie-2.1
workspace: {min: [-1.5, -1.5, 0.0], max: [1.5, 1.5, 2.0]}
"""


def changed(old: str, new: str) -> str:
    assert old in TEXT, old
    return TEXT.replace(old, new)


def test_a_resolved_mission_reads_back() -> None:
    mission = parse_mission(TEXT)
    again = parse_mission(mission_to_yaml(mission))
    assert again.digest() == mission.digest()
    assert again.obstacles["wall"].body == mission.obstacles["wall"].body
    assert mission.obstacles["wall"].openings == ("door",)
    assert mission.propositions == {"door", "r0", "ready", "free"}


def test_missions_without_obstacles_say_nothing_of_them() -> None:
    text = TEXT.replace(TEXT[TEXT.index("obstacles:") : TEXT.index("robot:")], "")
    mission = parse_mission(text)
    assert "obstacles" not in mission.resolved()
    assert mission.changed(obstacles={}).digest() == mission.digest()
    assert parse_mission(text + "obstacles: {}\n").digest() == mission.digest()


@pytest.mark.parametrize(
    ("old", "new", "keys", "sentence"),
    [
        ("openings: [door]", "openings: [dor]", "obstacles.wall.openings.0", "Did you mean 'door'?"),
        ("openings: [door]", "openings: [door, door]", "obstacles.wall.openings.1", "'door' stands there twice"),
        ("openings: [door]", "openings: door", "obstacles.wall.openings", "must be a list"),
        (", openings: [door]", "", "hoops.door", "A hoop in a wall is one of its `openings: [door]`"),
        ("start: [-1.0, 0, 1.0]", "start: [-0.1, 0.5, 1]", "agents.quad0.start", "is 0.0750 m from obstacle 'wall'"),
        ("start: [-1.0, 0, 1.0]", "start: [0.0, 0.5, 1]", "agents.quad0.start", "lies inside obstacle 'wall'"),
        ("start: [-1.0, 0, 1.0]", "start: [-1.0, 0, 1.0], end: [0, 0.7, 1]", "agents.quad0.end", "lies inside obstacle"),
        ("wall: {center: [0, 0, 1]", "wall: {center: [0.5, 0, 1]", "obstacles.wall.openings.0", "stands in its wall"),
        ("size: [0.05, 2.0", "size: [0.05, 0.6", "obstacles.wall.openings.0", "reaches out of the wall at (0, 0.32, 1)"),
        ("  wall:", "  r0:", "obstacles.r0", "names both an obstacle and a region"),
        ("  wall:", "  door:", "obstacles.door", "names both an obstacle and a hoop"),
        ("  wall:", "  ready:", "obstacles.ready", "names both an obstacle and an internal proposition"),
        ("  wall:", "  F:", "obstacles.F", "cannot name an obstacle"),
        ("  wall:", "  a-b:", "obstacles.a-b", "is no name"),
        ("r0: {center: [1, 0, 1], radii: [0.2, 0.2", "r0: {center: [0, 0.8, 1], radii: [0.02, 0.02", "regions.r0", "lies inside"),
        ("size: [0.05", "sizes: [0.05", "obstacles.wall.radii", "missing: an obstacle needs its shape"),
        ("size: [0.05", "radii: [1, 1, 1], size: [0.05", "obstacles.wall.size", "an obstacle has one shape"),
        ("size: [0.05, 2.0, 2.0]", "size: [0.05]", "obstacles.wall.size", "must have 3 entries, not 1: [0.05]"),
        ("size: [0.05, 2.0, 2.0]", "size: [0.05, 2.0]", "obstacles.wall.size", "must have 3 entries, not 2: [0.05, 2.0]"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_where_it_is(old: str, new: str, keys: str, sentence: str) -> None:
    with pytest.raises(MissionError, match=re.escape(sentence)) as caught:
        parse_mission(changed(old, new))
    assert keys in {".".join(map(str, fault.keys)) for fault in caught.value.faults}


def test_a_start_off_a_corner_has_the_room_that_it_has() -> None:
    """Each face is nearer than 0.12 m, and the edge is not."""
    off = 0.0851  # beyond both faces of the edge at (0.025, 1): 0.1203 m from it
    mission = parse_mission(changed("start: [-1.0, 0, 1.0]", f"start: [{0.025 + off}, {1 + off}, 1.0]"))
    assert mission.agents["quad0"].start[0] == 0.025 + off
    with pytest.raises(MissionError, match="from obstacle 'wall'"):
        parse_mission(changed("start: [-1.0, 0, 1.0]", f"start: [{0.024 + off}, {1 + off}, 1.0]"))


def test_many_obstacles_are_refused_at_once() -> None:
    mission = parse_mission(TEXT)
    many = {f"o{k}": mission.obstacles["wall"] for k in range(2_000)}
    with pytest.raises(BadInput, match="2000 obstacles; 1000 is the most"):
        mission.changed(obstacles=many)


def union(*members: str) -> Mission:
    wall = f"  wall: {{union: [{', '.join(members)}], openings: [door]}}"
    return parse_mission(changed(TEXT[TEXT.index("  wall:") : TEXT.index("robot:")], wall + "\n"))


def test_an_opening_leads_through_the_parts_that_hold_the_hoop() -> None:
    left, right = "{center: [0, 0.5, 1], size: [0.05, 1, 2]}", "{center: [0, -0.5, 1], size: [0.05, 1, 2]}"
    mission = union(left, right)
    parts = solid_parts(mission.obstacles, mission.hoops)
    assert [len(part.holes) for part in parts] == [1, 1]
    off = "{center: [0, -0.6, 1], size: [0.05, 1, 2]}"
    with pytest.raises(MissionError, match="reaches out of the wall"):  # the second part fills a part of the ring
        union("{center: [0, 0.45, 1], size: [0.05, 1.1, 2]}", off)
    with pytest.raises(
        MissionError, match=r"0.0250 m from obstacle 'wall'.* fills the opening"
    ):  # a second layer shuts the way
        union("{center: [0, 0, 1], size: [0.05, 2, 2]}", "{center: [0.2, 0, 1], size: [0.35, 2, 2]}")


def test_obstacles_turn_and_move_as_regions_do() -> None:
    wall = Obstacle.model_validate({"center": (0.0, 0.0, 1.0), "size": (0.05, 2.0, 2.0), "yaw_deg": 30})
    turned = wall.changed(yaw_deg=120.0, center=(1.0, 0.0, 1.0))
    again = Obstacle.model_validate({"center": (1.0, 0.0, 1.0), "size": (0.05, 2.0, 2.0), "yaw_deg": 120})
    assert [one.bound for one in turned.body[0]] == [one.bound for one in again.body[0]]
    assert turned.half_lengths == pytest.approx(again.half_lengths)
