"""Least distances of robots whose clocks differ, against dense samples of all shifts, over flights, laps and weights."""

from fractions import Fraction

import numpy as np
import pytest

from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.verify.motion.test_separation import pair_mission, started, still
from verify import judge
from verify.motion.paths import read_team
from verify.motion.separation import minimum_distances, pairwise_distances
from verify.motion.shifted_distances import ShiftedDistances


def found(mission, team, error):
    distances = pairwise_distances(read_team(mission, team))
    (near,) = minimum_distances(distances)
    return ShiftedDistances(distances).least(0, Fraction(error), near.high)


def sampled(team, error, weight, laps=1):
    """Least distance over times and shifts, by samples: laps are flown one after the other."""
    flown = [path.flattened(laps) for path in team.values()]
    times = np.linspace(0, max(path.duration for path in flown), 2001)
    least = np.inf
    for shift in np.linspace(-error, error, 41):
        here, there = (path.evaluate(np.clip(times + s, 0, None))[:, :3] for path, s in zip(flown, (0, shift), strict=True))
        least = min(least, float(np.linalg.norm((here - there) * weight, axis=1).min()))
    return least


@pytest.mark.parametrize("cases", [2, pytest.param(60, marks=pytest.mark.slow)])
def test_proved_distances_against_dense_samples_of_all_shifts(cases):
    rng = np.random.default_rng(cases)
    for _ in range(cases):
        points = rng.uniform([-1, -1, 0.5], [1, 1, 2], (2, int(rng.integers(2, 5)), 3))
        team = {
            f"r{i}": legs(p, speed=float(rng.uniform(0.3, 2)), hold=float(rng.choice([0, 0.7]))) for i, p in enumerate(points)
        }
        apart = {"separation": 0.3, "separation_z": float(rng.choice([0.15, 0.3, 0.6]))}
        mission = started(pair_mission(radius=0.05).model_copy(update=apart), team)
        error = float(rng.choice([0.01, 0.02, 0.05, 0.3, 1.0]))
        least = sampled(team, error, np.array([1, 1, 0.3 / apart["separation_z"]]))
        near = found(mission, team, error)
        assert near.low <= least + 1e-9
        assert near.low <= near.high <= least + 5e-3


def test_over_the_seam_of_laps_one_robot_may_already_be_in_the_next_lap():
    # the second robot follows the first round the lap's end, closer than a quarter of a second behind
    mission = pair_mission(trace="infinite")
    round_trip = legs([[0, 0, 1], [1, 0, 1], [0, 0, 1]], speed=1.0, cycle=0)
    waiting = legs([[0.6, 0, 1], [0.6, 0.4, 1], [0.6, 0, 1]], speed=0.4, cycle=0)
    team = {"r0": round_trip, "r1": waiting}
    mission = started(mission, team)
    for error in (0.0625, 0.5):
        near, least = found(mission, team, error), sampled(team, error, np.ones(3), laps=3)
        assert near.low <= least + 1e-9
        assert near.high <= least + 1e-2


def test_whoever_hovers_is_as_near_as_at_one_time():
    team = {"r0": still([0, 0.5, 1]), "r1": legs([[-1, 0, 1], [1, 0, 1]], speed=1.0)}
    near = found(started(pair_mission(), team), team, 0.5)
    assert near.low == pytest.approx(0.5, abs=1e-4)
    assert near.low <= 0.5


@pytest.mark.parametrize("cases", [2, pytest.param(30, marks=pytest.mark.slow)])
def test_teams_whose_clocks_differ_by_the_default_keep_what_is_certified_and_are_refused_where_they_do_not(cases):
    """Each robot flies by its own clock, off by any two's claimed difference: random offsets, and the ends of the range."""
    rng = np.random.default_rng(cases + 1)
    verdicts = {}
    for _ in range(cases):
        ways = rng.uniform([-1, -1, 0.8], [1, 1, 1.4], (3, 3, 3))
        ways[:, 0, 0] = [-0.8, 0.0, 0.8]
        team = {f"r{i}": legs(way, speed=float(rng.uniform(0.5, 2))) for i, way in enumerate(ways)}
        least = min(near.low for near in minimum_distances(pairwise_distances(read_team(trio(team, 0.15), team))))
        mission = trio(team, max(least - float(rng.uniform(-0.005, 0.04)), 0.15))
        certificate = judge(plan_of(mission, {}), team, margin=0.0, largest=False)
        separation = [claim for claim in certificate.claims if claim.name == "separation"]
        assert certificate.clock_error >= 0.02
        times = np.linspace(-0.1, certificate.duration + 0.1, 1501)
        offsets = [np.zeros(3), *(np.eye(3) * certificate.clock_error), *rng.uniform(0, certificate.clock_error, (12, 3))]
        for claim in separation:
            a, b = (int(name[1]) for name in (claim.robot, claim.other))
            flown = min(
                float(np.linalg.norm(np.subtract(*(at(team[f"r{i}"], times + offset[i]) for i in (a, b))), axis=1).min())
                for offset in offsets
            )
            asked = mission.separation
            assert claim.outcome != "holds" or flown >= asked - 1e-7
            assert claim.outcome != "fails" or flown <= asked + 5e-3
            verdicts.setdefault(claim.outcome, []).append(flown < asked)
    assert not any(verdicts["holds"])
    assert any(verdicts["fails"])


def trio(team, separation):
    """Three robots that start where they fly, and keep so much."""
    mission = small_mission(regions="", starts=[path.coefficients[0, :3, 0].tolist() for path in team.values()])
    small = mission.vehicle.changed(radius=0.05)
    return mission.model_copy(update={"vehicle": small, "separation": separation})


def at(path, times):
    return path.evaluate(np.clip(times, 0, path.duration))[:, :3]
