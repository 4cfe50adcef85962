"""Flights through oblique openings, proved to a millimetre of room and never without it, against points of what is solid.

A path is sampled densely, and what is solid is known by itself: the feet on a wall's faces, the opening's two edges as curves, and the
opening's wall between them; of an upright cylinder by a cloud of its surface's points. Nothing of the judge is used for that.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial import KDTree

from tests.helpers.few import few_of
from tests.verify.motion.obstacles.test_obstacles import RADIUS, claims, dense, lines, world
from verify.arithmetic.balls import Floats
from verify.data import Mission, Trajectory
from verify.data.shapes.region import Hoop

CENTRE = np.array([0.0, 0.0, 1.0])
SAMPLES = 2500


def across(axis: Floats) -> Floats:
    """Two unit vectors across an axis. Shape (2, 3)."""
    found = np.zeros((2, 3))
    found[0] = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))]).real
    found[0] /= np.linalg.norm(found[0])
    found[1] = np.cross(axis, found[0]).real
    return found


def off_axis(points: Floats, axis: Floats) -> Floats:
    offset = points - CENTRE
    return np.linalg.norm(offset - (offset @ axis)[:, None] * axis, axis=1)


def wall_distances(points: Floats, axis: Floats, radius: float, thick: float) -> Floats:
    """How far points are from a wide wall |x| <= thick / 2 with an opening; 0 within it. Shape (n,)."""
    angles = np.linspace(0, 2 * np.pi, 20_000)
    ring = CENTRE + radius * np.stack([np.cos(angles), np.sin(angles)], 1) @ across(axis)
    least = np.full(len(points), np.inf)
    for side in (-thick / 2, thick / 2):
        edge = ring + ((side - ring[:, 0]) / axis[0])[:, None] * axis
        foot = points * [0, 1, 1] + [side, 0, 0]
        solid = off_axis(foot, axis) >= radius
        least = np.minimum(least, KDTree(edge).query(points)[0])
        least[solid] = np.minimum(least, np.abs(points[:, 0] - side))[solid]
    offset = points - CENTRE
    along = (offset @ axis)[:, None] * axis
    outward = (offset - along) / np.maximum(off_axis(points, axis), 1e-12)[:, None]
    inner = np.abs((CENTRE + along + radius * outward)[:, 0]) <= thick / 2
    least[inner] = np.minimum(least, radius - off_axis(points, axis))[inner]
    return np.where((np.abs(points[:, 0]) <= thick / 2) & (off_axis(points, axis) >= radius), 0.0, least)


def column_distances(points: Floats, axis: Floats, radius: float, wide: float) -> Floats:
    """How far points are from an upright cylinder of 4 m with an opening, about; never less. Shape (n,)."""
    angles, heights = np.meshgrid(np.linspace(0, 2 * np.pi, 700), np.linspace(-1.5, 1.5, 500))
    skin = CENTRE + np.stack([wide * np.cos(angles), wide * np.sin(angles), heights], -1).reshape(-1, 3)
    skin = skin[off_axis(skin, axis) >= radius]
    angles, steps = np.meshgrid(np.linspace(0, 2 * np.pi, 500), np.linspace(-2, 2, 900))
    ring = np.stack([np.cos(angles).ravel(), np.sin(angles).ravel()], 1) @ across(axis)
    tube = CENTRE + radius * ring + steps.reshape(-1, 1) * axis
    tube = tube[(np.hypot(tube[:, 0], tube[:, 1]) <= wide) & (np.abs(tube[:, 2] - 1) <= 1.5)]
    inside = (np.hypot(points[:, 0], points[:, 1]) <= wide) & (off_axis(points, axis) >= radius)
    return np.where(inside, 0.0, KDTree(np.concatenate([skin, tube])).query(points)[0])


def drawn_path(rng: np.random.Generator, axis: Floats, radius: float, *, curved: bool) -> Trajectory:
    """Through the opening, not along its axis, straight or on a curve of degree 4."""
    sides = across(axis)
    way = axis + rng.uniform(-0.6, 0.6, 2) @ sides
    way /= np.linalg.norm(way)
    middle = CENTRE + rng.uniform(-0.3, 0.3, 2) * radius @ sides
    flight = lines(middle - way, middle + way)
    if not curved:
        return flight
    table = flight.coefficients.copy()
    power = np.array([1.0])
    for bend in rng.uniform(-0.06, 0.06, (4, 2)):
        power = np.convolve(power, [-1.0, 2.0])
        table[0, :3, : len(power)] += np.outer(bend @ across(way), power)
    return Trajectory(flight.durations, table)


def drawn(rng: np.random.Generator, *, curved: bool, column: bool) -> tuple[Mission, Trajectory, float]:
    """Return a world, a flight that passes through its opening, and how near the flight comes to what is solid, m."""
    while True:
        radius = float(rng.uniform(0.15, 0.45))
        yaw, pitch = float(rng.uniform(-55, 55)), float(rng.uniform(-35, 35))
        hoop = Hoop(center=(0.0, 0.0, 1.0), radii=(0.5, 0.5, 0.5), yaw_deg=yaw, pitch_deg=pitch, opening=radius, rim=0.02)
        axis = np.array(hoop.normal)
        flight = drawn_path(rng, axis, radius, curved=curved)
        points, size = dense(flight, SAMPLES), float(rng.choice([0.005, 0.02, 0.1, 0.3]))
        shape: dict[str, Any]
        if column:
            size += 0.5
            shape = {"center": [0.0, 0.0, 1.0], "cylinder": {"radius": size, "height": 3.0}, "openings": ["door"]}
            apart = column_distances(points, axis, radius, size)
        else:
            shape = {"center": [0.0, 0.0, 1.0], "size": [size, 6.0, 6.0], "openings": ["door"]}
            apart = wall_distances(points, axis, radius, size)
        if (least := float(apart.min())) > RADIUS + 0.012:
            return world([shape], tuple(points[0].tolist()), {"door": hoop}), flight, least


def outcome(mission: Mission, flight: Trajectory, need: float) -> str:
    (claim,) = claims(mission, flight, need - RADIUS)
    return claim.outcome


def assert_proved_to_a_millimetre(rng: np.random.Generator, count: int, *, curved: bool) -> None:
    for _ in range(count):
        mission, flight, least = drawn(rng, curved=curved, column=False)
        assert [outcome(mission, flight, least - room) == "holds" for room in (0.01, 0.001, -0.001)] == [True, True, False]


@few_of(1, "curved", [True, False])
@few_of(1, ("seed", "number"), [(0, 2), (0, 6), (1, 6)])
def test_flights_through_oblique_openings_are_proved_to_a_millimetre(seed: int, number: int, curved: bool) -> None:
    assert_proved_to_a_millimetre(np.random.default_rng(seed), number, curved=curved)


@pytest.mark.slow
@pytest.mark.parametrize("curved", [False, True])
@pytest.mark.parametrize("seed", range(100, 104))
def test_a_thousand_flights_through_oblique_openings(seed: int, curved: bool) -> None:
    assert_proved_to_a_millimetre(np.random.default_rng(seed), 120, curved=curved)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_openings_through_round_bodies_are_never_wider_than_they_are(seed: int) -> None:
    """Clouds are coarse: what is solid may be some 0.1 mm nearer than they say. Of 1 cm of room most flights are proved."""
    rng, proved = np.random.default_rng(seed), 0
    for k in range(8):
        mission, flight, least = drawn(rng, curved=bool(k % 2), column=True)
        assert outcome(mission, flight, least + 0.001) != "holds"
        proved += outcome(mission, flight, least - 0.01) == "holds"
    assert proved >= 7
