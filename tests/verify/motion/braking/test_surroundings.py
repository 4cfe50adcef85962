"""How near robots come in braking to walls, rims, obstacles and closed regions: the proof against dense sampling by school geometry."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.motion.braking import brakes
from tests.helpers.motion.solid_distances import distances
from tests.helpers.motion.solids import random_solid
from tests.helpers.motion.stand_ins import hover, minimum_snap
from verify.data import Mission, Trajectory
from verify.motion.braking.closed_regions import ClosedRegions
from verify.motion.braking.surroundings import Braking, Nearness, Surrounding
from verify.motion.braking.targets import Rims, Solids, Walls
from verify.motion.paths import read_team

LENGTH = 1.0
Floats = np.ndarray
BOX = (np.array([-2.0, -2.0, 0.3]), np.array([2.0, 2.0, 2.0]))
HOOP = (0.3, -0.2, 1.0)
OPENING, RIM = 0.25, 0.02
BALL = (0.4, 0.5, 1.1)


def world(flight: Trajectory, **changes: Any) -> Mission:
    start = tuple(map(float, flight.coefficients[0, :3, 0]))
    data: dict[str, Any] = {
        "name": "room",
        "spec": {"formula": "true"},
        "regions": {"far": {"center": [-1.7, -1.7, 1.8], "radii": [0.1, 0.1, 0.1]}},
        "agents": {"one": {"start": start}},
        "vehicle": "crazyflie-2.1",
        "workspace": {"min": BOX[0].tolist(), "max": BOX[1].tolist()},
    }
    return Mission.model_validate({**data, **changes})


def random_flight(rng: np.random.Generator) -> Trajectory:
    places = rng.uniform((-1.3, -1.3, 0.7), (1.3, 1.3, 1.6), (rng.integers(2, 5), 3))
    return minimum_snap(places, rng.uniform(1.2, 2.5, len(places) - 1))


def sampled_places(flight: Trajectory) -> Floats:
    """Where braking leads, over a grid of instants and shares. Shape (n, 3)."""
    return brakes(flight, np.linspace(0.0, flight.duration, 900), np.linspace(0.0, 1.0, 30), LENGTH).reshape(-1, 3)


def from_rim(places: Floats) -> Floats:
    along = np.abs(places[:, 0] - HOOP[0])
    across = np.linalg.norm(places[:, 1:] - np.array(HOOP[1:]), axis=1)
    beside = np.maximum(np.maximum(OPENING - across, across - OPENING - RIM), 0.0)
    return np.hypot(np.maximum(along - RIM / 2, 0.0), beside)


def asked_around(seed: int, kind: str) -> tuple[Braking, type, float]:
    """Return a random flight, what is asked of it, and the least distance that is sampled of that, m."""
    rng = np.random.default_rng(seed)
    flight = random_flight(rng)
    places, changes = sampled_places(flight), dict[str, Any]()
    if kind == "walls":
        found = np.minimum(places - BOX[0], BOX[1] - places).min(axis=1)
        asked: type = Walls
    elif kind == "rims":
        found, asked = from_rim(places), Rims
        changes["hoops"] = {"gate": {"center": HOOP, "radii": (0.2, 0.2, 0.2), "opening": OPENING, "rim": RIM, "yaw_deg": 0.0}}
    elif kind == "solids":
        shape = random_solid(rng)[0]
        found, asked = distances(shape, places), Solids
        changes["obstacles"] = {"block": shape}
    else:
        found, asked = np.linalg.norm(places - np.array(BALL), axis=1) - 0.3, ClosedRegions
        changes["regions"] = {"ball": {"center": BALL, "radii": (0.3, 0.3, 0.3), "only": ["other"]}}
        changes["robots"] = {"other": {"initial": "a", "states": {"a": []}}, "this": {"initial": "a", "states": {"a": []}}}
        changes["environment"] = {"edges": []}
    mission = world(flight, **changes)
    if kind == "regions":
        mission = mission.model_copy(update={"agents": {"one": mission.agents["one"].model_copy(update={"robot": "this"})}})
    radius = mission.vehicle_of("one").radius if kind in ("rims", "solids") else 0.0
    return Braking(read_team(mission, {"one": flight}), Fraction(LENGTH)), asked, float(found.min()) - radius


def nearness(braking: Braking, asked: type, margin: float) -> Nearness | None:
    around: Surrounding = asked(braking.paths, Fraction(margin))
    return braking.nearness(around)


def agrees_with_sampling(seed: int, kind: str) -> bool:
    """Tell whether the judge's answers to a little more and a little less than a dense sampler finds are what that says."""
    braking, asked, sampled = asked_around(seed, kind)
    more = max(sampled, 0.0) + 0.0005
    found = nearness(braking, asked, more)
    if found is None or not (found.fails or (kind == "regions" and sampled >= -0.001)):
        return False  # though the sampler's own place says so
    less = nearness(braking, asked, sampled - 0.01) if sampled > 0.02 else None
    # what the sampler's grid leaves out may say so
    return less is None or (less.fails and (kind == "regions" or less.high < sampled + 0.2))


@pytest.mark.parametrize("kind", ["walls", "rims", "solids", "regions"])
@few_of(1, "seed", [0, 1])
def test_random_flights_brake_as_near_as_sampled(seed: int, kind: str) -> None:
    assert agrees_with_sampling(seed, kind)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["walls", "rims", "solids", "regions"])
@pytest.mark.parametrize("seed", range(2, 30))
def test_many_random_flights_brake_as_near_as_sampled(seed: int, kind: str) -> None:
    assert agrees_with_sampling(seed, kind)


def test_a_place_that_is_too_near_is_where_it_is_said() -> None:
    braking, asked, sampled = asked_around(3, "walls")
    found = nearness(braking, asked, max(sampled, 0.0) + 0.02)
    assert found is not None
    assert found.fails
    flight = braking.paths.trajectories[0]
    (place,) = brakes(flight, np.array([found.instants[0]]), np.array([found.shares[0]]), LENGTH)[0]
    gaps = np.concatenate([place - BOX[0], BOX[1] - place])
    assert int(np.argmin(gaps)) == found.target
    assert float(gaps.min()) == pytest.approx(found.high, abs=1e-9)
    assert found.low <= sampled + 1e-9


def test_who_hovers_at_the_margin_is_neither_refused_for_sure_nor_proved() -> None:
    still = hover(place=(1.5, 0.0, 1.0), duration=3.0)
    braking = Braking(read_team(world(still), {"one": still}), Fraction(LENGTH))
    assert braking.nearness(Walls(braking.paths, Fraction("0.4999999"))) is None
    tie = braking.nearness(Walls(braking.paths, Fraction(1, 2)))
    assert tie is not None
    assert not tie.fails
    assert tie.low == pytest.approx(0.5)
