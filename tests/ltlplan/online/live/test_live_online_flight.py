"""Online flight over the simulated link: nothing is flown that was not proved, and every way out ends on the ground.

Most flights here let time stand still while answers are computed, so that they are quick and always the same; those in real time have a process
beside them.
"""

import copy
import itertools
import math
from dataclasses import dataclass, field

import numpy as np
import pytest

import flight
from flight.link.live_executive import fly_live
from flight.link.phases import FLIGHT, Stage
from flight.link.simulated import Faults, SimulatedLink
from ltlplan.missions import load_mission
from ltlplan.online.event_queue import TOO_LATE, Happenings, Told, checked_events, no_news
from ltlplan.online.files import write_online
from ltlplan.online.live.executors import Given, NoAnswer, judgement, next_piece, way_down, way_to_stop
from ltlplan.online.live.live_online_flight import OnlineCourse
from ltlplan.online.live.measured_result import flown_live
from ltlplan.online.segments.certified_team import CertifiedTeam
from ltlplan.recorded import judge_flight
from ltlplan.transfers import to_starts
from tests.helpers.live.live_missions import PAIR
from verify.data import Infeasible, LtlplanError, parse_mission
from verify.data.events import HoopMoves, NewFormula, ObstacleAppears, RobotJoins, RobotLeaves
from verify.data.progress import silent
from verify.data.sections import Agent
from verify.data.shapes.obstacle import Obstacle
from verify.flight_segments import judge_pieces

pytestmark = pytest.mark.slow  # each flies for half a minute

PLACES = {"one": (-1.0, -0.5, 0.0), "two": (1.0, -0.5, 0.0)}
BACK = "F left & F right & F(left & F right)"
"""What asks one robot to fly on to the other one's region."""


@pytest.fixture(scope="module")
def ready():
    """A certified team, and its way to its starts."""
    team = CertifiedTeam(parse_mission(PAIR), seed=1)
    return team, [transfer.stage for transfer in to_starts(team.mission, team.present.team, PLACES)]


class AtOnce:
    """Answers in this process, while time stands still."""

    def ask(self, work, question):
        try:
            return Given(work(question, silent))
        except LtlplanError as error:
            return Given(None, error)


@dataclass
class Asked:
    """A computer that keeps what it was asked, and may answer otherwise, late or not at all.

    Attributes:
        instead: Work to what is done in its place.
        late: Work to s of the link's clock after which its answers are there, one after another; the others at once.
        kinds: Work that was asked for, in order.
    """

    instead: dict = field(default_factory=dict)
    late: dict = field(default_factory=dict)
    kinds: list = field(default_factory=list)
    questions: list = field(default_factory=list)
    dropped: int = 0
    link: SimulatedLink = None

    def ask(self, work, question):
        self.kinds.append(work)
        self.questions.append(question)
        answer = AtOnce().ask(self.instead.get(work, work), question)
        late = self.late.get(work, ())
        return Late(answer, self, self.link.now() + (late.pop(0) if late else 0.0))


@dataclass
class Late:
    answer: Given
    asked: Asked
    there: float

    def done(self):
        return self.asked.link.now() >= self.there

    def result(self):
        return self.answer.result()

    def drop(self):
        self.asked.dropped += not self.done()


def fly(ready, *events, computer=None, faults=None, news=None, real_time=False, then=None):
    team, before = ready
    conditions = flight.Conditions(noise=0.001)
    link = SimulatedLink(team.mission, PLACES, conditions=conditions, faults=faults, real_time=real_time)
    computer = computer or Asked()
    computer.link = link
    course = OnlineCourse(
        copy.deepcopy(team), computer, PLACES, Happenings(checked_events(team.mission, events), news or no_news)
    )
    if then is not None:
        then(course, link)
    done = fly_live(link, before, grounds=dict.fromkeys(PLACES, 0.0), onwards=course)
    link.sleep(5.0)  # who was not told acts alone
    assert link.spinning == ()
    return course, done, computer


def sentences(done):
    return [event.sentence for event in done.record.events]


def nothing_flown_that_was_not_proved(course, done):
    """Hold all set-points of the flight against the proved pieces, and the pieces against the judge."""
    pieces = course.team.all_pieces
    assert all(verdict.outcome == "holds" for verdict in judge_pieces(course.team.mission, pieces))
    ends = [*(float(piece.since) for piece in pieces[1:]), math.inf]
    checked = 0
    for time, robot, *place in done.record.setpoints:
        at = time - course.began
        if not 0.0 <= at <= course.ended - course.began:
            continue
        piece = next(p for p, end in zip(pieces, ends, strict=True) if at < end)
        if robot not in piece.team:
            continue
        wanted = piece.team[robot].evaluate(max(at - float(piece.start), 0.0))[:3]
        assert np.linalg.norm(wanted - place) < 1e-6 or at < float(piece.start), (robot, at)
        checked += 1
    assert checked > 50
    for one, other in itertools.pairwise(pieces):
        for name in one.team.keys() & other.team.keys():
            ends_at = one.team[name].evaluate(float(other.since - one.start))
            begins_at = other.team[name].evaluate(float(other.since - other.start))
            assert np.abs(ends_at - begins_at).max() < 1e-4


def test_a_formula_that_changes_is_flown_in_proved_pieces_and_its_log_is_judged_alike(ready, tmp_path):
    course, done, _ = fly(ready, NewFormula(time=1.0, formula=BACK))
    assert done.flown, done.reason
    assert len(course.team.certificates) == 2
    assert [piece.since <= piece.start for piece in course.team.all_pieces] == [True, False, True]
    nothing_flown_that_was_not_proved(course, done)
    (answered,) = course.answered
    assert 0 <= answered.stop <= answered.proved <= answered.begun
    flown = flown_live(course, done, planned_cost=1.0)
    assert flown.certified
    assert flown.require().satisfied_at is not None
    write_online(flown, ["flown"], tmp_path)
    judged = judge_flight(tmp_path, tmp_path / "flight.csv", max_speed=1.5, error=0.006, start=0.0)
    assert judged.verdict.outcome == "holds", judged.verdict.sentence


def test_the_log_of_a_flight_that_leaves_something_undone_is_judged_alike(ready, tmp_path):
    course, done, _ = fly(ready, NewFormula(time=1.0, formula="F left & F right & G !left"))
    assert done.flown, done.reason
    assert any("No certified pieces for what is left" in sentence for sentence in sentences(done))
    flown = flown_live(course, done, planned_cost=1.0)
    assert not flown.verdict
    assert flown.satisfied_at is None
    write_online(flown, ["flown"], tmp_path)
    assert judge_flight(tmp_path, tmp_path / "flight.csv", max_speed=1.5, error=0.006, start=0.0).verdict.outcome == "fails"
    assert list(done.record.starts)[-1] == "landing"


def test_an_event_while_an_answer_is_computed_makes_that_answer_void(ready):
    events = NewFormula(time=1.0, formula="F left & F right & F(right & F left)"), NewFormula(time=1.4, formula=BACK)
    course, done, asked = fly(ready, *events, computer=Asked(late={next_piece: [0.6]}))
    assert done.flown, done.reason
    assert asked.dropped == 1
    first, second = (q for work, q in zip(asked.kinds, asked.questions, strict=True) if work is next_piece)
    assert first.mission.spec.formula != second.mission.spec.formula
    assert [one.proved is None for one in course.answered] == [True, False]
    assert len(course.team.certificates) == 2
    nothing_flown_that_was_not_proved(course, done)


def test_an_event_while_a_way_to_stop_is_looked_for_waits_for_that(ready):
    events = NewFormula(time=1.0, formula=BACK), HoopMoves(time=1.04, region="left", center=(-1.0, 0.7, 1.3))
    course, done, asked = fly(ready, *events, computer=Asked(late={way_to_stop: [0.1]}))
    assert done.flown, done.reason
    assert asked.kinds[:3] == [way_to_stop, next_piece, way_to_stop]
    assert [event.time for event in course.happened] == pytest.approx([1.0, 1.12], abs=0.03)
    nothing_flown_that_was_not_proved(course, done)


def test_a_way_to_stop_that_comes_too_late_is_asked_for_anew_and_begins_later(ready):
    course, done, asked = fly(ready, NewFormula(time=0.05, formula=BACK), computer=Asked(late={way_to_stop: [0.6]}))
    assert done.flown, done.reason
    stops = [q for work, q in zip(asked.kinds, asked.questions, strict=True) if work is way_to_stop]
    assert [stop.reaction for stop in stops] == pytest.approx([0.3, 1.2], abs=0.05)
    assert {stop.now for stop in stops} == {stops[0].now}, "it is judged from the event on"
    nothing_flown_that_was_not_proved(course, done)


def test_a_judgement_that_comes_too_late_is_asked_for_anew_with_a_later_beginning(ready):
    course, done, asked = fly(ready, NewFormula(time=1.0, formula=BACK), computer=Asked(late={judgement: [2.0]}))
    assert done.flown, done.reason
    starts = [q.last.start for work, q in zip(asked.kinds, asked.questions, strict=True) if work is judgement]
    assert len(starts) > 1
    assert sorted(starts) == starts
    assert course.team.all_pieces[-1].start == starts[-1]
    nothing_flown_that_was_not_proved(course, done)


def died(_question, _progress):
    raise NoAnswer("who computes what is flown next gives no answer: ended.")


@pytest.mark.parametrize("work", [way_to_stop, next_piece, judgement, way_down])
@pytest.mark.parametrize("fault", ["killed", "hangs"])
def test_who_computes_is_killed_or_hangs_and_the_team_holds_and_lands(ready, work, fault):
    asked = Asked(instead={work: died}) if fault == "killed" else Asked(late={work: [1e9]})
    course, done, _ = fly(ready, NewFormula(time=1.0, formula=BACK), computer=asked)
    assert not done.flown
    assert done.unsafe == ()
    assert ("gives no answer" if fault == "killed" else "hangs") in done.reason
    assert "all robots land." in sentences(done)
    assert len(course.team.certificates) == 1 + (work is way_down)
    if work is way_to_stop:
        assert "did not come to rest in a certified way" in course.team.lost
        assert len(course.team.all_pieces) == 1, "of what came after the event nothing is proved"


def starts_proved(monkeypatch, ready, first: float | None, later: float | None) -> None:
    """Have the proof of tracking let pieces begin so many m beyond what a measurement may be off; None where nothing is proved."""
    begins = ready[0].certified.certificate.digest()
    accuracy = SimulatedLink(ready[0].mission, PLACES, conditions=flight.Conditions(noise=0.001)).accuracy

    def start(stage: Stage) -> float | None:
        beyond = None if stage.name != FLIGHT else first if stage.certificate.digest() == begins else later
        return None if beyond is None else accuracy + beyond

    monkeypatch.setattr(Stage, "start", property(start))


@pytest.mark.parametrize(("later", "pieces"), [(0.03, 2), (1e-6, 1)])
def test_a_piece_begins_only_within_what_a_proof_of_tracking_assumes(ready, monkeypatch, later, pieces):
    starts_proved(monkeypatch, ready, 0.03, later)
    course, done, _ = fly(ready, NewFormula(time=1.0, formula=BACK))
    assert done.flown, done.reason
    assert len(course.team.certificates) == pieces
    refused = [
        one for one in sentences(done) if "tracking is not proved from where robots are" in one and "m are allowed" in one
    ]
    assert len(refused) == 2 - pieces


@pytest.mark.parametrize(("first", "said"), [(1e-6, "m are allowed"), (0.0, "state a greater `disturbance.start`")])
def test_an_online_flight_begins_only_within_what_a_proof_of_tracking_assumes(ready, monkeypatch, first, said):
    starts_proved(monkeypatch, ready, first, None)
    _, done, _ = fly(ready)
    assert not done.flown
    assert said in done.reason


def test_a_proof_that_fails_lets_the_team_hover_and_then_land_in_a_certified_way(ready):
    def infeasible(_question, _progress):
        raise Infeasible("there is no way.")

    course, done, _ = fly(ready, NewFormula(time=1.0, formula=BACK), computer=Asked(instead={next_piece: infeasible}))
    assert done.flown, done.reason
    assert len(course.team.certificates) == 1
    assert any("there is no way" in sentence for sentence in sentences(done))
    assert course.ended - course.began > 1.0 + 3.0
    assert not flown_live(course, done, planned_cost=1.0).verdict


@pytest.mark.parametrize("fault", ["unseen", "flat"])
def test_a_robot_that_is_lost_lands_and_the_rest_does_what_is_left(ready, fault):
    def at_work(course, link):
        def lost():
            if course.began and not getattr(link.faults, fault):
                getattr(link.faults, fault)["two"] = course.began + 0.5
            return ()

        course.happenings.news = lost

    course, done, _ = fly(ready, then=at_work, faults=Faults())
    (left,) = course.happened
    assert isinstance(left, RobotLeaves)
    assert left.robot == "two"
    assert left.time == pytest.approx(0.5, abs=0.05), "from when it was seen last"
    assert "two lands where it is." in sentences(done)
    assert list(course.team.pilots) == ["one"]
    assert flown_live(course, done, planned_cost=1.0).verdict.outcome == "holds"
    nothing_flown_that_was_not_proved(course, done)
    assert done.flown, done.reason


def test_a_lost_robot_that_does_not_acknowledge_ends_the_flight_of_all(ready):
    def at_work(course, link):
        def lost():
            if course.began and not link.faults.deaf:
                link.faults.deaf["two"] = link.faults.unseen["two"] = course.began + 0.5
            return ()

        course.happenings.news = lost

    _, done, _ = fly(ready, then=at_work, faults=Faults())
    assert not done.flown
    assert done.reason == "two does not acknowledge that it lands."
    assert done.unsafe == ("two",)


def test_a_robot_outside_its_tube_ends_the_flight_of_all(ready):
    def at_work(course, link):
        def pushed():
            if course.began and not link.faults.pushed:
                link.faults.pushed["one"] = (course.began + 0.5, 0.2)
            return ()

        course.happenings.news = pushed

    _, done, _ = fly(ready, NewFormula(time=30.0, formula=BACK), then=at_work, faults=Faults())
    assert not done.flown
    assert "from its plan; the margin is" in done.reason


@pytest.mark.parametrize("time", [0.5, 1.1, 1.5, 6.0])
def test_ctrl_c_holds_and_lands_at_any_time(ready, time):
    def pressed(course, link):
        def news():
            if link.now() - course.began >= time:
                raise KeyboardInterrupt
            return ()

        course.happenings.news = news

    _, done, _ = fly(ready, NewFormula(time=1.0, formula=BACK), NewFormula(time=20.0, formula=BACK), then=pressed)
    assert done.reason == "interrupted"
    assert not done.flown
    assert done.unsafe == ()


def test_what_is_told_and_cannot_be_is_said_and_changes_nothing(ready):
    told = iter(
        [
            (),
            ("Not done: 'nonsense' is no event.", RobotLeaves(time=0, robot="three"), HoopMoves(time=0, region="nowhere", center=(0, 0, 1))),
            (RobotJoins(time=0, robot="three", agent=Agent(start=(0, 0, 1))), NewFormula(time=0, formula="F nowhere")),
        ]
    )  # fmt: skip
    course, done, _ = fly(ready, news=lambda: next(told, ()))
    assert done.flown, done.reason
    assert course.happened == []
    said = " ".join(sentences(done))
    for word in (
        "'nonsense' is no event",
        "three fails and lands: it is not in the air",
        "'nowhere' is not a region",
        "three joins: it is not among the robots that wait on the ground (there are none)",
    ):
        assert word in said


def test_whoever_told_an_event_hears_what_became_of_it(ready):
    """What is done, what cannot be, and what was to happen at a time that never came, since the flight was ended."""
    answers = []
    told = [
        Told(event, lambda *answer, event=event: answers.append((event, *answer)))
        for event in (
            NewFormula(time=30.0, formula=BACK),
            RobotLeaves(time=0, robot="three"),
            NewFormula(time=0, formula=BACK),
        )
    ]
    asked = iter([(), told])

    def at_work(course, link):
        def news():
            if link.now() - course.began >= 6.0:
                raise KeyboardInterrupt
            return next(asked, ())

        course.happenings.news = news

    course, _, _ = fly(ready, then=at_work)
    late, wrong, done = told
    (first, second, third) = answers
    assert first == (wrong.event, False, "three fails and lands: it is not in the air.")
    assert second[:2] == (done.event, True)
    assert f"{course.happened[0].time:.2f} s" in second[2]
    assert third == (late.event, False, TOO_LATE)


def test_a_solid_body_on_a_robot_ends_the_flight(ready):
    box = Obstacle.model_validate({"center": (-1.0, -0.4, 1.0), "size": (0.3, 0.3, 0.3)})
    _, done, _ = fly(ready, ObstacleAppears(time=0.1, name="box", obstacle=box))
    assert not done.flown
    assert "which needs" in done.reason


def test_an_action_after_a_robot_was_seen_last_and_before_it_was_missed_counts(tmp_path):
    """The world changed when the robot was seen last, and another one acted before anybody knew of that."""
    mission = load_mission("firefighting")
    places = {name: (*agent.start[:2], 0.0) for name, agent in mission.agents.items()}
    team, faults = CertifiedTeam(mission, seed=1), Faults()
    acts = float(team.present.actions["quad0"][0].time)

    def lost():
        if course.began and not faults.unseen:
            faults.unseen["quad1"] = course.began + acts - 0.1
        return ()

    before = [transfer.stage for transfer in to_starts(mission, team.present.team, places)]
    course = OnlineCourse(team, AtOnce(), places, Happenings((), lost))
    link = SimulatedLink(mission, places, conditions=flight.Conditions(noise=0.001), faults=faults)
    done = fly_live(link, before, grounds=dict.fromkeys(places, 0.0), onwards=course)
    assert done.flown, done.reason
    (left,) = course.happened
    assert left.time < acts < left.time + 0.2
    nothing_flown_that_was_not_proved(course, done)
    flown = flown_live(course, done, planned_cost=1.0)
    assert flown.words["quad0"].count(frozenset({"water", "carrying"})) == 1
    write_online(flown, ["flown"], tmp_path)
    judged = judge_flight(tmp_path, tmp_path / "flight.csv", max_speed=1.5, error=0.006, start=0.0)
    assert (flown.verdict.outcome, judged.verdict.outcome) == ("holds", "holds")


@pytest.fixture(scope="module")
def in_time():
    """A certified team that shares its time, and its way to its starts."""
    team = CertifiedTeam(
        parse_mission(PAIR.replace("formula: F left & F right", "team: joint, formula: F left & F right")), seed=1
    )
    return team, [transfer.stage for transfer in to_starts(team.mission, team.present.team, PLACES)]


def test_deadlines_that_come_in_flight_are_kept_though_computing_takes_time(in_time, tmp_path):
    """The first answer comes later than it was asked for, so that it is asked for anew, with more time."""
    deadlines = NewFormula(time=1.0, formula="F[0,40] G[0,2] (left & right) & F[0,60] (left & F[0,40] (right & !left))")
    course, done, asked = fly(in_time, deadlines, computer=Asked(late={next_piece: [5.0, 1.0]}))
    assert done.flown, done.reason
    first, second = (q for work, q in zip(asked.kinds, asked.questions, strict=True) if work is next_piece)
    assert first.latest < second.latest
    assert all(question.mission.timed_parts for question in (first, second))
    nothing_flown_that_was_not_proved(course, done)
    flown = flown_live(course, done, planned_cost=1.0)
    assert flown.certified
    assert flown.require().satisfied_at is not None
    write_online(flown, ["flown"], tmp_path)
    judged = judge_flight(tmp_path, tmp_path / "flight.csv", max_speed=1.5, error=0.006, start=0.0)
    assert judged.verdict.outcome == "holds", judged.verdict.sentence


def test_a_deadline_that_cannot_be_met_is_said_at_once_and_the_team_lands(in_time):
    course, done, _ = fly(in_time, NewFormula(time=1.0, formula="F[0,0.5] (left & right)"))
    assert done.flown, done.reason
    said = [event for event in done.record.events if "can no longer be met" in event.sentence]
    assert said[0].sentence.endswith("`F[0,0.5] (left & right)` can no longer be met.")
    assert said[0].time - course.began < 1.1
    assert list(done.record.starts)[-1] == "landing"
