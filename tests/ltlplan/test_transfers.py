"""Flights from where robots stand to their starts, and from their ends to the ground."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import ltlplan
from ltlplan.pipeline import certified_team
from ltlplan.transfers import LANDING, Transfer, to_ground, to_starts
from tests.helpers.live.live_missions import pair
from tests.helpers.motion.stand_ins import rest_to_rest
from verify.data import BadInput, Trajectory

COLUMN = "obstacles: {column: {center: [0.0, -0.5, 1.0], size: [0.2, 0.2, 2.0]}}"
MISSION = pair("[-1.0, 0.8, 1.0]", "[1.0, 0.8, 1.4]", more=COLUMN)


@pytest.fixture(scope="module")
def certified():
    mission = ltlplan.parse_mission(MISSION)
    return mission, certified_team(ltlplan.plan(mission, pace="nominal")).team


def positions(team: dict[str, Trajectory]) -> dict[str, np.ndarray]:
    """Samples of all robots over the longest flight, each hovering after its own. Shape (samples, 3) a robot."""
    times = np.linspace(0.0, max(path.duration for path in team.values()), 4001)
    return {name: path.evaluate(times)[:, :3] for name, path in team.items()}


def nearest(transfer: Transfer) -> float:
    pairs = itertools.combinations(positions(transfer.team).values(), 2)
    return min(float(np.linalg.norm(one - other, axis=1).min()) for one, other in pairs)


@pytest.mark.slow
def test_robots_that_stand_below_each_others_starts_get_to_their_own(certified) -> None:
    mission, team = certified
    places = {"one": (1.05, -0.5, 0.02), "two": (-1.0, -0.55, 0.0)}
    climb, way = to_starts(mission, team, places)
    assert (climb.name, way.name) == ("climb", "way")
    for name, path in team.items():
        steps = [climb.team[name], way.team[name]]
        joints = [places[name], steps[0].evaluate(steps[0].duration)[:3], path.evaluate(0.0)[:3]]
        ends = [steps[0].evaluate(0.0)[:3], steps[1].evaluate(0.0)[:3], steps[1].evaluate(steps[1].duration)[:3]]
        assert np.allclose(joints, ends, atol=1e-5)
        assert steps[0].evaluate(steps[0].duration)[3] == pytest.approx(path.evaluate(0.0)[3], abs=1e-5)
        sideways = positions(climb.team)[name][:, :2] - np.array(places[name][:2])
        assert np.abs(sideways).max() < 1e-4, "it climbs straight up"
    for transfer in (climb, way):
        assert transfer.certified.certificate.covers(transfer.team)
        assert nearest(transfer) > mission.separation
    low, high = np.array([-0.1, -0.6, 0.0]), np.array([0.1, -0.4, 2.0])
    for path in positions(way.team).values():
        gap = np.linalg.norm(np.maximum(0.0, np.maximum(low - path, path - high)), axis=1)
        assert gap.min() > mission.vehicle.radius
    assert min(path[:, 2].min() for path in positions(way.team).values()) > 0.3


def test_robots_land_where_they_are(certified) -> None:
    mission, team = certified
    (landing,) = to_ground(mission, team, {"one": (-1.0, -0.5, 0.0), "two": (1.0, -0.5, 0.02)})
    for name, path in team.items():
        begin, end = landing.team[name].evaluate([0.0, landing.team[name].duration])[:, :3]
        assert np.allclose(begin, path.evaluate(path.duration)[:3], atol=1e-5)
        assert np.allclose(end[:2], begin[:2], atol=1e-4)
        assert end[2] == pytest.approx({"one": 0.0, "two": 0.02}[name] + LANDING, abs=1e-4)


def test_a_robot_that_ends_above_another_flies_home_before_it_lands(certified) -> None:
    mission, _ = certified
    team = {
        "one": rest_to_rest([(-1.0, -0.5, 1.0), (0.5, 0.5, 1.0)], [6.0]),
        "two": rest_to_rest([(1.0, -0.5, 1.0), (0.5, 0.5, 1.6)], [6.0]),
    }
    places = {"one": (-1.0, -0.5, 0.0), "two": (1.0, -0.5, 0.0)}
    home, landing = to_ground(mission, team, places)
    assert (home.name, landing.name) == ("home", "landing")
    for name, place in places.items():
        assert np.allclose(
            landing.team[name].evaluate(landing.team[name].duration)[:3], np.add(place, (0, 0, LANDING)), atol=1e-4
        )
    assert min(nearest(home), nearest(landing)) > mission.separation


@pytest.mark.parametrize(
    ("places", "says"),
    [
        ({"one": (0, 0, 0)}, "where does two stand"),
        ({"one": (0, 0, 0), "two": (1, 0, 0), "three": (1, 1, 0)}, "three"),
        ({"one": (0, 0, 0), "two": (1, 0)}, "x, y and z"),
        ({"one": (0, 0, 0), "two": (1, 0, float("nan"))}, "finite"),
        ({"one": (-1, -0.5, 0), "two": (-1, -0.4, 0)}, "0.1"),
        ({"one": (-1, -0.5, 0), "two": (0, -0.5, 0)}, "column"),
        ({"one": (-1, -0.5, 0), "two": (1.99, -0.5, 0)}, "workspace"),
    ],
)
def test_places_where_no_flight_can_begin_are_refused_by_name(certified, places, says) -> None:
    with pytest.raises(BadInput, match=says):
        to_starts(*certified, places)


def test_a_flight_that_does_not_end_at_rest_has_no_landing(certified) -> None:
    mission, team = certified
    moving = Trajectory([2.0], np.pad(np.array([[[-1.0, 0.2], [-0.5, 0.0], [1.0, 0.0], [0.0, 0.0]]]), ((0, 0), (0, 0), (0, 6))))
    with pytest.raises(BadInput, match="one's flight does not end at rest"):
        to_ground(mission, {**team, "one": moving}, {"one": (-1, -0.5, 0), "two": (1, -0.5, 0)})
