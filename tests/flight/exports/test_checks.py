"""The list of checks before a flight, which live links and exported scripts share: what is not known never passes."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flight.exports.scripts.flying.checks import NAMES, Asked, Known, Pose, checks_of, one_body_each, refusals
from flight.monitoring.thresholds import HEADING, SHARE, limits

LIMITS = limits(0.005)
START = (1.0, 2.0, 0.0)
ASKED = Asked({"one": START, "two": (5.0, 5.0, 0.0)}, "its start", 0.5, 0.1, 100.0)
GOOD = Known([Pose(0.1 * k, START, 0.5) for k in range(5)], True, True, 200.0, "")
NOW = 0.45


def made(known: Known) -> dict[str, bool | None]:
    return {check.name: check.passed for check in checks_of("one", known, ASKED, LIMITS, NOW)}


def test_a_robot_of_which_all_is_known_and_right_passes_every_check() -> None:
    found = made(GOOD)
    assert set(found) == {"pose", "often", "quiet", "place", "heading", "ready", "estimator", "battery", "parameters"}
    assert all(passed is True for passed in found.values())
    assert refusals(checks_of("one", GOOD, ASKED, LIMITS, NOW), ()) == []


UNKNOWN = {
    "age": replace(GOOD, dated=False),
    "heading": replace(GOOD, poses=[replace(pose, heading=None) for pose in GOOD.poses]),
    "ready": replace(GOOD, ready=None),
    "estimator": replace(GOOD, settled=None),
    "battery": replace(GOOD, lasts=None),
    "parameters": replace(GOOD, wrong=None),
}


@pytest.mark.parametrize("name", NAMES)
def test_what_is_not_known_is_refused_unless_just_that_is_accepted(name: str) -> None:
    checks = checks_of("one", UNKNOWN[name], ASKED, LIMITS, NOW)
    assert [check.name for check in checks if check.passed is not True] == [name]
    sentence, remedy = refusals(checks, [other for other in NAMES if other != name])
    assert sentence.startswith("not checked: ")
    assert remedy == f"add --unchecked {name} to fly without that"
    assert refusals(checks, [name]) == []


WRONG = {
    "pose": replace(GOOD, poses=[]),
    "often": replace(GOOD, poses=GOOD.poses[-2:]),
    "quiet": replace(GOOD, poses=[*GOOD.poses[:-1], Pose(0.4, (1.03, 2.0, 0.0), 0.5)]),
    "place": replace(GOOD, poses=[replace(pose, position=(1.0, 2.0, 0.06)) for pose in GOOD.poses]),
    "heading": replace(GOOD, poses=[replace(pose, heading=0.5 + HEADING + 0.01) for pose in GOOD.poses]),
    "ready": replace(GOOD, ready=False),
    "estimator": replace(GOOD, settled=False),
    "battery": replace(GOOD, lasts=119.0),
    "parameters": replace(GOOD, wrong="one: mass is 0.029, not 0.033"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_refused_whatever_is_accepted(name: str) -> None:
    checks = checks_of("one", WRONG[name], ASKED, LIMITS, NOW)
    assert name in [check.name for check in checks if check.passed is False]
    assert refusals(checks, NAMES)


@given(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0))
def test_a_heading_passes_within_15_degrees_by_the_shorter_way_round(heading: float, wanted: float) -> None:
    known = replace(GOOD, poses=[replace(pose, heading=heading) for pose in GOOD.poses])
    (check,) = [
        check for check in checks_of("one", known, replace(ASKED, heading=wanted), LIMITS, NOW) if check.name == "heading"
    ]
    assert check.passed is (math.acos(max(-1.0, min(1.0, math.cos(heading - wanted)))) <= HEADING) or math.isclose(
        math.cos(heading - wanted), math.cos(HEADING), abs_tol=1e-9
    )


@given(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.booleans())
def test_a_place_passes_within_a_share_of_the_margin(x: float, y: float, z: float, above: bool) -> None:
    at = (START[0] + x, START[1] + y, START[2] + z)
    known = replace(GOOD, poses=[replace(pose, position=at) for pose in GOOD.poses])
    (check,) = [check for check in checks_of("one", known, replace(ASKED, above=above), LIMITS, NOW) if check.name == "place"]
    off = math.hypot(x, y) if above else math.hypot(x, y, z)
    assert check.passed is (off <= SHARE * ASKED.margin) or math.isclose(off, SHARE * ASKED.margin, abs_tol=1e-9)


def test_numbers_that_are_none_never_pass() -> None:
    known = replace(GOOD, poses=[Pose(0.1 * k, (math.nan,) * 3, math.nan) for k in range(5)], lasts=math.nan)
    found = made(known)
    assert found["place"] is found["heading"] is found["quiet"] is found["battery"] is False


def test_two_robots_measured_at_one_place_are_one_body() -> None:
    assert [check.robot for check in one_body_each({"one": START, "two": START, "three": (0.0, 0.0, 0.0)}, LIMITS)] == ["two"]
