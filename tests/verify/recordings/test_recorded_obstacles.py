"""Recorded flights beside obstacles: kept, broken, and what the samples cannot tell."""

import numpy as np
import pytest

from verify.data import Mission, load_vehicle
from verify.data.sections import Agent, Box, Spec
from verify.data.shapes.obstacle import Obstacle
from verify.data.shapes.region import Hoop
from verify.recordings.flight_log import Samples
from verify.recordings.flight_reference import FlightReference, World
from verify.recordings.flight_verdict import check_flight

WALL = {"center": (0.0, 0.0, 1.0), "size": (0.05, 2.0, 1.9)}
RADIUS = load_vehicle("crazyflie-2.1").radius


def verdict(points, *, step=0.02, openings=(), **bounds):
    """Judge a recording of straight lines at 1 m/s."""
    mission = Mission(
        name="solid",
        spec=Spec(formula="true"),
        hoops={"door": Hoop(center=(0.0, 0.5, 1.0), radii=(0.2, 0.2, 0.2), opening=0.3, rim=0.02)} if openings else {},
        obstacles={"wall": Obstacle.model_validate({**WALL, "openings": openings})},
        agents={"r": Agent(start=points[0])},
        vehicle=load_vehicle("crazyflie-2.1"),
        workspace=Box(min=(-5, -5, -5), max=(5, 5, 5)),
    )
    corners = np.array(points, dtype=float)
    lengths = np.r_[0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))]
    times = np.arange(0, lengths[-1] + step / 2, step)
    places = np.stack([np.interp(times, lengths, axis) for axis in corners.T], axis=1)
    asked = FlightReference((World(0.0, mission),))
    found = check_flight(Samples(times=times, positions={"r": places}), asked, max_speed=1.05, **bounds)
    (claim,) = [claim for claim in found.claims if claim.name == "obstacles"]
    return claim


def test_a_recording_that_keeps_away_is_clear() -> None:
    claim = verdict([(-1, 0, 1), (-0.2, 0, 1), (-0.2, 0.5, 1)])
    assert claim.outcome == "holds"
    assert RADIUS < claim.bound <= 0.175
    assert "'wall'" in claim.sentence


def test_a_sample_in_a_wall_breaks_the_claim() -> None:
    claim = verdict([(-1, 0, 1), (1, 0, 1)])
    assert claim.outcome == "fails"
    assert claim.witness.region == "wall"
    assert claim.time == pytest.approx(1.0, abs=0.03)
    assert "inside obstacle 'wall'" in claim.sentence


@pytest.mark.parametrize(("off", "outcome"), [(RADIUS + 2e-3, "holds"), (RADIUS + 1e-4, "undecided"), (RADIUS - 1e-5, "fails")])
def test_beside_a_wall_the_samples_tell_to_what_lies_between_them(off: float, outcome: str) -> None:
    line = [(-0.025 - off, -1.0, 1), (-0.025 - off, 1.0, 1)]
    assert verdict(line, step=0.01).outcome == outcome
    assert verdict(line, step=0.01, error=0.01).outcome == "undecided"


def test_between_samples_anything_may_be() -> None:
    """Every sample is far enough away, and the wall lies between two of them."""
    assert verdict([(-0.5, 0.0, 1), (0.5, 0.0, 1)], step=0.5).outcome == "fails"  # one is in the middle
    assert verdict([(-0.25, 0.0, 1), (0.25, 0.0, 1)], step=0.5).outcome == "undecided"


def test_through_its_opening_a_wall_may_be_passed() -> None:
    through = [(-1, 0.5, 1), (1, 0.5, 1)]
    assert verdict(through, openings=("door",)).outcome == "holds"
    assert verdict(through).outcome == "fails"
    aside = [(-1, 0.5 + 0.26, 1), (1, 0.5 + 0.26, 1)]
    assert verdict(aside, openings=("door",)).outcome == "fails"
