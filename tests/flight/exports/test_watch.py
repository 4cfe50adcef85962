"""The watch of a team in flight, which live links and exported scripts share."""

from __future__ import annotations

import math

import pytest

from flight.exports.scripts.flying.checks import Health, Pose
from flight.exports.scripts.flying.watch import Refused, Team, Watch
from flight.monitoring.thresholds import EMPTY, FRESH, SLOW, bounds
from tests.helpers.motion.flights import small_mission
from verify.data.frame import Frame

MISSION = small_mission(
    "F a", regions="a: {center: [1.5, 0, 0.6], radii: [0.3, 0.3, 0.3]}", starts=((0.0, 0.0, 0.6), (0.0, 1.0, 0.6)), margin=0.05
)


@pytest.fixture
def watch() -> Watch:
    return Watch(Team({"robots": dict.fromkeys(MISSION.agents), **bounds(MISSION, MISSION.agents, 0.05, 0.01)}), 0.0)


def pose(x: float, y: float, z: float, time: float = 0.1) -> Pose:
    return Pose(time, (x, y, z), None)


def test_a_team_inside_of_its_margins_may_go_on(watch: Watch) -> None:
    watch.see("r0", pose(0.0, 0.0, 0.6), 0.0399)
    watch.see("r1", pose(0.0, 1.0, 0.6), 0.0)
    assert watch.alarm() == ""
    watch.require(0.2, lambda _: Health())


@pytest.mark.parametrize(
    ("at", "off", "says"),
    [
        ((0.0, 0.0, 0.6), 0.041, "r0 is 0.041 m from its plan; the margin is 0.05 m"),
        ((0.0, 0.0, 0.6), math.nan, "r0 is nan m from its plan"),
        ((5.02, 0.0, 0.6), 0.0, "r0 is 0.020 m outside of the workspace"),
        ((0.0, math.nan, 0.6), 0.0, "r0's measured place is no number"),
        ((0.0, 0.95, 0.6), 0.0, "r0 and r1 are 0.050 m apart, and"),
    ],
)
def test_what_concerns_the_flight_ends_it(watch: Watch, at: tuple[float, float, float], off: float, says: str) -> None:
    watch.see("r1", pose(0.0, 1.0, 0.6), 0.0)
    watch.see("r0", pose(*at), off)
    assert says in watch.alarm()
    assert bool(watch.outside.get("r0")) is not says.startswith("r0 and r1")
    with pytest.raises(Refused, match=says.split(" m ")[0]):
        watch.require(0.15, lambda _: Health())


def test_a_robot_is_lost_that_is_not_seen_has_no_battery_left_or_is_blocked(watch: Watch) -> None:
    assert watch.lost("r0", FRESH - 1e-6, Health(endurance=EMPTY)) == ""
    assert watch.lost("r0", FRESH + 1e-6, Health()) == "r0 was not seen for 0.2 s"
    assert watch.lost("r0", 0.0, Health(endurance=EMPTY - 1.0)) == "r0's battery lasts 14 s more"
    assert watch.lost("r0", 0.0, Health(endurance=math.nan))
    assert watch.lost("r0", 0.0, Health(fault="has tumbled, or is locked")) == "r0 has tumbled, or is locked"


def test_looks_that_come_too_late_end_a_flight_unless_nobody_was_to_look(watch: Watch) -> None:
    assert watch.late(5.0) == "", "the first look"
    assert watch.late(5.0 + SLOW - 1e-6) == ""
    assert "nobody was looked at for 0.50 s" in watch.late(5.5 + SLOW)
    watch.begin(9.0)
    assert watch.late(9.9) == ""
    assert watch.lost("r0", 9.1, Health()) == ""


def test_the_workspace_is_that_of_the_frame_and_its_floor_counts_where_it_is_told_to() -> None:
    frame = Frame(rotation_deg=90.0, offset=(3.0, -1.0, 0.1))
    team = Team({"robots": dict.fromkeys(MISSION.agents), **bounds(MISSION, MISSION.agents, 0.05, 0.01, frame)})
    low = MISSION.workspace.min[2] + 0.1
    assert not team.workspace_fault("r0", (3.0 - 4.9, -1.0, 1.0))
    assert team.workspace_fault("r0", (3.0 - 5.1, -1.0, 1.0))
    assert team.workspace_fault("r0", (3.0, -1.0, low - 0.1))
    assert not team.workspace_fault("r0", (3.0, -1.0, low - 0.1), low=False)
