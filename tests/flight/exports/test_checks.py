"""The list of checks before a flight, which live links and exported scripts share: what is not known never passes."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flight.exports.scripts.flying.checks import (
    NAMES,
    Asked,
    Health,
    Known,
    Pose,
    checks_of,
    checks_of_team,
    differing,
    one_body_each,
    refusals,
)
from flight.exports.scripts.flying.starts import margin_fault
from flight.monitoring.thresholds import HEADING, SHARE, limits

LIMITS = limits(0.005)
HEALTHY = Health(True, True, 200.0)
START = (1.0, 2.0, 0.0)
ASKED = Asked({"one": START, "two": (5.0, 5.0, 0.0)}, "its start", 0.5, 0.1, 100.0)
GOOD = Known([Pose(0.1 * k, START, 0.5) for k in range(5)], HEALTHY, "")
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
    "ready": replace(GOOD, health=replace(HEALTHY, ready=None)),
    "estimator": replace(GOOD, health=replace(HEALTHY, settled=None)),
    "battery": replace(GOOD, health=replace(HEALTHY, endurance=None)),
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
    "ready": replace(GOOD, health=replace(HEALTHY, ready=False)),
    "estimator": replace(GOOD, health=replace(HEALTHY, settled=False)),
    "battery": replace(GOOD, health=replace(HEALTHY, endurance=119.0)),
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
    known = replace(
        GOOD, poses=[Pose(0.1 * k, (math.nan,) * 3, math.nan) for k in range(5)], health=replace(HEALTHY, endurance=math.nan)
    )
    found = made(known)
    assert found["place"] is found["heading"] is found["quiet"] is found["battery"] is False


def test_two_robots_measured_at_one_place_are_one_body() -> None:
    assert [check.robot for check in one_body_each({"one": START, "two": START, "three": (0.0, 0.0, 0.0)}, LIMITS)] == ["two"]


TEAM = {"one": (0.0, 0.0, 0.0), "two": (1.0, 0.2, 0.1), "three": (-0.5, 1.5, 0.0)}
"""Where a team is to stand, all looking along 0.3 rad."""


def frames(
    places: dict[str, tuple[float, float, float]], headings: dict[str, float | None], *, above: bool = False
) -> list[str]:
    """Return what is said of the frame, after making sure that nothing is said of single places and headings then."""
    names = list(places)
    asked = {name: Asked({each: TEAM[each] for each in names}, "its start", 0.3, 0.1, 100.0, above) for name in names}
    known = {name: Known([Pose(0.1 * k, places[name], headings[name]) for k in range(5)], HEALTHY, "") for name in names}
    checks = checks_of_team(known, asked, LIMITS, NOW)
    wrong = [check for check in checks if check.passed is False]
    said = [check.sentence for check in wrong if check.name == "frame"]
    assert bool(said) is not any(check.name in ("place", "heading") for check in wrong)
    return said


def shown(turn: float, offset: tuple[float, float, float], sense: float = 1.0) -> dict[str, tuple[float, float, float]]:
    """Return the team's places as a turned and moved frame shows them; a sense of -1 mirrors them."""
    c, s = math.cos(turn), math.sin(turn)
    return {
        name: (c * x - s * sense * y + offset[0], s * x + c * sense * y + offset[1], z + offset[2])
        for name, (x, y, z) in TEAM.items()
    }


@given(st.floats(-3.0, 3.0), st.floats(0.5, 3.0), st.floats(-0.3, 0.3))
def test_a_team_in_a_frame_that_is_turned_and_moved_is_told_by_what(turn: float, x: float, z: float) -> None:
    places, headings = shown(turn, (9.0, x, z)), dict.fromkeys(TEAM, 0.3 + turn)
    (said,) = frames(places, headings)
    numbers = re.search(r"but turned by (\S+) degrees about z and moved by \((\S+), (\S+), (\S+)\) m", said)
    assert numbers is not None
    assert [float(text) for text in numbers.groups()] == pytest.approx([math.degrees(turn), 9.0, x, z], abs=0.051)
    assert "the mission's `frame` is wrong by that" in said
    assert not frames(places, dict.fromkeys(TEAM, 0.3 + turn + HEADING + 0.01)), "they are other bodies"
    assert not frames(places, dict.fromkeys(TEAM)), "headings that are not measured say nothing of frames"


@given(st.floats(-3.0, 3.0))
def test_a_team_that_is_measured_in_a_mirror_is_told_so(turn: float) -> None:
    (said,) = frames(shown(turn, (9.0, 1.0, 0.0), -1.0), dict.fromkeys(TEAM, turn - 0.3))
    assert "but mirrored and turned" in said
    assert "axes of motion capture are wrong by that" in said


def test_heights_that_do_not_matter_do_not_matter_to_the_frame() -> None:
    places = {name: (x, y, 0.7 * len(name)) for name, (x, y, _) in shown(1.0, (9.0, 1.0, 0.0)).items()}
    headings = dict.fromkeys(TEAM, 1.3)
    assert frames(places, headings, above=True)
    assert not frames(places, headings)


def test_one_robot_that_stands_right_or_bodies_taken_for_each_other_are_no_turned_frame() -> None:
    assert not frames({**shown(1.0, (9.0, 1.0, 0.0)), "one": TEAM["one"]}, dict.fromkeys(TEAM, 1.3))
    swapped = {"one": TEAM["two"], "two": TEAM["one"]}
    assert not frames(swapped, dict.fromkeys(swapped, 0.3))
    assert not frames({"one": (4.0, 4.0, 0.0)}, {"one": 0.3}), "one robot alone is only elsewhere"


def test_a_margin_that_measurements_use_up_leaves_no_room_to_begin_in() -> None:
    accuracy = LIMITS["accuracy"]
    assert margin_fault(accuracy / (1.0 - SHARE), LIMITS)
    assert not margin_fault(1.01 * accuracy / (1.0 - SHARE), LIMITS)


def test_parameters_differ_beyond_float32_or_where_they_are_missing() -> None:
    assert differing({"a": 0.1000001, "b": 2.0}, {"a": 0.1, "b": 2.1, "c": 3.0}) == ["b is 2, not 2.1", "c is not known, not 3"]
