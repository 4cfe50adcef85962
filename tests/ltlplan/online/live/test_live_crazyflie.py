"""Online flight in real time over the link to Crazyflies: real cflib, set-points from here, processes that compute beside it."""

import time

import numpy as np
import pytest

from flight.link.live_executive import fly_live
from ltlplan.commands.support.links import below_starts
from ltlplan.missions import load_mission
from ltlplan.online.event_queue import Happenings, checked_events, no_news
from ltlplan.online.files import write_online
from ltlplan.online.live.live_online_flight import OnlineCourse
from ltlplan.online.live.measured_result import flown_live
from ltlplan.online.segments.certified_team import CertifiedTeam
from ltlplan.recorded import judge_flight
from ltlplan.service.execution.background_executor import Beside
from ltlplan.transfers import to_starts
from tests.ltlplan.online.live.test_live_online_flight import BACK, PAIR, nothing_flown_that_was_not_proved
from verify.data import parse_mission
from verify.data.events import HoopMoves, NewFormula, RobotLeaves

pytest.importorskip("cflib", reason="cflib is not installed")

from flight.link.crazyflie.streamed import StreamedCrazyflies
from tests.helpers.live.patience import patient  # noqa: F401  # pytest finds the fixture by its name
from tests.helpers.vehicles.crazyflie_peer import in_the_air

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def beside():
    return Beside()


def fly(mission, beside, *events, at_work=None, **air):
    """Fly a mission online among simulated Crazyflies; return the course, how it ended, and the vehicles."""
    team = CertifiedTeam(mission, seed=mission.planner.seed)
    stand = below_starts(team.present.team)
    before = [transfer.stage for transfer in to_starts(mission, team.present.team, stand)]
    course = OnlineCourse(team, beside, stand, Happenings(checked_events(mission, events), no_news))
    with in_the_air(mission, stand, controller="mellinger", **air) as (world, addresses):
        link = StreamedCrazyflies(mission, addresses, accuracy=0.005)
        if at_work is not None:
            at_work(course, link, world)
        done = fly_live(
            link, before, grounds={name: place[2] for name, place in stand.items()}, onwards=course, unchecked=("battery",)
        )
        link.close()
    return course, done, world


def judged(course, done, folder):
    """Return what was flown, and the judge's verdict on its log."""
    flown = flown_live(course, done, planned_cost=1.0)
    write_online(flown, ["flown"], folder)
    return flown, judge_flight(folder, folder / "flight.csv", max_speed=1.5, error=0.006, start=0.0).verdict


def longest_gap(done):
    """Return the longest time between two poses of a robot in flight, s: a busy machine's log leaves more open than others do."""
    times = {}
    for when, robot, *_ in done.record.poses:
        if done.record.starts["flight"] <= when <= done.record.ends["flight"]:
            times.setdefault(robot, []).append(when)
    return max(np.diff(rows).max() for rows in times.values())


def stand_still(world, *names):
    told = [world.vehicles[name] for name in names or world.vehicles]
    return all(not v.spinning and v.stopped_at < 0.2 and not v.locked and not v.dropped for v in told)


@pytest.mark.parametrize("loss", [0.0, 0.03])
def test_a_formula_that_changes_is_flown_in_proved_pieces_and_its_log_is_judged_alike(beside, tmp_path, loss):
    course, done, world = fly(parse_mission(PAIR), beside, NewFormula(time=1.0, formula=BACK), loss=loss, disorder=loss)
    assert done.flown, done.reason
    assert stand_still(world)
    assert len(course.team.certificates) == 2
    nothing_flown_that_was_not_proved(course, done)
    flown, verdict = judged(course, done, tmp_path)
    assert flown.certified
    assert flown.verdict.outcome == "holds"
    assert verdict.outcome == "holds", verdict.sentence
    for vehicle in world.vehicles.values():  # what is replaced goes on from where it was
        places = np.array([flat[0, :3] for _, flat in vehicle.streamed.kept])
        assert np.abs(np.diff(places, axis=0)).max() < 0.25


def test_fire_fighting_goes_on_where_a_region_moves_and_a_robot_fails(beside, tmp_path):
    moves = HoopMoves(time=1.0, region="smoke", center=(-0.45, -0.1, 0.85))
    course, done, world = fly(load_mission("firefighting"), beside, moves, RobotLeaves(time=5.5, robot="quad1"))
    assert done.flown, done.reason
    assert stand_still(world)
    assert [type(event) for event in course.happened] == [HoopMoves, RobotLeaves]
    assert list(course.team.pilots) == ["quad0", "quad2"]
    nothing_flown_that_was_not_proved(course, done)
    flown, verdict = judged(course, done, tmp_path)
    assert flown.certified
    assert flown.verdict.outcome == "holds"
    assert verdict.outcome == "holds" or (verdict.outcome == "undecided" and longest_gap(done) > 0.05), verdict.sentence


def flown_for(course, link):
    """Return for how long a flight is flown, s; 0 before it begins."""
    return link.now() - course.began if course.began else 0.0


def test_a_robot_that_is_switched_off_ends_the_flight_as_it_cannot_be_told_to_land(beside):
    def at_work(course, link, world):
        def lost():
            if flown_for(course, link) > 0.6 and not np.isfinite(world.vehicles["two"].manner.frozen_since):
                world.vehicles["two"].manner.frozen_since = world.clock()
            return ()

        course.happenings.news = lost

    course, done, world = fly(parse_mission(PAIR), beside, at_work=at_work)
    assert not done.flown
    assert done.reason == "two does not acknowledge that it lands."
    assert done.unsafe == ("two",)
    assert stand_still(world, "one")
    assert world.vehicles["two"].locked, "its own supervisor stopped its motors"
    assert not world.vehicles["two"].spinning
    assert [event.robot for event in course.happened if isinstance(event, RobotLeaves)] == ["two"]


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_ctrl_c_and_errors_land_the_team(beside, error):
    def at_work(course, link, _world):
        def fail():
            if flown_for(course, link) > 0.8:
                raise error
            return ()

        course.happenings.news = fail

    _, done, world = fly(parse_mission(PAIR), beside, at_work=at_work)
    assert not done.flown
    assert done.reason.startswith("interrupted" if error is KeyboardInterrupt else "RuntimeError")
    assert done.unsafe == ()
    assert stand_still(world)


def test_a_host_that_is_gone_leaves_it_to_the_supervisors(beside):
    def gone(course, link, world):
        def hang():
            if flown_for(course, link) > 0.8 and world.spinning:
                time.sleep(2.6)
            return ()

        course.happenings.news = hang

    _, done, world = fly(parse_mission(PAIR), beside, at_work=gone)
    assert not done.flown
    assert world.spinning == []
    assert all(vehicle.locked for vehicle in world.vehicles.values())
