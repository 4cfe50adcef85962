"""Boxes, cylinders, prisms and unions from mission files: what they are compiled to, and what is refused."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import pytest

from ltlplan.missions.notes import notes_of
from tests.helpers.motion.solids import random_solid
from verify.data import BadInput, MissionError, mission_to_yaml, parse_mission
from verify.data.shapes.region import Region

MISSION = """format: 1
name: rooms
spec: {{formula: F a}}
agents: {{q: {{start: [-1.8, -1.8, 1.0]}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-2, -2, 0.2], max: [5, 5, 2.5]}}
regions:
  a: {shape}
"""
SHAPES = {
    "box": "{center: [1, 0, 1], size: [1, 0.5, 0.8], yaw_deg: 30}",
    "cylinder": "{center: [1, 0, 1], cylinder: {radius: 0.4, height: 1.2}}",
    "prism": "{prism: {polygon: [[0, 0], [2, 0], [1, 1.5]], z: [0.4, 1.6]}}",
    "union": "{union: [{prism: {polygon: [[0, 0], [4, 0], [4, 1], [0, 1]], z: [0.4, 2]}}, {center: [0.5, 2, 1.2], size: [1, 2, 1.6]}]}",
}


def region(shape: str) -> Region:
    return parse_mission(MISSION.format(shape=shape)).regions["a"]


@pytest.mark.parametrize("name", SHAPES)
def test_a_resolved_mission_holds_the_inequalities(name: str) -> None:
    mission = parse_mission(MISSION.format(shape=SHAPES[name]))
    text = mission_to_yaml(mission)
    assert "parts:" in text
    assert not {"size", "cylinder", "prism", "union"} & set(text.replace(":", " ").split())
    assert parse_mission(text) == mission


def test_floats_agree_with_school_geometry() -> None:
    rng = np.random.default_rng(0)
    for _ in range(100):
        data, holds = random_solid(rng)
        body = Region.model_validate(data)
        points = rng.normal(size=(500, 3)) + body.center
        depth = holds(points)
        clear = np.abs(depth) > 1e-9
        assert np.array_equal(body.level(points)[clear] <= 1, depth[clear] > 0)
        half, far = np.array(body.half_lengths), np.linalg.norm(points - body.center, axis=1)
        assert np.all((np.abs(points - body.center) <= half + 1e-9)[depth > 0])
        assert np.all((far <= body.outer_radius + 1e-9)[depth > 0])
        assert np.all((depth >= 0)[far < body.inner_radius - 1e-9])
        steps = points + rng.normal(size=(500, 3)) * 0.05
        change = np.abs(np.sqrt(body.level(steps)) - np.sqrt(body.level(points)))
        assert np.all(change <= np.linalg.norm(steps - points, axis=1) / body.inner_radius + 1e-9)


def test_measures_are_those_of_the_body() -> None:
    box = region("{center: [1, 0, 1], size: [2, 1, 0.5]}")
    assert (box.inner_radius, box.half_lengths) == (0.25, (1.0, 0.5, 0.25))
    assert box.outer_radius == pytest.approx(np.sqrt(1 + 0.25 + 0.0625))
    prism = region("{prism: {polygon: [[0, 0], [4, 0], [4, 1], [0, 1]], z: [0.5, 2.5]}}")
    assert prism.center == (2.0, 0.5, 1.5)
    assert prism.inner_radius == pytest.approx(0.5)
    clockwise = region("{prism: {polygon: [[0, 1], [4, 1], [4, 0], [2, 0], [0, 0]], z: [0.5, 2.5]}}")
    assert sorted(one.linear for one in clockwise.parts[0]) == sorted(one.linear for one in prism.parts[0])
    room = region(SHAPES["union"])
    assert room.center == (2.0, 0.5, 1.2) or room.inner_radius == pytest.approx(0.5)
    assert len(room.measures.covers) > len(room.body)


def test_a_region_moves_and_turns() -> None:
    box = region("{center: [1, 0, 1], size: [2, 1, 0.5]}")
    there = box.changed(center=(3.0, 1.0, 1.0), yaw_deg=90.0)
    points = np.array([[3.0, 1.9, 1.0], [3.9, 1.0, 1.0]])
    assert (there.level(points) <= 1).tolist() == [True, False]


@pytest.mark.parametrize(
    ("shape", "keys", "says"),
    [
        ("{prism: {polygon: [[0, 0], [1, 1], [1, 0], [0, 1]], z: [0, 1]}}", ("prism",), "crosses the edge after [1, 0]"),
        (
            "{prism: {polygon: [[0, 0], [2, 0], [1, 0.2], [0, 1]], z: [0, 1]}}",
            ("prism",),
            "turns inwards at [1, 0.2]; split it there",
        ),
        ("{prism: {polygon: [[0, 0], [2, 0], [1, 0]], z: [0, 1]}}", ("prism",), "on a line"),
        (
            "{prism: {polygon: [[0, 0], [2, 0], [1, 1], [0, 0]], z: [0, 1]}}",
            ("prism",),
            "number 1 and 4 (a polygon closes by itself",
        ),
        ("{prism: {polygon: [[0, 0], [2, 0]], z: [0, 1]}}", ("prism", "polygon"), "at least 3"),
        ("{prism: {polygon: [[0, 0], [2, 0], [1, 1]], z: [1, 1]}}", ("prism",), "the ceiling 1 m must lie above the floor 1 m"),
        ("{prism: {polygon: [[0, 0], [2.0e+9, 0], [1, 1]], z: [0, 1]}}", ("prism",), "coordinates must lie between"),
        ("{prism: {polygon: [[0, 0], [1.0e-8, 0], [0, 1.0e-8]], z: [0, 1]}}", (), "is flat"),
        ("{prism: {polygon: [[0, 0], [.nan, 0], [1, 1]], z: [0, 1]}}", ("prism", "polygon", 1, 0), "finite number"),
        (
            f"{{prism: {{polygon: {[[i, i * i] for i in range(61)]}, z: [0, 1]}}}}",
            ("prism", "polygon"),
            "at most 60 entries, not 61",
        ),
        ("{center: [0, 0, 1], prism: {polygon: [[0, 0], [2, 0], [1, 1]], z: [0, 1]}}", ("center",), "leave `center` out"),
        ("{yaw_deg: 3, prism: {polygon: [[0, 0], [2, 0], [1, 1]], z: [0, 1]}}", ("yaw_deg",), "leave `yaw_deg` out"),
        ("{center: [0, 0, 1], size: [1, 1, 1.0e-9]}", ("size",), "must lie between 2e-06 m and 2e+06 m"),
        ("{center: [0, 0, 1], size: [1, 1, -1]}", ("size", 2), "greater than 0"),
        ("{center: [0, 0, 1], size: [1, .nan, 1]}", ("size", 1), "finite"),
        ("{size: [1, 1, 1]}", ("center",), "missing"),
        ("{center: [0, 0, 1], cylinder: {radius: 1.0e+9, height: 1}}", ("cylinder",), "must lie between"),
        ("{center: [0, 0, 1], cylinder: {radius: 1, hight: 1}}", ("cylinder", "hight"), "Did you mean 'height'?"),
        ("{center: [0, 0, 1], size: [1, 1, 1], radii: [1, 1, 1]}", ("size",), "one shape, but `radii` and `size`"),
        ("{union: []}", ("union",), "at least 1"),
        ("{union: [{size: [1, 1, 1]}]}", ("union",), "member 1: `center` is missing"),
        ("{union: [{center: [0, 0, 1], size: [1, 1, 1]}, {center: [0, 0, 1]}]}", ("union",), "member 2: it needs one shape"),
        ("{union: [{center: [0, 0, 1], size: [1, 1, 1], yaw: 3}]}", ("union",), "Did you mean 'yaw_deg'?"),
        (
            "{union: [{prism: {polygon: [[0, 0], [2, 0], [1, 0.2], [0, 1]], z: [0, 1]}}]}",
            ("union",),
            "member 1: polygon: not convex",
        ),
    ],
)
def test_each_fault_is_told(shape: str, keys: tuple[Any, ...], says: str) -> None:
    with pytest.raises(MissionError) as refused:
        parse_mission(MISSION.format(shape=shape))
    found = {fault.keys: fault.reason for fault in refused.value.faults}
    assert says in found["regions", "a", *keys]
    assert not any("at least 3 entries, not 3" in reason for reason in found.values())


@pytest.mark.parametrize("thick", [1e-4, 3e-6])
def test_sheets_have_their_centre_inside(thick: float) -> None:
    for polygon, z in (([[0, 0], [1, 0], [1, thick], [0, thick]], [0, 1]), ([[0, 0], [1, 0], [0, 1]], [0.3, 0.3 + thick])):
        sheet = Region.model_validate({"prism": {"polygon": polygon, "z": z}})
        assert 0.24 * thick < sheet.inner_radius < 0.51 * thick


def test_unions_of_bodies_that_do_not_touch_are_allowed_with_a_note() -> None:
    apart = "[{center: [0, 0, 1], size: [1, 1, 1]}, {center: [3, 0, 1], size: [1, 1, 1]}, {center: [1, 0, 1], size: [1, 1, 1]}]"
    mission = parse_mission(MISSION.format(shape=f"{{union: {apart}}}"))
    assert notes_of(mission) == (
        "regions.a is 2 bodies that do not touch (parts 1, 3; part 2), and a robot leaves it on the way from one to another.",
    )
    together = apart.replace("[3, 0, 1]", "[2, 0, 1]")
    assert notes_of(parse_mission(MISSION.format(shape=f"{{union: {together}}}"))) == ()


def test_hostile_numbers_end_in_a_sentence() -> None:
    rng = np.random.default_rng(1)
    numbers = [0.0, -0.0, 5e-324, 1e-300, 1e-12, 1.0, -1.0, 1e6, 1e300, -1.7e308, 0.1]
    taken = 0
    for _ in range(300):
        corner = [[float(rng.choice(numbers)), float(rng.choice(numbers))] for _ in range(int(rng.integers(3, 6)))]
        shape = {"prism": {"polygon": corner, "z": [float(rng.choice(numbers)), float(rng.choice(numbers))]}}
        center = [float(rng.choice(numbers)) for _ in range(3)]
        other = {"center": center, "size": [float(abs(rng.choice(numbers))) for _ in range(3)]}
        for data in (shape, other, {"union": [shape, other]}):
            try:
                body = Region.model_validate(data)
            except ValueError:
                continue
            taken += 1
            assert body.inner_radius > 0
            assert np.isfinite(body.outer_radius)
    assert taken > 10


def test_many_regions_load_quickly() -> None:
    rows = [f"  r{i}_{j}: {{center: [{i}, {j}, 1], size: [1, 1, 1]}}" for i in range(15) for j in range(14)]
    head = MISSION.partition("  a: {shape}")[0].format().replace("F a", "F r0_0").replace("max: [5, 5", "max: [20, 20")
    start = time.perf_counter()
    mission = parse_mission(head + "\n".join(rows))
    assert len(mission.regions) == 210
    assert time.perf_counter() - start < 60  # seconds; a search for other packages at each region took longer


def test_a_quadratic_form_is_asked_of_ellipsoids_alone() -> None:
    for shape in SHAPES.values():
        with pytest.raises(BadInput, match="Only ellipsoids"):
            _ = region(shape).quadratic


def test_a_region_has_64_parts_at_most() -> None:
    ones = [f"{{center: [{0.1 * i:.1f}, 0, 1], size: [0.2, 0.2, 0.2]}}" for i in range(65)]
    assert len(region("{union: [" + ", ".join(ones[:64]) + "]}").body) == 64
    with pytest.raises(MissionError, match="at most 64 convex parts"):
        region("{union: [" + ", ".join(ones) + "]}")
    faces = "{quadratic: [[0, 0, 0], [0, 0, 0], [0, 0, 0]], linear: [%s, %s, %s], bound: 1}"
    around = [faces % (math.cos(a), math.sin(a), 0) for a in np.linspace(0, 2 * np.pi, 62, endpoint=False)]
    ends = [faces % (0, 0, 1), faces % (0, 0, -1)]
    (part,) = region("{center: [0, 0, 1], parts: [[" + ", ".join([*around, *ends]) + "]]}").body
    assert len(part) == 64
    with pytest.raises(MissionError, match="1 to 64 inequalities"):
        region("{center: [0, 0, 1], parts: [[" + ", ".join([*around, *ends, ends[0]]) + "]]}")
