"""The link to PX4, over local sockets with real MAVLink to vehicles that keep PX4's rules."""

from __future__ import annotations

import contextlib
import time

import numpy as np
import pytest

import ltlplan
from flight.link.link import LinkLost
from flight.link.live_executive import fly_live
from flight.link.mavlink import MavlinkLink
from flight.link.phases import Stage
from ltlplan.live_phases import stages
from ltlplan.pipeline import certified_team
from tests.helpers.live.live_missions import HOP
from tests.helpers.live.live_stages import laps_stages, patrol_stages, places_of
from tests.helpers.vehicles.px4_peer import ARM, HOLD, LAND, OFFBOARD, Manner, Px4Peer, free_port
from verify.data import BadInput

pytest.importorskip("pymavlink", reason="pymavlink is not installed")

UNCHECKED = ("battery",)
"""The profile has no endurance, and the vehicle does not say how full its battery is."""


@pytest.fixture(scope="module")
def ready():
    mission = ltlplan.parse_mission(HOP)
    return mission, certified_team(ltlplan.plan(mission))


@contextlib.contextmanager
def vehicle(place, manner: Manner | None = None):
    """A vehicle that stands somewhere, in our frame, and the addresses to reach it by."""
    port = free_port()
    x, y, z = place
    peer = Px4Peer(1, port, (y, x, -z), manner)
    peer.start()
    try:
        yield peer, {"one": f"udpin:127.0.0.1:{port}"}
    finally:
        peer.ended.set()
        peer.join()


@pytest.mark.slow
def test_a_flight_is_streamed_and_the_vehicle_disarmed_on_the_ground(ready) -> None:
    mission, done = ready
    stage = Stage("flight", done.plan, done.team, done.certificate)
    with vehicle((0.0, -0.5, 0.3), Manner(armed=False)) as (peer, addresses):
        link = MavlinkLink(mission, addresses, accuracy=0.005)
        result = fly_live(link, (stage,), grounds={"one": 0.0}, unchecked=UNCHECKED)
        link.close()
    assert result.flown, result.reason
    assert peer.parameters == {"COM_OF_LOSS_T": 1.0, "COM_OBL_RC_ACT": 4}
    assert peer.before >= 50, "set-points came before offboard flight"
    assert not peer.armed
    assert peer.failsafes == 0
    path, rows = stage.paths["one"], np.array(peer.flown)
    wanted = path.evaluate(rows[:, 0] / 1000.0)[:, :3]
    assert np.abs(rows[:, 1:] - np.stack([wanted[:, 1], wanted[:, 0], -wanted[:, 2]], axis=1)).max() < 2e-3
    assert rows[-1, 0] == pytest.approx(1000 * path.duration, abs=2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("manner", "says", "ends"),
    [
        (Manner(armed=False, refuses_arming=True), "did not arm", None),
        (Manner(armed=False, deaf_to=(OFFBOARD,)), "did not change to offboard flight", None),
        (Manner(armed=False, drifts=0.2), "from its plan; the margin is 0.09", LAND),
        (Manner(armed=False, deaf_to=(HOLD,), drifts=0.2), "from its plan", LAND),
        (Manner(armed=False, falls_silent_after=30), "was not seen for", None),
    ],
)
def test_what_goes_wrong_is_said_and_ends_on_the_ground(ready, manner, says, ends) -> None:
    mission, done = ready
    stage = Stage("flight", done.plan, done.team, done.certificate)
    with vehicle((0.0, -0.5, 0.3), manner) as (peer, addresses):
        link = MavlinkLink(mission, addresses, accuracy=0.005)
        result = fly_live(link, (stage,), grounds={"one": 0.0}, unchecked=UNCHECKED)
        link.close()
    assert not result.flown
    assert says in result.reason
    assert ends is None or peer.mode == ends
    if manner.falls_silent_after is None:
        assert not peer.armed
        assert result.unsafe == ()
    else:
        assert result.unsafe == ("one",)
        assert any("its last set-point PX4 lands" in event.sentence for event in result.record.events)


@pytest.mark.slow
def test_a_vehicle_that_was_asked_to_arm_and_says_nothing_since_is_not_taken_to_stand_still(ready) -> None:
    mission, done = ready
    stage = Stage("flight", done.plan, done.team, done.certificate)
    with vehicle((0.0, -0.5, 0.3), Manner(armed=False)) as (peer, addresses):
        obey = peer.obey

        def obeys(message) -> None:
            peer.manner.silent |= message.command == ARM
            obey(message)

        peer.obey = obeys
        link = MavlinkLink(mission, addresses, accuracy=0.005)
        result = fly_live(link, (stage,), grounds={"one": 0.0}, unchecked=UNCHECKED)
        assert "one did not arm" in result.reason
        assert result.unsafe == ("one",)
        link.close()


@pytest.mark.slow
def test_climb_way_flight_and_landing_over_mavlink(ready) -> None:
    mission, done = ready
    place = (0.1, -0.4, 0.0)
    flown = stages(done.plan, done.team, done.certificate, {"one": place})
    with vehicle(place, Manner(armed=False, loses_commands=1)) as (peer, addresses):
        link = MavlinkLink(mission, addresses, accuracy=0.005)
        result = fly_live(link, flown, grounds={"one": 0.0}, unchecked=UNCHECKED)
        link.close()
    assert result.flown, result.reason
    assert not peer.armed
    assert peer.place[2] == pytest.approx(0.0, abs=0.06)


@pytest.mark.slow
@pytest.mark.parametrize("make", [patrol_stages, lambda: laps_stages(2)], ids=["patrol", "laps in parts"])
def test_patrols_brake_and_laps_in_parts_pause_over_mavlink(make) -> None:
    stages = make()
    place, flown = places_of(stages)["r0"], stages[1]
    with vehicle(place, Manner(armed=False)) as (peer, addresses):
        link = MavlinkLink(flown.plan.mission, {"r0": addresses["one"]}, accuracy=0.005)
        result = fly_live(link, stages, grounds={"r0": 0.0}, unchecked=UNCHECKED)
        link.close()
    assert result.flown, result.reason
    assert not peer.armed
    assert peer.failsafes == 0
    record = result.record
    assert ("braking" in record.starts) is bool(flown.braking)
    assert len(record.parts.get("flight", ())) == (0 if flown.braking else 3)
    assert record.ends["flight"] - record.starts["flight"] == pytest.approx(
        sum(part.duration for part in flown.parts) + sum(record.pauses("flight")), abs=0.1
    )


def test_vehicles_that_are_not_there_are_named_in_one_sentence(ready, monkeypatch) -> None:
    mission, _ = ready
    monkeypatch.setattr("flight.link.mavlink.CONNECT", 0.2)
    with pytest.raises(LinkLost, match="one sends no PX4 heartbeat and position within"):
        MavlinkLink(mission, {"one": f"udpin:127.0.0.1:{free_port()}"})
    two = mission.changed(agents={**mission.agents, "two": mission.agents["one"].changed(start=(0.0, 0.5, 0.3))})
    with pytest.raises(LinkLost, match="one, two send no PX4 heartbeat and position within"):
        MavlinkLink(two, {name: f"udpin:127.0.0.1:{free_port()}" for name in two.agents})
    with pytest.raises(BadInput, match="no address of one"):
        MavlinkLink(mission, {})
    with pytest.raises(BadInput, match="two"):
        MavlinkLink(mission, {"one": "udpin:127.0.0.1:1", "two": "udpin:127.0.0.1:2"})
    with pytest.raises(BadInput, match="one cannot be reached at /nowhere"):
        MavlinkLink(mission, {"one": "/nowhere/at/all"})
    with pytest.raises(BadInput, match="one cannot be reached at udpin:here: it has no port; write it as udpin:"):
        MavlinkLink(mission, {"one": "udpin:here"})


@pytest.mark.slow
def test_a_parameter_that_is_not_taken_is_named(ready) -> None:
    mission, _ = ready
    with (
        vehicle((0, 0, 0), Manner(deaf_to_parameters=("COM_OBL_RC_ACT",))) as (_, addresses),
        pytest.raises(LinkLost, match="one does not take the parameter COM_OBL_RC_ACT = 4"),
    ):
        MavlinkLink(mission, addresses)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("manner", "says"),
    [
        (Manner(armed=False, turned=np.pi / 2), "one's heading is 90 degrees off"),
        (Manner(armed=False, estimator=1), "one's estimator has not settled"),
        (Manner(armed=False, estimator=1 | 8 | 16 | 128), "one's estimator has not settled"),
        (Manner(armed=False, reports_heading=False), "not checked: the heading of one: it is not reported; add --unchecked heading"),
        (Manner(armed=False, estimator=None), "not checked: whether one's estimator has settled: it does not report it"),
        (Manner(armed=False, reports_checks=False), "not checked: whether one is ready: it does not report its checks before arming"),
    ],
)  # fmt: skip
def test_heading_estimator_and_readiness_are_checked_and_nothing_is_asked_where_one_is_not_known(ready, manner, says) -> None:
    mission, done = ready
    stage = Stage("flight", done.plan, done.team, done.certificate)
    with vehicle((0.0, -0.5, 0.3), manner) as (peer, addresses):
        link = MavlinkLink(mission, addresses, accuracy=0.005)
        result = fly_live(link, (stage,), grounds={"one": 0.0}, unchecked=UNCHECKED)
        link.close()
    assert not result.flown
    assert says in result.reason
    assert (peer.asked, peer.before) == ([], 0)


@pytest.mark.slow
def test_what_is_not_known_may_be_accepted_and_is_kept(ready) -> None:
    mission, done = ready
    stage = Stage("flight", done.plan, done.team, done.certificate)
    accepted = ("heading", "estimator", "battery")
    with vehicle((0.0, -0.5, 0.3), Manner(armed=False, reports_heading=False, estimator=None)) as (peer, addresses):
        link = MavlinkLink(mission, addresses, accuracy=0.005)
        result = fly_live(link, (stage,), grounds={"one": 0.0}, unchecked=accepted)
        link.close()
    assert result.flown, result.reason
    assert not peer.armed
    assert {check.name for check in result.checks if check.passed is None} == set(accepted)
    assert any(event.sentence.startswith("not checked: the heading of one") for event in result.record.events)


@pytest.mark.slow
def test_a_ground_stations_heartbeat_is_sent_while_nothing_else_is(ready) -> None:
    """PX4 asks for it before it arms; proofs that take long are made while the link is up."""
    mission, _ = ready
    with vehicle((0.0, -0.5, 0.3), Manner(armed=False)) as (peer, addresses):
        link = MavlinkLink(mission, addresses, accuracy=0.005)
        time.sleep(3.5)
        heard = len(peer.beats)
        link.close()
        time.sleep(2.2)
        left = len(peer.beats)
    assert heard >= 3
    assert max(np.diff(peer.beats)) < 1.6
    assert left <= heard + 1, "none comes once the link is closed"


@pytest.mark.slow
def test_a_vehicle_that_hears_no_ground_station_does_not_arm(ready, monkeypatch) -> None:
    mission, done = ready
    monkeypatch.setattr("flight.link.px4_vehicle.beat", lambda _mav: None)
    stage = Stage("flight", done.plan, done.team, done.certificate)
    with vehicle((0.0, -0.5, 0.3), Manner(armed=False)) as (peer, addresses):
        link = MavlinkLink(mission, addresses, accuracy=0.005)
        result = fly_live(link, (stage,), grounds={"one": 0.0}, unchecked=(*UNCHECKED, "ready"))
        link.close()
    assert "one did not arm" in result.reason
    assert set(peer.refusals) == {"no connection to the ground control station"}
