"""Flights of Crazyflies that do not go as planned: each ends with all motors off, or where nobody could be told, as is said before."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from flight.link.live_executive import LiveFlight, fly_live
from flight.link.phases import Stage

pytest.importorskip("cflib", reason="cflib is not installed")

from flight.link.crazyflie.capture import Body
from flight.link.crazyflie.link import CrazyflieLink
from tests.helpers.live.patience import UNSEEN, patient  # noqa: F401  # pytest finds the fixture by its name
from tests.helpers.vehicles.crazyflie_firmware import Manner
from tests.helpers.vehicles.crazyflie_peer import Air, in_the_air
from tests.helpers.vehicles.crazyflie_stages import GROUNDS, PLACES, UNCHECKED, stage

pytestmark = pytest.mark.slow


def flight_of(link: CrazyflieLink, stages: tuple[Stage, ...]) -> LiveFlight:
    return fly_live(link, stages, grounds=GROUNDS, unchecked=UNCHECKED)


def at(link: CrazyflieLink, air: Air, stage: int, after: float, act) -> None:
    """Have something happen while the team flies a stage, some seconds after it began."""
    slept, done = link.sleep, []

    def sleep(seconds: float) -> None:
        starts = [when for when, number in air.vehicles["r0"].starts if number == stage]
        if not done and starts and air.clock() > starts[-1] + after:
            done.append(True)
            act()
        slept(seconds)

    link.sleep = sleep  # type: ignore[method-assign]


def landed(air: Air, *names: str) -> bool:
    """Whether robots stand near the ground, motors off, and none fell."""
    return all(not air.vehicles[name].spinning and air.vehicles[name].stopped_at < 0.2 for name in names or air.vehicles)


@pytest.mark.parametrize("stage", [0, 1, 2])
@pytest.mark.parametrize("kind", ["silent_since", "frozen_since"])
def test_one_robot_of_three_is_lost_and_the_others_land(mission, flown, kind, stage) -> None:
    with in_the_air(mission, PLACES) as (air, addresses):
        link = CrazyflieLink(mission, addresses)
        lost = air.vehicles["r1"]
        at(link, air, stage, 0.4, lambda: setattr(lost.manner, kind, air.clock()))
        done = flight_of(link, flown)
        link.close()
        assert not done.flown
        assert stage == 2 or f"r1 was not seen for {UNSEEN} s" in done.reason, "the landing may end before that is noticed"
        assert done.unsafe == ("r1",)
        assert landed(air, "r0", "r2")
        assert any(
            "r1 has not acknowledged" in e.sentence and "flies what was started to its end" in e.sentence
            for e in done.record.events
        )
        assert {number for vehicle in air.vehicles.values() for _, number in vehicle.starts} == set(range(stage + 1))
        assert not lost.dropped
        end = flown[stage].paths["r1"]
        assert lost.spinning
        assert np.linalg.norm(lost.wanted(air.clock())[0, :3] - end.evaluate(end.duration)[:3]) < 1e-3


def test_a_robot_that_is_lost_stops_its_motors_where_that_was_chosen(mission, flown) -> None:
    with in_the_air(mission, PLACES) as (air, addresses):
        link = CrazyflieLink(mission, addresses, failsafe="stop")
        at(link, air, 1, 0.3, lambda: setattr(air.vehicles["r1"].manner, "frozen_since", air.clock()))
        done = flight_of(link, flown)
        link.close()
        assert done.unsafe == ("r1",)
        assert any("r1 has not acknowledged: 1 s after the last sign of life" in event.sentence for event in done.record.events)
        assert air.vehicles["r1"].locked
        assert air.spinning == []
        assert landed(air, "r0", "r2")


@pytest.mark.parametrize("lasts", [3.2, 4.0])
def test_who_is_heard_again_is_landed_and_not_dropped(mission, flown, lasts) -> None:
    with in_the_air(mission, PLACES) as (air, addresses):
        link, ends = CrazyflieLink(mission, addresses), []

        def interfere() -> None:
            air.loss = 1.0
            ends.append(threading.Timer(lasts, setattr, (air, "loss", 0.0)))
            ends[0].start()

        at(link, air, 1, 0.3, interfere)
        done = flight_of(link, flown)
        link.close()
        ends[0].join()
        assert "was not seen" in done.reason
        assert done.unsafe == ()
        assert landed(air)
        assert not any(vehicle.locked or vehicle.dropped for vehicle in air.vehicles.values())


@pytest.mark.parametrize("failsafe", ["stop", "fly on"])
def test_a_host_that_hangs_leaves_to_the_vehicles_what_was_said(mission, flown, failsafe) -> None:
    with in_the_air(mission, PLACES) as (air, addresses):
        link = CrazyflieLink(mission, addresses, failsafe=failsafe)
        at(link, air, 1, 0.5, lambda: time.sleep(1.6))
        done = flight_of(link, flown)
        if failsafe == "stop":
            assert all(vehicle.locked for vehicle in air.vehicles.values())
            assert air.spinning == []
            assert not done.flown
        else:
            assert landed(air)
            assert not any(vehicle.locked for vehicle in air.vehicles.values())
        link.close()


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
@pytest.mark.parametrize("stage", [0, 1, 2])
def test_interruptions_and_errors_land_the_team(mission, flown, error, stage) -> None:
    def fail() -> None:
        raise error("somebody stopped it")

    with in_the_air(mission, PLACES, loss=0.02, disorder=0.02) as (air, addresses):
        link = CrazyflieLink(mission, addresses)
        at(link, air, stage, 0.5, fail)
        done = flight_of(link, flown)
        link.close()
        assert done.reason.startswith("interrupted" if error is KeyboardInterrupt else "ValueError: somebody")
        assert done.unsafe == ()
        assert landed(air)
        assert not any(vehicle.locked or vehicle.dropped for vehicle in air.vehicles.values())


def test_a_second_interruption_in_the_air_stops_motors_at_once(mission, flown) -> None:
    with in_the_air(mission, PLACES) as (air, addresses):
        link, times = CrazyflieLink(mission, addresses), [0.4, 0.6]
        slept = link.sleep

        def sleep(seconds: float) -> None:
            starts = [when for when, number in air.vehicles["r0"].starts if number == 1]
            if times and starts and air.clock() > starts[-1] + times[0]:
                times.pop(0)
                raise KeyboardInterrupt
            slept(min(seconds, 0.05))

        link.sleep = sleep
        done = flight_of(link, flown)
        link.close()
        assert done.unsafe == ()
        assert all(vehicle.locked and vehicle.stopped_at > 0.3 for vehicle in air.vehicles.values())
        assert air.spinning == []


def test_who_is_not_let_start_is_named_and_the_others_land(mission, flown) -> None:
    with in_the_air(mission, PLACES, {"r2": Manner(blocks_after=1)}) as (air, addresses):
        link = CrazyflieLink(mission, addresses)
        done = flight_of(link, flown)
        link.close()
        assert not done.flown
        assert "r2" in done.reason
        assert air.spinning == []
        assert landed(air, "r0", "r1")


def test_vehicles_that_have_to_be_armed_and_speak_an_older_protocol(mission, flown) -> None:
    manners = {name: Manner(needs_arming=True, version=version) for name, version in zip(PLACES, (12, 11, 8), strict=True)}
    with in_the_air(mission, PLACES, manners) as (air, addresses):
        link = CrazyflieLink(mission, addresses, failsafe="stop")
        done = flight_of(link, flown)
        link.close()
        assert done.flown, done.reason
        assert landed(air)
        assert all(vehicle.armed and vehicle.watchdog is not None for vehicle in air.vehicles.values())


def test_memory_that_does_not_keep_what_is_written_keeps_the_team_on_the_ground(mission, flown) -> None:
    with in_the_air(mission, PLACES, {"r1": Manner(forgets=True)}) as (air, addresses):
        link = CrazyflieLink(mission, addresses)
        done = flight_of(link, flown)
        link.close()
        assert "r1 at peer://r1 did not take flight 0: what is read from its memory is not what was sent" in done.reason
        assert all(vehicle.starts == [] for vehicle in air.vehicles.values())


def test_a_flight_that_fills_the_memory_is_written_while_robots_hold(mission, flown) -> None:
    climb, _, landing = flown
    high = {name: [x, y, 0.5] for name, (x, y, _) in PLACES.items()}
    tour = {name: [[spot[0] + 0.005 * (k % 2), *spot[1:]] for k in range(31)] for name, spot in high.items()}
    full = stage("flight", tour)
    assert [len(path) for path in full.paths.values()] == [30, 30, 30]
    with in_the_air(mission, PLACES) as (air, addresses):
        link = CrazyflieLink(mission, addresses)
        done = flight_of(link, (climb, full, landing))
        link.close()
        assert done.flown, done.reason
        assert landed(air)
        assert all(vehicle.commands.count(12) >= 1 for vehicle in air.vehicles.values()), "held by a go-to"
        track = np.array([places[:, 0] for when, places in air.truth if when > air.vehicles["r0"].starts[0][0]])
        assert np.abs(track[:, 1] - PLACES["r0"][1]).max() < 0.05, "nobody jumped while memory was written"


def test_motion_capture_is_sent_to_the_vehicles_and_is_what_counts(mission, flown) -> None:
    with in_the_air(mission, PLACES, {"r1": Manner(off=0.02)}) as (air, addresses):

        def frame() -> dict[str, Body]:
            time.sleep(0.01)
            with air.lock:
                return {
                    name: Body(tuple(vehicle.measured[:3].tolist()), (0.0, 0.0, 0.0, 1.0))
                    for name, vehicle in air.vehicles.items()
                }

        link = CrazyflieLink(mission, addresses, capture=frame, accuracy=0.002)
        assert link.failsafe.startswith("1 s after the last sign of life")
        done = flight_of(link, flown)
        link.close()
        assert done.flown, done.reason
        assert landed(air)
        for vehicle in air.vehicles.values():
            assert len(vehicle.shown) > 200
            assert np.allclose(vehicle.shown[0][:3], PLACES[vehicle.name], atol=1e-3)
            assert vehicle.shown[0][3:] == (0.0, 0.0, 0.0, 1.0)
