"""Leaving intervals out before distances are computed: the nearest approach of every pair, and every breach, stays."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

import numpy as np
import pytest

from tests.helpers.motion.flights import plan_of, small_mission
from verify.claims.distance_claims import Clocks, separation_claims, separation_holds
from verify.claims.evidence import Evidence
from verify.data import Mission, Trajectory
from verify.motion.paths import read_team
from verify.motion.separation import distance_exactly, minimum_distances, pairwise_distances


def random_team(rng: np.random.Generator, robots: int, pieces: int) -> tuple[Mission, dict[str, Trajectory]]:
    """Robots that wander in a hall, each with pieces of its own lengths; ends and starts of pieces need not meet."""
    team: dict[str, Trajectory] = {}
    hall = rng.uniform(0.5, 12.0)
    for robot in range(robots):
        count = int(rng.integers(1, pieces + 1))
        coefficients = np.zeros((count, 4, 8))
        at = rng.uniform(-hall, hall, 3) * [1, 1, 0.3]
        durations = rng.choice([0.5, 1.0, 1.25, 2.0], count)
        for piece in range(count):
            coefficients[piece, :3, 0] = at
            if rng.random() < 0.9:
                coefficients[piece, :3, 1:5] = (
                    rng.normal(0, 1, (3, 4)) * rng.choice([0.1, 1.0]) / durations[piece] ** np.arange(1, 5)
                )
            at = coefficients[piece, :3] @ durations[piece] ** np.arange(8)
        team[f"r{robot}"] = Trajectory(durations, coefficients.astype(np.float32).astype(np.float64))
    heights = [None, None, 0.1, 0.9][int(rng.integers(4))]
    return started(team).model_copy(update={"separation_z": heights}), team


def started(team: Mapping[str, Trajectory]) -> Mission:
    """A mission whose robots start where their flights do."""
    mission = small_mission(regions="", starts=[[0.0, 0.0, 1.0]])
    (agent,) = mission.agents.values()
    starts = {name: tuple(flight.coefficients[0, :3, 0].tolist()) for name, flight in team.items()}
    return mission.model_copy(update={"agents": {n: agent.model_copy(update={"start": start}) for n, start in starts.items()}})


@pytest.mark.parametrize(("seed", "teams"), [(1, 20), pytest.param(2, 10_000, marks=pytest.mark.slow)])
def test_nearest_approaches_are_those_of_all_times(seed: int, teams: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(teams):
        mission, team = random_team(rng, int(rng.integers(2, 6)), 6)
        paths = read_team(mission, team)
        plain, quick = pairwise_distances(paths), pairwise_distances(paths, few=1)
        assert len(quick.intervals) <= len(plain.intervals)
        assert set(quick.intervals) <= set(plain.intervals)
        assert quick.jumps == plain.jumps
        for pair, (one, other) in enumerate(zip(minimum_distances(plain), minimum_distances(quick), strict=True)):
            assert (one.robot, one.other) == (other.robot, other.other)
            assert one.low == pytest.approx(other.low, abs=1e-6)
            assert one.high == pytest.approx(other.high, abs=1e-6)
            if rng.random() < 0.1:  # about the least distance itself
                for limit in (Fraction(other.low) - Fraction(1, 10**4), Fraction(other.high) + Fraction(1, 10**4)):
                    assert distance_exactly(plain, pair, max(limit, Fraction(0))) == distance_exactly(
                        quick, pair, max(limit, Fraction(0))
                    )


def test_what_crosses_for_ten_milliseconds_is_found() -> None:
    """Thirty robots in rows; one is crossed by another one so fast that it is near for 10 ms only."""
    rng = np.random.default_rng(0)
    team: dict[str, Trajectory] = {}
    for robot in range(30):
        coefficients = np.zeros((30, 4, 8))
        coefficients[:, :3, 0] = [2.0 * (robot % 6), 2.0 * (robot // 6), 1.0]
        coefficients[:, :2, 1:4] = rng.normal(0, 0.01, (30, 2, 3))
        team[f"r{robot}"] = Trajectory(np.ones(30), coefficients)
    crossing = team["r7"].coefficients.copy()
    crossing[17, :3, 0], crossing[17, :3, 1] = [2.0 - 30.0, 4.0, 1.0], [60.0, 0.0, 0.0]  # past r13, at (2, 4), at 17.5 s
    team["r7"] = Trajectory(np.ones(30), crossing)
    found = pairwise_distances(read_team(started(team), team))
    nearest = min(minimum_distances(found), key=lambda near: near.high)
    assert {nearest.robot, nearest.other} == {"r7", "r13"}
    assert nearest.high < 0.3
    assert float(nearest.time) == pytest.approx(17.5, abs=0.01)


def test_the_answer_alone_is_that_of_all_pairs_claims() -> None:
    """Drifts differ from robot to robot, and margins lie on both sides of where the answer turns, and on it."""
    rng = np.random.default_rng(1)
    answers: list[bool] = []
    for _ in range(12):
        mission, team = random_team(rng, int(rng.integers(2, 11)), 3)
        evidence = Evidence.of(plan_of(mission, {}), team)
        drifts = {name: Fraction(float(rng.choice([0.0, 0.02, 0.3]))) for name in team}
        clocks = Clocks(Fraction(float(rng.choice([0.0, 0.02, 0.3]))), drifts)
        least = min(near.low for near in evidence.minimum_distances)
        turns = max((least - mission.separation) / 2, 0.0)
        for margin in (Fraction(0), Fraction(turns / 2), Fraction(turns), Fraction(turns) + Fraction(1, 10**6), Fraction(3)):
            claims = separation_claims(evidence, margin, clocks)
            answers.append(all(claim.outcome == "holds" for claim in claims))
            assert separation_holds(evidence, margin, clocks) == answers[-1]
    assert {True, False} <= set(answers)


def test_one_robot_alone_keeps_apart() -> None:
    mission, team = random_team(np.random.default_rng(2), 1, 2)
    assert separation_holds(
        Evidence.of(plan_of(mission, {}), team), Fraction(1), Clocks(Fraction(0), dict.fromkeys(team, Fraction(0)))
    )
