"""A robot that joins a team over a link: it climbs in a certified way or stays on the ground, and every way out is safe.

Flights let time stand still while answers are computed. What was flown is held against straight lines between measured poses, which
nothing of the code under test knows of.
"""

import copy
import itertools
import math

import numpy as np
import pytest

import flight
from flight.link.live_executive import fly_live
from flight.link.simulated import Faults, SimulatedLink
from ltlplan.online.event_queue import Happenings, Told, checked_events, fault_of, no_news
from ltlplan.online.files import write_online
from ltlplan.online.live.executors import way_to_stop, way_up
from ltlplan.online.live.live_online_flight import OnlineCourse
from ltlplan.online.live.measured_result import flown_live
from ltlplan.online.segments.certified_team import CertifiedTeam
from ltlplan.online.standby import standby_of
from ltlplan.recorded import judge_flight
from ltlplan.transfers import to_starts
from tests.helpers.live.live_missions import PAIR
from tests.ltlplan.online.live.test_live_online_flight import (
    BACK,
    PLACES,
    Asked,
    died,
    nothing_flown_that_was_not_proved,
    sentences,
)
from verify.data import Infeasible, parse_mission
from verify.data.events import NewFormula, ObstacleAppears, RobotJoins, RobotLeaves
from verify.data.sections import Agent
from verify.data.shapes.obstacle import Obstacle

START = (0.0, -1.0, 0.8)


def joins(time=1.0, start=START, robot="three"):
    return RobotJoins(time=time, robot=robot, agent=Agent(start=start))


@pytest.fixture(scope="module")
def team():
    return CertifiedTeam(parse_mission(PAIR), seed=1)


@pytest.fixture(scope="module")
def ready(team):
    return team, [transfer.stage for transfer in to_starts(team.mission, team.present.team, PLACES)]


def fly(ready, *events, standby=None, computer=None, faults=None, at=None, news=None, vehicles=SimulatedLink):
    """Fly the pair online; `at` is called with course and link at every look, and what it returns is told."""
    team, before = copy.deepcopy(ready[0]), ready[1]
    waits = standby_of(team.mission, standby or {}, events)
    stand = {**PLACES, **waits.places}
    link = vehicles(waits.beside(team.mission), stand, conditions=flight.Conditions(noise=0.001), faults=faults or Faults())
    computer = computer or Asked()
    computer.link = link
    course = OnlineCourse(
        team, computer, stand, Happenings(checked_events(team.mission, events, waits), news or no_news), waits
    )
    if at is not None:
        course.happenings.news = lambda: at(course, link) or ()
    done = fly_live(link, before, grounds={name: place[2] for name, place in stand.items()}, onwards=course)
    link.sleep(5.0)  # who was not told acts alone
    assert link.spinning == ()
    return course, done, link


def step(course):
    """Return how far the one that joins has come."""
    return None if course._joining.newcomer is None else course._joining.newcomer.step


def climbing(course, link, since=0.5):
    """Tell whether somebody climbs for so many s already."""
    return step(course) == "climbs" and course._air.climb and course._air.now - float(course._air.climb.start) >= since


def nobody_came_near_another(mission, done, names):
    """Sample all poses on straight lines, from the first climb to the last landing, and look at each pair."""
    rows = {name: np.array([(t, *place) for t, robot, *place in done.record.poses if robot == name]) for name in names}
    rows = {name: table[np.unique(table[:, 0], return_index=True)[1]] for name, table in rows.items() if len(table)}
    for one, other in itertools.combinations(rows, 2):
        a, b = rows[one], rows[other]
        times = np.arange(max(a[0, 0], b[0, 0]), min(a[-1, 0], b[-1, 0]), 0.005)
        gaps = [np.interp(times, a[:, 0], a[:, axis]) - np.interp(times, b[:, 0], b[:, axis]) for axis in (1, 2, 3)]
        apart = np.sqrt(sum(gap * gap for gap in gaps))
        assert apart.min() > mission.vehicle_of("one").radius * 2, (one, other, apart.min())


def judged(course, done, folder):
    """Return what was flown, and the judge's verdict on its files."""
    flown = flown_live(course, done, planned_cost=1.0)
    write_online(flown, ["flown"], folder)
    return flown, judge_flight(folder, folder / "flight.csv", max_speed=1.5, error=0.006, start=0.0).verdict


def stays(done):
    """Return what is said of a robot that does not join."""
    (found,) = (sentence for sentence in sentences(done) if "does not join" in sentence)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("place", [None, (-0.3, -1.2, 0.0)], ids=["below its start", "elsewhere"])
def test_it_climbs_while_the_others_hover_and_flies_the_next_piece(ready, tmp_path, place):
    asked = "F left & F right & F(left & F right)"
    course, done, _ = fly(
        ready, joins(), NewFormula(time=2.0, formula=asked), standby={} if place is None else {"three": place}
    )
    assert done.flown, done.reason
    assert done.unsafe == ()
    formula, came = course.happened
    assert isinstance(formula, NewFormula)
    assert math.dist(came.agent.start, START) < 1e-5
    assert 1.0 < came.climbs < came.time
    assert list(course.team.all_pieces[-1].team) == ["one", "two", "three"]
    names = [name for name in done.record.starts if name.startswith("three")]
    assert names == ["three climb"] + ["three way"] * (place is not None)
    nothing_flown_that_was_not_proved(course, done)
    nobody_came_near_another(course.team.mission, done, ("one", "two", "three"))
    flown, verdict = judged(course, done, tmp_path)
    assert flown.certified
    assert (flown.verdict.outcome, verdict.outcome) == ("holds", "holds"), verdict.sentence
    for time, robot, *at in done.record.poses:  # the others hover while it climbs
        if came.climbs <= time - course.began <= came.time and robot != "three":
            rest = course.team.all_pieces[0].team[robot]
            piece = next(p for p in reversed(course.team.all_pieces) if float(p.since) <= came.climbs)
            rest = piece.team[robot]
            assert math.dist(at, rest.evaluate(rest.duration)[:3]) < 0.05


@pytest.mark.slow
def test_who_joins_does_what_nobody_else_is_left_to_do(ready, tmp_path):
    """Both others leave once it has joined, and it does all of what is left."""
    events = joins(0.5), RobotLeaves(time=12.0, robot="one"), RobotLeaves(time=12.5, robot="two")
    course, done, _ = fly(ready, NewFormula(time=0.2, formula=f"({BACK}) & F (left & F (right & F left))"), *events)
    assert done.flown, done.reason
    assert list(course.team.pilots) == ["three"]
    flown, verdict = judged(course, done, tmp_path)
    assert (flown.verdict.outcome, verdict.outcome) == ("holds", "holds"), verdict.sentence
    nothing_flown_that_was_not_proved(course, done)


@pytest.mark.slow
def test_two_that_are_told_to_join_join_one_after_the_other(ready, tmp_path):
    course, done, _ = fly(ready, joins(), joins(1.1, (0.0, 1.2, 0.8), "four"))
    assert done.flown, done.reason
    assert [event.robot for event in course.happened] == ["three", "four"]
    assert course.happened[0].time <= course.happened[1].climbs
    nobody_came_near_another(course.team.mission, done, ("one", "two", "three", "four"))
    flown, verdict = judged(course, done, tmp_path)
    assert (flown.verdict.outcome, verdict.outcome) == ("holds", "holds"), verdict.sentence


def fails_somehow(kind):
    """Return what has the newcomer fail while it climbs, or who answers: computer, link or person."""

    def at(course, link):
        if not climbing(course, link):
            return
        now = link.now()
        match kind:
            case "unseen" | "flat" | "deaf":
                getattr(link.faults, kind).setdefault("three", now)
                if kind == "deaf":
                    link.faults.unseen.setdefault("three", now)
            case "pushed":
                link.faults.pushed.setdefault("three", (now, 0.2))
            case "lost":
                link.faults.lost = link.faults.lost or now
            case "one unseen":
                link.faults.unseen.setdefault("one", now)
            case "one pushed":
                link.faults.pushed.setdefault("one", (now, 0.2))
            case "ctrl-c":
                raise KeyboardInterrupt
            case _:
                raise RuntimeError(kind)

    return at


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "why"), [("unseen", "was not seen"), ("flat", "battery lasts"), ("pushed", "from its plan")])
def test_one_that_fails_while_it_climbs_lands_and_the_others_go_on(ready, tmp_path, kind, why):
    course, done, _ = fly(ready, joins(), at=fails_somehow(kind))
    assert done.flown, done.reason
    assert why in stays(done)
    assert "it lands where it is" in stays(done)
    assert course.happened == []
    assert list(course.team.mission.agents) == ["one", "two"]
    nothing_flown_that_was_not_proved(course, done)
    flown, verdict = judged(course, done, tmp_path)
    assert (flown.verdict.outcome, verdict.outcome) == ("holds", "holds"), verdict.sentence
    (down,) = course._air.leaving
    assert down.off
    begins = float(course.team.all_pieces[-1].start)
    assert begins >= down.down - course.began, "nobody flies before it is down"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["deaf", "lost", "one pushed", "ctrl-c", "error"])
def test_what_ends_the_flight_while_it_climbs_brings_all_to_the_ground(ready, kind):
    course, done, _ = fly(ready, joins(), at=fails_somehow(kind))
    assert not done.flown
    assert done.unsafe == (("three",) if kind == "deaf" else ("one", "two", "three") if kind == "lost" else ())
    if kind not in ("deaf", "lost"):
        assert any("the motors of one, two, three are stopped" in sentence for sentence in sentences(done))
    assert not any(isinstance(event, RobotJoins) for event in course.happened)


@pytest.mark.slow
@pytest.mark.parametrize("place", [(*START[:2], 0.0), (-0.3, -1.2, 0.0)], ids=["below its start", "elsewhere"])
def test_another_one_that_is_lost_while_it_climbs_lands_and_it_joins_the_rest(ready, tmp_path, place):
    course, done, link = fly(
        ready, NewFormula(time=0.3, formula=BACK), joins(), at=fails_somehow("one unseen"), standby={"three": place}
    )
    assert link._fleet.commanders["one"].wanted(link.now())[0, 2] < 0.1, "it was not started again"
    assert done.flown, done.reason
    assert [type(event) for event in course.happened] == [NewFormula, RobotLeaves, RobotJoins]
    assert list(course.team.pilots) == ["two", "three"]
    flown, verdict = judged(course, done, tmp_path)
    assert (flown.verdict.outcome, verdict.outcome) == ("holds", "holds"), verdict.sentence


@pytest.mark.slow
@pytest.mark.parametrize("when", ["brakes", "asks", "waits", "wakes", "climbs"])
def test_ctrl_c_lands_all_and_stops_all_motors_at_every_step(ready, when):
    def at(course, link):
        if step(course) == when:
            raise KeyboardInterrupt

    class Slow(SimulatedLink):
        def ready(self, robot, number):
            super().ready(robot, number)
            self._fleet.commanders[robot].spinning = True  # armed, as motors of others turn then
            return False

    late = {way_up: [0.3], way_to_stop: [0.1]}
    _, done, link = fly(ready, joins(), at=at, computer=Asked(late=late), vehicles=Slow if when == "wakes" else SimulatedLink)
    assert done.reason == "interrupted"
    assert done.unsafe == ()
    if when in ("brakes", "asks", "waits"):
        assert link.pose("three").position[2] < 0.02
        assert not any("three" in sentence and "motors" in sentence for sentence in sentences(done))


@pytest.mark.slow
def test_events_while_it_climbs_are_taken_and_a_body_in_its_world_ends_the_climb(ready):
    box = Obstacle.model_validate({"center": (0.0, 1.5, 1.0), "size": (0.2, 0.2, 0.2)})
    told = []

    def at(course, link):
        if climbing(course, link) and not told:
            told.append(ObstacleAppears(time=0.0, name="box", obstacle=box))
            return told
        return ()

    course, done, _ = fly(ready, joins(), at=at)
    assert done.flown, done.reason
    assert "box appears" in stays(done)
    assert [type(event) for event in course.happened] == [ObstacleAppears]
    nothing_flown_that_was_not_proved(course, done)


@pytest.mark.slow
def test_another_one_that_leaves_while_it_makes_ready_is_not_started_again(ready):
    told = []

    class Slow(SimulatedLink):
        def ready(self, robot, number):
            return super().ready(robot, number) and bool(told)

    def at(course, link):
        if step(course) == "wakes" and not told:
            told.append(RobotLeaves(time=0.0, robot="one"))
            return told
        return ()

    course, done, link = fly(ready, NewFormula(time=0.3, formula=BACK), joins(), at=at, vehicles=Slow)
    assert done.flown, done.reason
    assert "one fails and lands, and its climb was proved without that" in stays(done)
    down = {one.robot: one.down for one in course._air.leaving}
    commander = link._fleet.commanders["one"]
    assert not commander.spinning
    assert commander.wanted(link.now())[0, 2] < 0.1
    assert set(down) == {"one", "three"}


@pytest.mark.slow
def test_before_it_moves_its_climb_is_proved_anew_in_a_world_that_changed(ready):
    """A body comes to stand in its column while the first climb is being proved."""
    box = Obstacle.model_validate({"center": (0.0, -1.0, 0.5), "size": (0.2, 0.2, 0.1)})
    told = []

    def at(course, link):
        if step(course) == "asks" and not told:
            told.append(ObstacleAppears(time=0.0, name="box", obstacle=box))
            return told
        return ()

    computer = Asked(late={way_up: [1.0]})
    course, done, _ = fly(ready, joins(), at=at, computer=computer)
    assert done.flown, done.reason
    assert computer.kinds.count(way_up) == 2
    assert len(course.happened) == 1 + (not any("does not join" in sentence for sentence in sentences(done)))
    nothing_flown_that_was_not_proved(course, done)


def infeasible(_question, _progress):
    raise Infeasible("there is no way.")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"computer": lambda: Asked(instead={way_up: infeasible})}, "no climb is certified: there is no way."),
        ({"faults": lambda: Faults(unseen={"three": 9.5})}, "last pose is"),
        ({"faults": lambda: Faults(pushed={"three": (9.5, 0.1)})}, "from where the climb begins"),
        ({"faults": lambda: Faults(flat={"three": 9.5})}, "battery lasts 0 s"),
        ({"faults": lambda: Faults(deaf={"three": 9.5})}, "does not take flight"),
    ],
    ids=["no climb", "unseen", "moved", "flat", "deaf"],
)
def test_one_that_cannot_climb_stays_on_the_ground_and_the_others_go_on(ready, tmp_path, changes, why):
    answers = []
    told = Told(joins(0.5), lambda *answer: answers.append(answer))
    asked = iter([(told,)])
    course, done, _ = fly(
        ready, standby={"three": (*START[:2], 0.0)}, news=lambda: next(asked, ()),
        **{name: made() for name, made in changes.items()},
    )  # fmt: skip
    assert done.flown, done.reason
    assert why in stays(done)
    assert answers == [(False, stays(done))]
    heights = [z for _, robot, _, _, z in done.record.poses if robot == "three"]
    assert max(heights) < 0.02
    nothing_flown_that_was_not_proved(course, done)
    flown, verdict = judged(course, done, tmp_path)
    assert (flown.verdict.outcome, verdict.outcome) == ("holds", "holds"), verdict.sentence


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["killed", "hangs"])
def test_who_proves_its_climb_is_killed_or_hangs_and_the_team_holds_and_lands(ready, fault):
    asked = Asked(instead={way_up: died}) if fault == "killed" else Asked(late={way_up: [1e9]})
    _, done, link = fly(ready, joins(), computer=asked)
    assert not done.flown
    assert ("gives no answer" if fault == "killed" else "hangs") in done.reason
    assert link.pose("three").position[2] < 0.02


@pytest.mark.slow
def test_one_that_fails_before_it_has_climbed_is_left_out(ready):
    told = []

    def at(course, link):
        if climbing(course, link) and not told:
            told.append(RobotLeaves(time=0.0, robot="three"))
            return told
        return ()

    course, done, _ = fly(ready, joins(), at=at)
    assert done.flown, done.reason
    assert "three fails and lands" in stays(done)
    assert course.happened == []
    again = fault_of(course.team, joins(), course._joining.standby)
    assert "it is not among the robots that wait" in again
