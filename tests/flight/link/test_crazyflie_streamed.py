"""Crazyflies that follow set-points from here: real cflib to vehicles that treat them as the firmware does, flown by a controller on board."""

from __future__ import annotations

import time

import numpy as np
import pytest

from flight.link.link import LinkLost
from flight.link.live_executive import LiveFlight, fly_live

pytest.importorskip("cflib", reason="cflib is not installed")

from flight.link.crazyflie.setpoints import ROUNDING
from flight.link.crazyflie.streamed import StreamedCrazyflies
from flight.link.streaming import RATE
from tests.helpers.live.patience import patient  # noqa: F401  # pytest finds the fixture by its name
from tests.helpers.vehicles.crazyflie_firmware import Manner
from tests.helpers.vehicles.crazyflie_peer import Air, in_the_air
from tests.helpers.vehicles.crazyflie_radio import crazyradio
from tests.helpers.vehicles.crazyflie_stages import GROUNDS, PLACES, UNCHECKED

ON_BOARD = {"controller": "mellinger"}


def flight_of(link: StreamedCrazyflies, stages) -> LiveFlight:
    return fly_live(link, stages, grounds=GROUNDS, unchecked=UNCHECKED)


def at(link: StreamedCrazyflies, stage: int, after: float, act) -> None:
    """Have something happen once while the team flies a stage, some seconds after it began."""
    slept, started, begun, done = link.sleep, link.start, {}, []

    def start(number, at=None):
        begun[number] = link.now()
        return started(number, at)

    def sleep(seconds: float) -> None:
        if not done and link.now() > begun.get(stage, np.inf) + after:
            done.append(True)
            act()
        slept(seconds)

    link.sleep, link.start = sleep, start


def landed(air: Air, *names: str) -> bool:
    """Whether robots stand near the ground, motors off, none switched itself off, and none was let fall."""
    told = [air.vehicles[name] for name in names or air.vehicles]
    return all(not v.spinning and v.stopped_at < 0.2 and not v.locked and not v.dropped for v in told)


def test_a_firmware_that_does_not_say_what_it_follows_is_refused(mission) -> None:
    with (
        in_the_air(mission, PLACES, {"r1": Manner(lacks=("ctrltarget.z",))}) as (air, addresses),
        pytest.raises(LinkLost, match=r"r1 does not say what it follows \(ctrltarget\.x and z\)"),
    ):
        StreamedCrazyflies(mission, addresses)
    assert air.spinning == []


@pytest.mark.slow
@pytest.mark.parametrize("trouble", [0.0, 0.05])
def test_a_team_climbs_flies_and_lands_by_set_points(mission, flown, trouble) -> None:
    with in_the_air(mission, PLACES, loss=trouble, disorder=trouble, **ON_BOARD) as (air, addresses):
        link = StreamedCrazyflies(mission, addresses)
        assert link.streams
        done = flight_of(link, flown)
        link.close()
    assert done.flown, done.reason
    assert done.unsafe == ()
    assert landed(air)
    for name, vehicle in air.vehicles.items():
        assert vehicle.starts == [], "nothing lies on board"
        begin, end = done.record.starts["flight"], done.record.ends["flight"]
        path, clocks = flown[1].paths[name], air.clock() - link.now()
        rows = [(when - clocks - begin, flat) for when, flat in vehicle.streamed.kept if begin < when - clocks < end]
        for when, flat in rows:  # each is the plan's, of half a period later than it was sent, and some milliseconds on its way
            ats = when + 0.5 / RATE - np.linspace(0.0, 0.25, 251)
            near = min(np.abs(path.evaluate(max(t, 0.0))[:3] - flat[0, :3]).max() for t in ats if t < path.duration)
            assert near < ROUNDING + 1e-3 * np.abs(flat[1, :3]).max() + 1e-6
        assert len(rows) > 0.5 * RATE * (end - begin)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["silent_since", "frozen_since"])
@pytest.mark.parametrize("failsafe", ["fly on", "stop"])
def test_one_robot_of_three_is_lost_and_stops_by_itself_and_the_others_land(mission, flown, kind, failsafe) -> None:
    with in_the_air(mission, PLACES, **ON_BOARD) as (air, addresses):
        link = StreamedCrazyflies(mission, addresses, failsafe=failsafe)
        lost = air.vehicles["r1"]
        at(link, 1, 0.4, lambda: setattr(lost.manner, kind, air.clock()))
        done = flight_of(link, flown)
        link.close()
        since = getattr(lost.manner, kind)
        assert not done.flown
        assert done.unsafe == ("r1",)
        assert landed(air, "r0", "r2")
        assert lost.locked
        assert not lost.spinning
        assert air.clock() > since + (2.0 if failsafe == "fly on" else 1.0)
        says = "2 s after it its motors stop" if failsafe == "fly on" else "1 s after the last sign of life"
        assert any("r1 has not acknowledged" in e.sentence and says in e.sentence for e in done.record.events)


@pytest.mark.slow
def test_a_host_that_stalls_lets_all_hold_where_they_were_asked_to_be_last_and_land(mission, flown) -> None:
    with in_the_air(mission, PLACES, **ON_BOARD) as (air, addresses):
        link = StreamedCrazyflies(mission, addresses)
        at(link, 1, 0.5, lambda: time.sleep(0.8))
        done = flight_of(link, flown)
        link.close()
        assert "set-points were" in done.reason or "was not seen" in done.reason
        assert done.unsafe == ()
        assert landed(air)
        for name, vehicle in air.vehicles.items():
            assert 12 in vehicle.commands or "not seen" in done.reason, "held by a go-to"
            track = np.array([places[:, list(PLACES).index(name)] for _, places in air.truth])
            assert np.abs(track[:, :2] - flown[1].paths[name].evaluate(0.0)[:2]).max() < 0.6


@pytest.mark.slow
@pytest.mark.parametrize("failsafe", ["fly on", "stop"])
def test_a_host_that_is_gone_leaves_to_the_vehicles_what_was_said(mission, flown, failsafe) -> None:
    with in_the_air(mission, PLACES, **ON_BOARD) as (air, addresses):
        link = StreamedCrazyflies(mission, addresses, failsafe=failsafe)
        at(link, 1, 0.5, lambda: time.sleep(2.6))
        done = flight_of(link, flown)
        assert not done.flown
        assert air.spinning == []
        for vehicle in air.vehicles.values():
            assert vehicle.locked
            assert vehicle.stopped_at > 0.3, "nobody lands alone: motors stop in the air"
        link.close()


@pytest.mark.slow
@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
@pytest.mark.parametrize("stage", [0, 1, 2])
def test_interruptions_and_errors_land_the_team(mission, flown, error, stage) -> None:
    def fail() -> None:
        raise error("somebody stopped it")

    with in_the_air(mission, PLACES, loss=0.02, disorder=0.02, **ON_BOARD) as (air, addresses):
        link = StreamedCrazyflies(mission, addresses)
        at(link, stage, 0.5, fail)
        done = flight_of(link, flown)
        link.close()
        assert done.reason.startswith("interrupted" if error is KeyboardInterrupt else "ValueError: somebody")
        assert done.unsafe == ()
        assert landed(air)


@pytest.mark.slow
def test_a_second_interruption_in_the_air_stops_motors_at_once(mission, flown) -> None:
    with in_the_air(mission, PLACES, **ON_BOARD) as (air, addresses):
        link, times = StreamedCrazyflies(mission, addresses), [0.4, 0.6]
        slept, started, begun = link.sleep, link.start, {}

        def start(number, at=None):
            begun[number] = link.now()
            return started(number, at)

        def sleep(seconds: float) -> None:
            if times and link.now() > begun.get(1, np.inf) + times[0]:
                times.pop(0)
                raise KeyboardInterrupt
            slept(min(seconds, 0.05))

        link.sleep, link.start = sleep, start
        done = flight_of(link, flown)
        link.close()
        assert done.unsafe == ()
        assert all(vehicle.locked and vehicle.stopped_at > 0.3 for vehicle in air.vehicles.values())
        assert air.spinning == []


@pytest.mark.slow
def test_set_points_go_out_by_the_radio_driver_as_often_as_they_are_meant_to(mission, flown, monkeypatch) -> None:
    from cflib.crtp import radiodriver

    where = {name: (80, f"E7E7E7E70{index}") for index, name in enumerate(PLACES)}
    with in_the_air(mission, PLACES, **ON_BOARD) as (air, _):
        monkeypatch.setattr(radiodriver, "Crazyradio", crazyradio(air, where))
        monkeypatch.setattr(radiodriver.RadioManager, "_radios", [])
        link = StreamedCrazyflies(mission, {name: f"radio://0/80/2M/{address}" for name, (_, address) in where.items()})
        done = flight_of(link, flown)
        link.close()
        assert done.flown, done.reason
        assert landed(air)
        for vehicle in air.vehicles.values():
            times = np.array([when for when, _ in vehicle.streamed.kept])
            assert len(times) > 0.7 * RATE * (times[-1] - times[0])


@pytest.mark.slow
def test_nothing_is_brought_on_board_between_parts(mission) -> None:
    with in_the_air(mission, PLACES, **ON_BOARD) as (_, addresses):
        link = StreamedCrazyflies(mission, addresses)
        waited: list[float] = []
        link.bring(0, lambda: waited.append(link.now()))
        link.close()
        assert not waited, "nothing takes time"
