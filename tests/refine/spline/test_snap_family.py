"""The family of least-snap splines: its members are `minimum_snap`'s, and its gradients those of finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from refine import minimum_snap
from refine.solvers.qp import rest_to_rest
from refine.spline.snap_family import SnapFamily
from refine.spline.spline import Spline


def drawn(seed: int, pieces: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(0.5, 2.0, pieces), rng.normal(size=(pieces + 1, 3))


@pytest.mark.parametrize("pieces", [1, 2, 5, 20])
def test_members_are_minimum_snap(pieces: int) -> None:
    durations, points = drawn(pieces, pieces)
    wanted = minimum_snap(points, np.concatenate([[0.0], np.cumsum(durations)]))
    found = SnapFamily(rest_to_rest(points), None).at(durations, points)
    np.testing.assert_allclose(found.states, wanted.states, atol=1e-8)


def test_rests_and_cycles_are_kept() -> None:
    durations, points = drawn(7, 6)
    fixed = rest_to_rest(points)
    fixed[3, 1:] = 0.0
    states = SnapFamily(fixed, None).at(durations, points).states
    assert np.all(states[[0, 3, 6], 1:] == 0.0)
    points[-1] = points[2]
    states = SnapFamily(rest_to_rest(points, 2), 2).at(durations, points).states
    np.testing.assert_array_equal(states[-1], states[2])
    assert np.any(states[2, 1:] != 0.0)


@pytest.mark.parametrize("cycle", [None, 0, 2])
def test_gradients_are_those_of_finite_differences(cycle: int | None) -> None:
    durations, points = drawn(11, 5)
    if cycle is not None:
        points[-1] = points[cycle]
    family = SnapFamily(rest_to_rest(points, cycle), cycle)
    weights, step = np.random.default_rng(1).normal(size=(6, 4, 3)), 1e-6

    def value(times: np.ndarray, nodes: np.ndarray) -> float:
        return float(np.sum(weights * family.at(times, nodes).states))

    by_durations, by_points = family.at(durations, points).gradient(weights)
    rng = np.random.default_rng(2)
    way_times, way_points = rng.normal(size=5), rng.normal(size=(6, 3))
    if cycle is not None:
        way_points[-1] = way_points[cycle]
    ends = [value(durations + sign * step * way_times, points + sign * step * way_points) for sign in (1.0, -1.0)]
    along = float(by_durations @ way_times + np.sum(by_points * way_points))
    assert (ends[0] - ends[1]) / (2 * step) == pytest.approx(along, rel=1e-5)


def test_a_member_has_the_least_snap_of_all_through_its_points() -> None:
    durations, points = drawn(3, 4)
    member = SnapFamily(rest_to_rest(points), None).at(durations, points)
    least = Spline(durations, member.states).snap_cost()
    for seed in range(10):
        other = member.states.copy()
        other[1:-1, 1:] += 0.1 * np.random.default_rng(seed).normal(size=(3, 3, 3))
        assert Spline(durations, other).snap_cost() > least
