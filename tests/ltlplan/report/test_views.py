"""The drawings of a mission from above and from two sides: to scale, with what vehicles keep from what is solid."""

import re

import numpy as np
import pytest
from typer.testing import CliRunner

from flight.pictures import scene
from ltlplan.cli import app
from ltlplan.report.views import clearance_sentences, views_html
from verify.data import parse_mission
from verify.data.shapes.obstacle import Obstacle

WALLED = """\
format: 1
name: walled
spec: {formula: F goal}
hoops:
  window: {center: [0, 0.2, 1.0], radii: [0.3, 0.3, 0.3], opening: 0.3, rim: 0.03, reach: 0.5}
regions:
  goal: {center: [1.2, -0.6, 0.9], size: [0.6, 0.4, 0.2]}
obstacles:
  wall: {center: [0, 0, 1.1], size: [0.1, 2.8, 2.2], openings: [window]}
  rock: {center: [-0.8, 0.6, 0.5], radii: [0.3, 0.2, 0.4], yaw_deg: 90}
agents:
  quad0: {start: [-1.5, -1.0, 0.8]}
vehicle: crazyflie-2.1
workspace: {min: [-1.9, -1.4, 0.1], max: [1.9, 1.4, 2.0]}
"""
CLOSED = re.sub(r"hoops:\n.*\n", "", WALLED).replace("[0.1, 2.8, 2.2], openings: [window]", "[0.1, 2.9, 4.0]")


def drawn(view: int, what: str, title: str = "") -> list[np.ndarray]:
    """The corners of what is drawn in one view, m, from the workspace's lower left corner; y upwards."""
    svg = re.findall(r"<svg viewBox.*?</svg>\S*?</svg>|<svg viewBox.*?</figure>", views_html(parse_mission(WALLED)), re.DOTALL)[
        view
    ]
    height = float(re.search(r'class="workspace" width="[\d.]+" height="([\d.]+)"', svg)[1])  # type: ignore[index]
    found = re.findall(rf'<path class="{what}"[^>]*? d="M([^"]*)Z">(?:<title>{title})', svg) if title else []
    found = found or re.findall(rf'<path class="{what}" d="M([^"]*)Z">', svg)
    shapes = [np.array([[float(x) for x in point.split()] for point in each.split("l")]).cumsum(axis=0) for each in found]
    return [np.stack([points[:, 0], height - points[:, 1]], axis=1) / 100.0 for points in shapes]


def spans(points: np.ndarray) -> list[float]:
    return [round(float(x), 2) for x in (*points.min(axis=0), *points.max(axis=0))]


@pytest.mark.parametrize(
    ("view", "wall", "rock"),
    [
        (0, [1.85, 0.0, 1.95, 2.8], [0.9, 1.7, 1.3, 2.3]),
        (1, [1.85, -0.1, 1.95, 2.1], [0.9, 0.0, 1.3, 0.8]),
        (2, [0.0, -0.1, 2.8, 2.1], [1.7, 0.0, 2.3, 0.8]),
    ],
)
def test_solid_bodies_are_where_they_are(view: int, wall: list[float], rock: list[float]) -> None:
    assert [spans(each) for each in drawn(view, "solid", "wall")] == [wall]
    assert [spans(each) for each in drawn(view, "solid", "rock")] == [rock]


def test_what_centres_may_not_cross_is_a_radius_and_the_margin_from_solid_bodies() -> None:
    around = spans(drawn(0, "keep")[0])
    assert around == [1.85 - 0.12, -0.12, 1.95 + 0.12, 2.92]


def test_a_window_is_a_hole_with_what_is_left_of_it() -> None:
    (hole,) = drawn(2, "hole")
    assert spans(hole) == [1.3, 0.6, 1.9, 1.2]
    assert spans(drawn(2, "keep")[-1]) == [1.42, 0.72, 1.78, 1.08]  # over what is solid
    mission = parse_mission(WALLED)
    assert clearance_sentences(mission) == [
        "quad0: the vehicle's centre keeps 0.12 m from solid bodies (radius and margin).",
        "'window' in 'wall' is 0.6 m wide; centres may be 0.18 m off its axis.",
    ]


def test_names_stand_where_there_is_room_for_them() -> None:
    mission = parse_mission(WALLED)
    goal = mission.regions["goal"]
    crowded = mission.changed(regions={"goal": goal, "goal_too": goal.changed(center=(1.2, -0.6, 1.5))})
    names = [re.findall(r'class="name"[^>]*>(\w+)<', view) for view in views_html(crowded).split("<figure>")[1:]]
    assert names[0] == ["window", "goal", "rock"]  # the wall is thinner than its name, and the other goal stands above this one
    assert names[1][:3] == ["window", "goal", "goal_too"]


def test_obstacles_stand_in_scenes_while_they_are_there() -> None:
    mission = parse_mission(WALLED)
    without = mission.changed(obstacles={"wall": mission.obstacles["wall"]})
    moved = Obstacle(center=(0.8, 0.6, 0.5), radii=(0.3, 0.2, 0.4))
    last = mission.changed(obstacles={**mission.obstacles, "rock": moved})
    figure = scene(last, {}, earlier=[(2.0, without), (5.0, mission)]).plotly()
    rocks = [(trace.meta, trace.visible) for trace in figure.data if trace.type == "mesh3d" and trace.name == "rock"]
    assert rocks == [({"since": 2.0, "until": 5.0}, False), ({"since": 5.0}, True)]
    gone = scene(without, {}, earlier=[(3.0, mission)]).plotly()
    assert [trace.meta for trace in gone.data if trace.name == "rock" and trace.type == "mesh3d"] == [
        {"since": 0.0, "until": 3.0}
    ]
    assert [trace.meta for trace in gone.data if trace.name == "wall" and trace.type == "mesh3d"] == [None]


def test_a_mission_without_a_plan_is_drawn_with_the_reason(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "closed.yaml").write_text(CLOSED)
    done = CliRunner().invoke(app, ["show", "closed.yaml"])
    assert done.exit_code != 0
    page = (tmp_path / "walled.html").read_text()
    assert 'class="views"' in page
    assert 'class="warning"' in page
