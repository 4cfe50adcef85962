"""The hunt: winds from the loop's own response, worst for a linear loop, and worse than chance for the simulated one."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import flight
from flight.model.airframe import airframe_of
from flight.model.timing import CONTROL_STEP
from flight.rehearsal.hunt import gain_of, hunt, response, wind_towards
from tests.helpers.motion.stand_ins import hop, rest_to_rest, stand_in
from verify.data import BadInput, load_vehicle


@functools.cache
def kernel() -> np.ndarray:
    return response(airframe_of(load_vehicle("crazyflie-2.1")))


def answered(winds: np.ndarray, ticks: int) -> np.ndarray:
    """Return where a linear loop is after so many control steps of wind. Shape (3,)."""
    own = kernel()
    return sum((winds[ticks - 1 - k] @ own[k] for k in range(min(ticks, len(own)))), np.zeros(3))


def test_a_response_is_that_of_a_loop_that_comes_back():
    own = kernel()
    length = np.linalg.norm(own.reshape(len(own), -1), axis=1)
    assert length.max() > 10 * length[-1]
    assert abs(own[:, 0, 0]).max() > 20 * abs(own[:, 0, 1]).max()  # along the wind
    assert own[20, 0, 0] > 0.0


@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.6, 0.8, 0.0)])
def test_the_aimed_wind_reaches_the_gain_and_no_other_goes_farther(direction):
    """Of a linear loop the l1 gain is reached by the signs of the response read backwards, and bounds every other wind."""
    ticks, towards = len(kernel()), np.array(direction)
    aimed = wind_towards(kernel(), towards, ticks, ticks * CONTROL_STEP)
    assert np.linalg.norm(aimed, axis=1) == pytest.approx(1.0)
    far = float(answered(aimed, ticks) @ towards)
    assert far == pytest.approx(float(np.sum(np.linalg.norm(kernel() @ towards, axis=1))))
    if max(abs(towards)) == 1.0:
        assert far <= gain_of(kernel()) + 1e-12
    rng = np.random.default_rng(0)
    for _ in range(50):
        winds = rng.standard_normal((ticks, 3))
        winds = np.cumsum(winds, axis=0) if rng.random() < 0.5 else winds
        winds /= np.linalg.norm(winds, axis=1, keepdims=True)
        assert float(answered(winds, ticks) @ towards) <= far


def test_a_hunt_finds_more_than_chance_does():
    plan, team = hop()
    start = team["quad0"].evaluate(0)[:3]
    team = {"quad0": rest_to_rest([start, (start[0] - 0.15, start[1], start[2])], [2.0])}
    few = flight.Combinations(("mellinger",), (1.0,), (0.015,), ("0.35+0.05",), hunt=0.4)
    found = flight.rehearse(plan, team, stand_in(plan, team), combinations=few, runs=4)
    assert found.hunt is not None
    assert found.hunt.worst > max(cell.worst for cell in found.cells)
    assert found.hunt.worst < found.hunt.linear["quad0"] + 0.02
    assert found.to_dict()["hunt"]["flights"] == found.hunt.flights
    assert any("A hunt proves nothing" in sentence for sentence in found.sentences)


@pytest.mark.parametrize("wind", [0.0, -1.0, float("nan"), 21.0])
def test_a_wind_that_is_none_is_refused(wind):
    plan, team = hop()
    with pytest.raises(BadInput, match="above 0 m/s and at most 20"):
        hunt(plan.mission, team, None, wind=wind)
    with pytest.raises(BadInput, match="above 0 m/s and at most 20"):
        flight.Combinations(hunt=wind)
