"""How far clocks may be apart where a mission says it, where it does not, and since which common start they drift."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from tests.helpers.motion.flights import legs, small_mission
from verify.data import Mission, Trajectory
from verify.data.validation.clocks import clock_error_of, since_common_start

STARTS = [[0.0, 0.0, 1.0], [0.0, 1.0, 1.0]]


def pair(**fields: object) -> Mission:
    return small_mission(regions="", starts=STARTS).changed(**fields)


def test_a_common_start_leaves_its_skew_for_each_radio_and_the_drift_until_the_end() -> None:
    assert clock_error_of(pair(), 0) == 0.02
    assert clock_error_of(pair(), 100) == 0.03
    assert clock_error_of(pair(radios=3), Fraction(100)) == 0.07
    assert clock_error_of(pair(), 0.5) == 0.0201  # rounded up to 0.1 ms


def test_what_a_mission_says_counts_instead_and_a_single_robot_differs_from_nobody() -> None:
    assert clock_error_of(pair(clock_error=0.0), 100) == 0.0
    assert clock_error_of(pair(clock_error=0.3, radios=2), 100) == 0.3
    assert clock_error_of(small_mission(regions="", starts=STARTS[:1]).changed(radios=2), 100) == 0.0


def test_the_worst_of_several_vehicles_counts() -> None:
    mission = pair()
    own = mission.vehicle.changed(start_skew=0.05, clock_drift=1e-3)
    mixed = mission.changed(agents={**mission.agents, "r1": mission.agents["r1"].changed(vehicle=own)})
    assert clock_error_of(mixed, 10) == 0.06
    assert clock_error_of(mission.changed(vehicle=own.changed(start_skew=0.0)), 10) == 0.01


def flight(cycle: int | None = None, cuts: tuple[int, ...] = ()) -> Trajectory:
    """Four pieces of 1, 2, 4 and 8 s."""
    return Trajectory([1.0, 2.0, 4.0, 8.0], np.zeros((4, 4, 8)), cycle=cycle, cuts=cuts)


@pytest.mark.parametrize(
    ("path", "laps", "longest"),
    [
        (flight(), 1, 15),
        (flight(cuts=(2,)), 1, 12),
        (flight(cuts=(1, 3)), 1, 8),
        (flight(cycle=2), 1, 15),
        (flight(cycle=2), 3, 15 + 2 * 12),
        (flight(cycle=2, cuts=(2,)), 3, 12),
        (flight(cycle=3, cuts=(2, 3)), 3, 8),
    ],
)
def test_parts_begin_with_a_common_start_and_laps_that_are_no_parts_do_not(path: Trajectory, laps: int, longest: int) -> None:
    mission = pair()
    mission = mission.model_copy(update={"spec": mission.spec.model_copy(update={"repeat": laps})})
    assert since_common_start(mission, {"r0": path, "r1": legs([[0, 0, 1], [0.2, 0, 1]])}) == longest
