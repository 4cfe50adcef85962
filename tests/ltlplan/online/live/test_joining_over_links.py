"""Robots that join a team in real time: Crazyflies by real cflib, and PX4 over local sockets with real MAVLink."""

from contextlib import ExitStack, contextmanager

import numpy as np
import pytest

from flight.link.live_executive import fly_live
from flight.link.mavlink import MavlinkLink
from ltlplan.commands.support.links import below_starts
from ltlplan.online.event_queue import Happenings, checked_events, no_news
from ltlplan.online.live.live_online_flight import OnlineCourse
from ltlplan.online.segments.certified_team import CertifiedTeam
from ltlplan.online.standby import standby_of
from ltlplan.service.execution.background_executor import Beside
from ltlplan.transfers import to_starts
from tests.helpers.live.live_missions import PAIR
from tests.helpers.live.patience import patient  # noqa: F401  # pytest finds the fixture by its name
from tests.helpers.vehicles.px4_peer import HOLD, POSITION, Manner, Px4Peer, free_port
from tests.ltlplan.online.live.test_joining import climbing, joins, judged, stays
from tests.ltlplan.online.live.test_live_online_flight import nothing_flown_that_was_not_proved, sentences
from verify.data import parse_mission
from verify.data.events import RobotJoins

pytestmark = pytest.mark.slow

NAMES = ("one", "two", "three")
SLOW = PAIR + "margin: 0.15\nlimits: {speed: 0.25}\nplanner: {speed: 0.2}\n"
"""A PX4 vehicle of these is where its last set-point was, and a busy machine sends one some tenths of a second late."""


@pytest.fixture(scope="module")
def beside():
    return Beside()


def fly(mission, beside, reached, *, at=None):
    """Fly a pair whom a third one joins over vehicles that `reached` yields; return the course, how it ended, and the vehicles."""
    team, event = CertifiedTeam(mission, seed=1), joins()
    waits = standby_of(mission, {}, [event])
    stand = below_starts(team.present.team)
    before = [transfer.stage for transfer in to_starts(waits.solid(mission), team.present.team, stand)]
    stand |= waits.places
    course = OnlineCourse(team, beside, stand, Happenings(checked_events(mission, [event], waits), no_news), waits)
    with reached(waits.beside(mission), stand) as (link, vehicles):
        if at is not None:
            course.happenings.news = lambda: at(course, vehicles) or ()
        done = fly_live(
            link, before, grounds={name: place[2] for name, place in stand.items()}, onwards=course, unchecked=("battery",)
        )
    return course, done, vehicles


def it_joined(course, done, folder):
    assert done.flown, done.reason
    assert [type(event) for event in course.happened] == [RobotJoins]
    assert list(course.team.all_pieces[-1].team) == list(NAMES)
    nothing_flown_that_was_not_proved(course, done)
    flown, verdict = judged(course, done, folder)
    assert flown.certified
    assert flown.verdict.outcome == "holds"
    assert verdict.outcome != "fails", verdict.sentence
    return verdict


# -- PX4 --------------------------------------------------------------------------------------------------------


def px4(**manners):
    @contextmanager
    def reached(mission, places):
        with ExitStack() as stack:
            ports = {name: free_port() for name in places}
            peers = {
                name: Px4Peer(number + 1, ports[name], (y, x, -z), manners.get(name, Manner(armed=False)))
                for number, (name, (x, y, z)) in enumerate(places.items())
            }
            for peer in peers.values():
                peer.start()
                stack.callback(peer.join)
                stack.callback(peer.ended.set)
            link = MavlinkLink(mission, {name: f"udpin:127.0.0.1:{port}" for name, port in ports.items()}, accuracy=0.005)
            stack.callback(link.close)
            yield link, peers

    return reached


def told_nothing_before_it_is_to_join(course, peers):
    if course._air.now < 0.9:
        assert not peers["three"].armed
        assert not set(peers["three"].asked) - {POSITION}
        assert not peers["three"].arrivals


def test_a_px4_vehicle_is_armed_when_it_is_to_join_and_climbs(beside, tmp_path):
    course, done, peers = fly(parse_mission(SLOW), beside, px4(), at=told_nothing_before_it_is_to_join)
    it_joined(course, done, tmp_path)
    assert not any(peer.armed for peer in peers.values())
    assert all(peer.failsafes == 0 for peer in peers.values())
    for peer in peers.values():  # nobody's set-points jump
        rows = np.array(peer.flown)
        assert np.abs(np.diff(rows[:, 1:], axis=0)).max() < 0.15


def test_px4_vehicles_fly_that_stand_in_hold(beside):
    """As they do after they were switched on, where no pilot has chosen another mode."""

    @contextmanager
    def reached(mission, places):
        with px4()(mission, places) as (link, peers):
            for peer in peers.values():
                peer.mode = HOLD
            yield link, peers

    course, done, peers = fly(parse_mission(SLOW), beside, reached)
    assert done.flown, done.reason
    assert course.happened
    assert not any(peer.armed for peer in peers.values())


@pytest.mark.parametrize("manner", [Manner(armed=False, refuses_arming=True), Manner(armed=False, deaf_to=(6 << 16,))])
def test_a_px4_vehicle_that_does_not_make_ready_stays(beside, manner):
    course, done, peers = fly(parse_mission(SLOW), beside, px4(three=manner))
    assert done.flown, done.reason
    assert "three does not make ready to fly" in stays(done)
    assert course.happened == []
    assert not any(peer.armed for peer in peers.values())
    assert peers["three"].place[2] == pytest.approx(0.0, abs=1e-3)


def test_a_px4_vehicle_that_falls_silent_while_it_climbs_is_left_to_its_failsafe(beside):
    _, done, peers = fly(parse_mission(SLOW), beside, px4(three=Manner(armed=False, falls_silent_after=60)))
    assert "three was not seen" in stays(done)
    assert not done.flown
    assert done.reason == "three does not acknowledge that it lands."
    assert not peers["one"].armed
    assert not peers["two"].armed


# -- Crazyflies -------------------------------------------------------------------------------------------------


def crazyflies(**manners):
    pytest.importorskip("cflib", reason="cflib is not installed")
    from flight.link.crazyflie.streamed import StreamedCrazyflies
    from tests.helpers.vehicles.crazyflie_peer import in_the_air

    @contextmanager
    def reached(mission, places):
        with in_the_air(mission, places, manners, controller="mellinger") as (world, addresses):
            link = StreamedCrazyflies(mission, addresses, accuracy=0.005)
            try:
                yield link, world
            finally:
                link.close()

    return reached


@pytest.mark.parametrize("needs_arming", [False, True])
def test_a_crazyflie_climbs_and_joins(beside, tmp_path, needs_arming):
    from tests.helpers.vehicles.crazyflie_firmware import Manner as CrazyflieManner

    streamed = []

    def at(course, world):
        three = world.vehicles["three"]
        if course._air.now < 0.9:
            assert three.armed != needs_arming, "nobody arms one that waits"
            assert not three.spinning
            streamed.append(len(three.streamed.kept))

    reached = crazyflies(**{name: CrazyflieManner(needs_arming=needs_arming) for name in NAMES})
    course, done, world = fly(parse_mission(SLOW), beside, reached, at=at)
    it_joined(course, done, tmp_path)
    assert set(streamed) == {0}
    for vehicle in world.vehicles.values():
        assert not vehicle.spinning
        assert not vehicle.locked
        assert not vehicle.dropped
        places = np.array([flat[0, :3] for _, flat in vehicle.streamed.kept])
        assert np.abs(np.diff(places, axis=0)).max() < 0.25


def test_a_crazyflie_that_is_gone_while_it_climbs_ends_the_flight_as_it_cannot_be_told_to_land(beside):
    def at(course, world):
        if climbing(course, None) and not np.isfinite(world.vehicles["three"].manner.frozen_since):
            world.vehicles["three"].manner.frozen_since = world.clock()

    from tests.helpers.vehicles.crazyflie_firmware import Manner as CrazyflieManner

    _, done, world = fly(parse_mission(SLOW), beside, crazyflies(three=CrazyflieManner()), at=at)
    assert not done.flown
    assert done.reason == "three does not acknowledge that it lands."
    assert done.unsafe == ("three",)
    assert world.spinning == []
    assert not world.vehicles["one"].locked
    assert not world.vehicles["two"].locked


@pytest.mark.parametrize("when", ["wakes", "climbs"])
def test_ctrl_c_brings_a_crazyflie_down_that_joins(beside, when):
    def at(course, world):
        if (
            course._joining.newcomer is not None
            and course._joining.newcomer.step == when
            and (when == "wakes" or climbing(course, None))
        ):
            raise KeyboardInterrupt

    _, done, world = fly(parse_mission(SLOW), beside, crazyflies(), at=at)
    assert done.reason == "interrupted"
    assert done.unsafe == ()
    assert world.spinning == []
    assert all(vehicle.stopped_at < 0.2 for vehicle in world.vehicles.values())
    assert not any(vehicle.dropped for vehicle in world.vehicles.values())
    assert "all robots land." in sentences(done)
