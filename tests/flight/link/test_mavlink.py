"""The link to PX4, over local sockets with real MAVLink to vehicles that keep PX4's rules."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest

import ltlplan
from flight.link.link import LinkLost
from flight.link.live import fly_live
from flight.link.mavlink import MavlinkLink
from flight.link.stages import Stage
from ltlplan.live import stages
from ltlplan.pipeline import certified_team
from tests.helpers.live_missions import HOP
from tests.helpers.live_stages import laps_stages, patrol_stages, places_of
from tests.helpers.px4_peer import ARM, HOLD, LAND, OFFBOARD, Manner, Px4Peer, free_port
from verify.data import BadInput

pytest.importorskip("pymavlink", reason="pymavlink is not installed")


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
        result = fly_live(link, (stage,), grounds={"one": 0.0})
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
        result = fly_live(link, (stage,), grounds={"one": 0.0})
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
        result = fly_live(link, (stage,), grounds={"one": 0.0})
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
        result = fly_live(link, flown, grounds={"one": 0.0})
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
        result = fly_live(link, stages, grounds={"r0": 0.0})
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
