"""Climb and landing of exports, held against dense samples of all that robots may do in their columns."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import flight
from flight.exports.vertical_corridors import columns
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.helpers.motion.solid_distances import distances
from verify import certify
from verify.data import MissionError
from verify.data.frame import Frame
from verify.data.sections import Box

RADIUS = 0.07  # of small missions' vehicle
NEEDED = RADIUS + 0.05
BOXES = ((0.35, 0.3, 0.5), (0.6, 0.25, 0.4))


def ring_distances(center: np.ndarray, yaw: float, opening: float, rim: float, points: np.ndarray) -> np.ndarray:
    """How far points are from a level ring, by its section: a rectangle turned about its axis."""
    normal = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    along = (points - center) @ normal
    out = np.linalg.norm(points - center - along[:, None] * normal, axis=1)
    beside = np.maximum(np.maximum(opening - out, out - opening - rim), 0.0)
    return np.hypot(beside, np.maximum(np.abs(along) - rim / 2, 0.0))


def world(rng: np.random.Generator):
    """Two robots above random places, a box and a hoop."""
    starts = [(*rng.uniform(-0.6, 0.6, 2).round(3).tolist(), round(rng.uniform(0.3, 1.4), 3)) for _ in range(2)]
    size = BOXES[int(rng.integers(2))]
    box = {"center": [*rng.uniform(-0.8, 0.8, 2).round(3).tolist(), round(rng.uniform(0.2, 1.2), 3)], "size": list(size)}
    yaw = float(rng.integers(0, 180))
    ring = [*rng.uniform(-0.9, 0.9, 2).round(3).tolist(), round(rng.uniform(0.4, 1.2), 3)]
    hoops = f"h: {{center: {ring}, yaw_deg: {yaw}, radii: [0.1, 0.1, 0.1], opening: 0.25, rim: 0.04}}"
    extra = f"obstacles: {{crate: {box}}}"
    mission = small_mission(regions="", hoops=hoops, starts=[(-4.0, -4.0, 1.0), (4.0, 4.0, 1.0)], extra=extra, margin=0.05)
    mission = mission.model_copy(update={"workspace": Box(min=(-0.75, -0.75, 0.0), max=(0.75, 0.75, 1.5))})
    return mission, starts, box, (np.array(ring), np.radians(yaw), 0.25, 0.04)


@pytest.mark.parametrize("count", [20, pytest.param(500, marks=pytest.mark.slow)])
def test_what_is_certified_is_clear_at_dense_samples_and_what_is_not_is_not(count) -> None:
    rng, found = np.random.default_rng(3), {True: 0, False: 0}
    for number in range(count):
        try:
            mission, starts, box, ring = world(rng)
        except MissionError:  # the crate stands in the hoop
            continue
        team = {f"r{i}": legs([start]) for i, start in enumerate(starts)}
        lines = {
            name: np.stack(np.broadcast_arrays(*path.evaluate(0.0)[:2], np.linspace(0.0, path.evaluate(0.0)[2], 400)), axis=1)
            for name, path in team.items()
        }
        near = min(
            min(distances(box, line).min() - NEEDED, ring_distances(*ring, line).min() - NEEDED) for line in lines.values()
        )
        walls = min(min(0.75 - np.abs(line[:, :2]).max(), 1.5 - line[:, 2].max()) - 0.05 for line in lines.values())
        apart = min(
            np.linalg.norm(a[:, None, :2] - b[None, :, :2], axis=2).min() for a, b in itertools.combinations(lines.values(), 2)
        )
        slack = min(near, walls, apart - mission.least_distance("r0", "r1") - 0.1)
        judged = columns(mission, team, "landing" if number % 2 else "climb", 0.05)
        if abs(slack) > 2e-3:  # samples are 4 mm apart
            assert judged.certified is bool(slack > 0), (judged.sentence, near, walls, apart)
        found[judged.certified] += 1
    assert min(found.values()) > count // 10


def test_the_ground_lies_where_the_laboratory_has_it() -> None:
    """A crate that ends below the laboratory's ground is no crate to climb from, one that is above it is."""
    extra = "obstacles: {crate: {center: [0.0, 0.0, -0.5], size: [0.4, 0.4, 0.6]}}"
    mission = small_mission(regions="", starts=[(0.0, 0.0, 1.0)], extra=extra, margin=0.05)
    team = {"r0": legs([(0.0, 0.0, 1.0)])}
    assert columns(mission, team, "climb", 0.05).certified
    low = mission.model_copy(update={"frame": Frame(rotation_deg=30.0, offset=(3.0, 0.0, 1.0))})  # z = 0 there is -1 here
    found = columns(low, team, "climb", 0.05)
    assert found.faults == ("r0, below its start, comes within 0.000 m of obstacle 'crate', and 0.120 m are needed",)
    high = mission.model_copy(update={"frame": Frame(offset=(0.0, 0.0, -1.5))})
    assert columns(high, team, "climb", 0.05).faults == ("r0's start is not above the ground",)


def test_a_hoop_on_the_way_down_is_named_and_a_flight_that_does_not_end_at_rest() -> None:
    hoops = "h: {center: [1.0, 0.25, 0.5], radii: [0.1, 0.1, 0.1], opening: 0.25, rim: 0.04}"
    mission = small_mission(regions="", hoops=hoops, starts=[(0.0, 0.0, 1.0)], margin=0.05)
    path = legs([(0.0, 0.0, 1.0), (1.0, 0.0, 1.0)])
    assert columns(mission, {"r0": path}, "climb", 0.05).certified
    found = columns(mission, {"r0": path}, "landing", 0.05)
    assert found.sentence.startswith("Landing not certified: r0, below its end, comes within 0.")
    assert "m of the rim of 'h', and 0.120 m are needed." in found.sentence
    half = type(path)([path.durations[0] / 2], path.coefficients[:1])
    assert columns(mission, {"r0": half}, "landing", 0.05).faults == ("r0 does not hover at its end",)


@pytest.mark.parametrize("target", ["crazyswarm2", "px4"])
def test_the_note_says_what_is_proved_of_robots_that_are_not_written_as_well(target, tmp_path) -> None:
    starts = ((0.0, 0.0, 0.6), (0.2, 0.0, 1.4), (0.0, 2.0, 1.0))
    mission = small_mission(regions="", starts=starts, margin=0.05)
    team = flight.with_hovers({f"r{i}": legs([start]) for i, start in enumerate(starts)})
    cert = certify(plan_of(mission, {}), team)
    flight.export(team, cert, tmp_path, format=target, robots=["r0"], force=True)
    note = (tmp_path / "README.txt").read_text()
    assert "Landing not certified: r0 and r1 end too near to each other, seen from above." in note
    assert ("Climb not certified: r0 and r1 start too near" in note) is (target == "crazyswarm2")
