"""When a robot that lands stands: its own word before heights, and heights only where it is low and at rest behind its landing's end."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flight.exports.scripts.flying.standing import Standing
from flight.monitoring.alarm_response import LANDING_HEIGHT, LANDING_SPEED, smooth_step
from flight.monitoring.thresholds import FRESH, LANDED, NEAR, WATCHED, limits
from tests.helpers.few import given_few
from verify.data import GRAVITY

RATE = 50.0
LIMITS = limits(0.01)


def landing(drop: float, noise: float, seed: int, *, lasts: float = 2.0, own: bool = False):
    """Yield times and heights of a robot that sinks to where its landing ends, and then hovers there, or stops its motors itself."""
    seconds, draw = max(1.0, drop / LANDING_SPEED), np.random.default_rng(seed)
    for time in np.arange(0.0, seconds + lasts, 1.0 / RATE).tolist():
        height = LANDING_HEIGHT + drop * (1.0 - smooth_step(time / seconds)[0])
        if own and time > seconds:
            height = max(LANDING_HEIGHT - 0.5 * GRAVITY * (time - seconds) ** 2, 0.0)
        yield time, seconds, height, height + draw.uniform(-noise, noise)


@given_few(15, 100, st.floats(0.05, 3.0), st.floats(0.0, 0.009), st.integers(0, 2**20), st.booleans())
def test_by_heights_a_robot_stands_only_where_it_would_meet_the_ground_no_faster_than_by_its_own_landing(
    drop, noise, seed, own
) -> None:
    standing, found = Standing({"one": LANDING_HEIGHT}, LIMITS), None
    for time, seconds, height, seen in landing(drop, noise, seed, own=own):
        standing.land(seconds) if time == 0.0 else None
        standing.see("one", time, seen, None)
        if standing.stands("one"):
            found = time, height
            break
    assert found is not None
    time, height = found
    assert time >= seconds + WATCHED - 1.5 / RATE
    assert time <= seconds + LANDED
    assert math.sqrt(2.0 * GRAVITY * height) < 1.0


@given(st.lists(st.tuples(st.floats(0.0, 0.2), st.sampled_from([None, True, False])), max_size=60))
def test_a_robot_that_said_last_that_it_flies_does_not_stand_and_who_never_flew_is_judged_by_height(rows) -> None:
    standing, said = Standing({"one": LANDING_HEIGHT}, LIMITS), None
    standing.land(0.0)
    for index, (height, flying) in enumerate(rows):
        standing.see("one", index / RATE, height, flying)
        said = flying if flying is not None and (flying or said is not None) else said
        if said is not None:
            assert standing.stands("one") is not said
    if said is None and len(rows) < RATE * WATCHED:
        assert not standing.stands("one")


@pytest.mark.parametrize(("height", "stands"), [(LANDING_HEIGHT + NEAR - 0.001, True), (LANDING_HEIGHT + NEAR + 0.001, False)])
def test_a_robot_that_hovers_too_high_does_not_stand(height: float, stands: bool) -> None:
    standing = Standing({"one": LANDING_HEIGHT}, LIMITS)
    standing.land(0.0)
    for index in range(100):
        standing.see("one", index / RATE, height, None)
    assert standing.stands("one") is stands
    assert standing.flying(["one"]) == ([] if stands else ["one"])


def test_poses_that_come_no_more_let_nobody_stand() -> None:
    standing = Standing({"one": LANDING_HEIGHT}, LIMITS)
    standing.land(0.0)
    for _ in range(100):
        standing.see("one", FRESH, 0.02, None)
    assert not standing.stands("one")
