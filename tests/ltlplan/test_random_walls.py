"""Random rooms with walls, beams and posts: what is planned is refined, judged, and held against samples of our own."""

from __future__ import annotations

import math

import numpy as np
import pytest

import ltlplan
import verify
from refine import refine
from tests.helpers.missions.rooms_by_hand import sampled
from verify.data import Mission, parse_mission

PLACES = ((-2.3, -2.3, 1.0), (2.3, 2.3, 1.0), (-2.3, 2.3, 1.0))
NEED = 0.07 + 0.05


def random_walls(seed: int) -> tuple[Mission, list[dict[str, tuple[float, ...] | float]]]:
    """A room with boxes at random, turned or not, and posts; clear of its start and its two goals."""
    rng = np.random.default_rng(seed)
    lines, solid = [], []
    for k in range(int(rng.integers(4, 14))):
        at = rng.uniform([-2.6, -2.6, 0.3], [2.6, 2.6, 1.7]).round(3)
        size = rng.uniform([0.05, 0.3, 0.5], [0.3, 2.5, 2.0]).round(3)
        yaw = 0.0 if rng.random() < 0.6 else round(float(rng.uniform(0, 90)), 1)
        post = rng.random() < 0.25
        if any(np.linalg.norm((np.array(place) - at)[:2]) < 0.65 + np.hypot(size[0], size[1]) / 2 for place in PLACES):
            continue
        shape = f"cylinder: {{radius: {size[0]}, height: {size[2]}}}" if post else f"size: {size.tolist()}, yaw_deg: {yaw}"
        lines.append(f"  o{k}: {{center: {at.tolist()}, {shape}}}\n")
        solid.append({"at": tuple(at), "size": tuple(size), "yaw": math.radians(yaw), "post": float(post)})
    return parse_mission(
        f"""
format: 1
name: walls
spec: {{formula: F a & F b}}
regions:
  a: {{center: {list(PLACES[1])}, size: [0.6, 0.6, 0.6]}}
  b: {{center: {list(PLACES[2])}, radii: [0.3, 0.3, 0.3]}}
agents: {{q: {{start: {list(PLACES[0])}}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-3, -3, 0.2], max: [3, 3, 1.9]}}
margin: 0.05
planner: {{speed: {0.5 + seed % 3}}}
obstacles:
"""
        + "".join(lines)
    ), solid


def distances(points: np.ndarray, one: dict) -> np.ndarray:
    """How far points are from a box or post, m, by school geometry."""
    offset, size = points - np.array(one["at"]), np.array(one["size"])
    if one["post"]:
        beside = np.maximum(np.hypot(offset[:, 0], offset[:, 1]) - size[0], 0.0)
        return np.hypot(beside, np.maximum(np.abs(offset[:, 2]) - size[2] / 2, 0.0))
    cos, sin = math.cos(one["yaw"]), math.sin(one["yaw"])
    x, y, z = offset.T
    own = np.stack([cos * x + sin * y, -sin * x + cos * y, z], axis=1)
    return np.linalg.norm(np.maximum(np.abs(own) - size / 2, 0.0), axis=1)


@pytest.mark.slow  # a plan and a proof each
@pytest.mark.parametrize("seed", range(16))
def test_random_rooms_with_walls_are_certified_and_clear(seed: int) -> None:
    mission, solid = random_walls(seed)
    plan = ltlplan.plan(mission)
    team = refine(plan)
    assert verify.judge(plan, team, largest=False).holds
    points = sampled(team["q"], 400)
    assert min(float(distances(points, one).min()) for one in solid) >= NEED
