"""How near robots come to one another when all brake at once: the proof against dense sampling, and against what says that it fails."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

import numpy as np
import pytest

from tests.helpers.motion.braking import brakes, closest, random_team
from tests.helpers.motion.stand_ins import hover, rest_to_rest
from verify.data import BadInput, Mission, Trajectory, parse_mission
from verify.motion.braking.pairs import Meeting, closest_braking
from verify.motion.paths import read_team

LENGTH = 1.0
MISSION = """
format: 1
name: room
spec: {formula: "true"}
regions: {left: {center: [-1.0, 0.4, 1.0], radii: [0.25, 0.25, 0.25]}}
agents: {one: {start: [-1.0, 0.0, 1.0]}, two: {start: [1.0, 0.0, 1.0]}}
vehicle: crazyflie-2.1
workspace: {min: [-9.0, -9.0, 0.0], max: [9.0, 9.0, 3.0]}
"""


def world(team: Mapping[str, Trajectory], **changes: float) -> Mission:
    agents = {name: {"start": tuple(map(float, path.coefficients[0, :3, 0]))} for name, path in team.items()}
    asked = parse_mission(MISSION)
    made = {name: asked.agents["one"].model_copy(update=agent) for name, agent in agents.items()}
    return asked.model_copy(update={"agents": made, **changes})


def meeting(team: Mapping[str, Trajectory], asked: float, error: float = 0.0, **changes: float) -> Meeting | None:
    paths = read_team(world(team, **changes), team)
    count = len(paths.robots)
    return closest_braking(paths, Fraction(LENGTH), [[Fraction(asked)] * count] * count, Fraction(error))


def judged_beside_sampling(seed: int, error: float) -> tuple[float, list[tuple[float, Meeting | None]]]:
    """Return what a dense sampler finds of a random team, and the judge's answers to a little more and a little less."""
    team = random_team(np.random.default_rng(seed))
    sampled = closest(team, LENGTH, error=error, instants=700, shares=25)
    asked = [sampled + more for more in ((0.0005, 0.02, -0.02) if sampled > 0.03 else (0.1,))]
    return sampled, [(distance, meeting(team, distance, error)) for distance in asked]


def agrees(sampled: float, distance: float, found: Meeting | None) -> bool:
    """Tell whether an answer is what sampling says; only what the sampler's grid leaves out may refuse less than it found."""
    if distance < sampled:
        return found is None or found.high < distance
    return found is not None and found.fails and found.high < distance


@pytest.mark.parametrize(("seed", "error"), [(5, 0.0), (1, 0.02)])
def test_random_teams_are_as_near_as_sampled(seed: int, error: float) -> None:
    sampled, answers = judged_beside_sampling(seed, error)
    assert answers
    assert all(agrees(sampled, distance, found) for distance, found in answers)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 60))
def test_many_random_teams_are_as_near_as_sampled(seed: int) -> None:
    sampled, answers = judged_beside_sampling(seed, (0.0, 0.02, 0.2)[seed % 3])
    assert answers
    assert all(agrees(sampled, distance, found) for distance, found in answers)


def test_what_says_that_robots_come_too_near_is_where_it_is_said() -> None:
    team = random_team(np.random.default_rng(3))
    sampled = closest(team, LENGTH, instants=700, shares=25)
    found = meeting(team, sampled + 0.01)
    assert found is not None
    names = list(team)
    share, time = np.array([found.shares[0]]), np.array([found.instants[0]])
    one, other = (brakes(team[names[robot]], time, share, LENGTH)[0, 0] for robot in found.robots)
    assert float(np.linalg.norm(one - other)) == pytest.approx(found.high, abs=1e-9)
    assert found.low < sampled <= found.high + 2e-3


def test_robots_that_hover_are_as_far_apart_as_they_stand() -> None:
    team = {"one": hover(place=(0.0, 0.0, 1.0), duration=2.0), "two": hover(place=(0.5, 0.0, 1.0), duration=7.0)}
    assert meeting(team, 0.4999999) is None
    assert meeting(team, 0.4999999, 3.0) is None
    found = meeting(team, 0.5001)
    assert found is not None
    assert found.fails
    assert found.high == pytest.approx(0.5)


def test_a_tie_is_neither_proved_nor_refuted() -> None:
    team = {"one": hover(place=(0.0, 0.0, 1.0), duration=2.0), "two": hover(place=(0.5, 0.0, 1.0), duration=2.0)}
    found = meeting(team, 0.5)
    assert found is not None
    assert not found.fails
    assert found.low == pytest.approx(0.5, abs=1e-6)
    assert found.low < 0.5 <= found.high


def test_heights_count_as_the_mission_says() -> None:
    team = {"one": hover(place=(0.0, 0.0, 1.0), duration=2.0), "two": hover(place=(0.0, 0.0, 1.4), duration=2.0)}
    assert meeting(team, 0.399) is None
    assert meeting(team, 0.401) is not None
    assert meeting(team, 0.199, separation=0.3, separation_z=0.6) is None
    assert meeting(team, 0.201, separation=0.3, separation_z=0.6) is not None


def test_clocks_that_differ_bring_robots_nearer_that_fly_behind_one_another() -> None:
    first = rest_to_rest([(-2, 0, 1), (2, 0, 1)], [6.0])
    team = {"one": first, "two": rest_to_rest([(-2.6, 0, 1), (1.4, 0, 1)], [6.0])}
    alike = closest(team, LENGTH, instants=400, shares=20)
    apart = closest(team, LENGTH, error=0.3, instants=400, shares=20)
    assert apart < alike - 0.05
    assert meeting(team, alike - 0.005) is None
    assert meeting(team, apart - 0.005, 0.3) is None
    found = meeting(team, alike - 0.005, 0.3)
    assert found is not None
    assert found.fails


def test_a_lap_is_followed_by_its_beginning() -> None:
    there = rest_to_rest([(0, 0, 1), (1, 0, 1), (0, 0, 1)], [3.0, 3.0])
    later = rest_to_rest([(1.5, 0, 1), (0.5, 0, 1), (1.5, 0, 1)], [1.0, 5.0])
    team = {name: Trajectory(path.durations, path.coefficients, cycle=0) for name, path in (("one", there), ("two", later))}
    spec = parse_mission(MISSION).spec.model_copy(update={"trace": "infinite"})
    paths = read_team(world(team).model_copy(update={"spec": spec}), team)
    error = Fraction(1)
    grid = np.linspace(0.0, 12.0, 1500)
    sampled = min(
        float(
            np.linalg.norm(
                brakes(there, grid % 6.0, shares, LENGTH) - brakes(later, (grid + shift) % 6.0, shares, LENGTH), axis=2
            ).min()
        )
        for shift in np.linspace(-1.0, 1.0, 41)
        for shares in [np.linspace(0.0, 1.0, 15)]
    )
    assert closest_braking(paths, Fraction(LENGTH), [[Fraction(sampled - 0.01)] * 2] * 2, error) is None
    found = closest_braking(paths, Fraction(LENGTH), [[Fraction(sampled + 0.001)] * 2] * 2, error)
    assert found is not None
    assert found.fails


def test_numbers_that_are_too_large_are_refused() -> None:
    far = Trajectory(np.array([1.0]), np.full((1, 4, 8), 1e200))
    with pytest.raises(BadInput, match="too large"):
        meeting({"one": far, "two": hover(place=(0.0, 0.0, 1.0))}, 0.3)
