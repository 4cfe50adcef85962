"""What a team flies next, asked in parts: what is left, a certified flight of it, and a judgement with all that was flown."""

import copy
import pickle
from dataclasses import replace
from fractions import Fraction

import pytest

from flight.link.record import Record
from flight.link.simulated import SimulatedLink
from ltlplan.online.live.segment_monitor import watch_on
from ltlplan.online.segments.braking import REACTION, come_to_rest
from ltlplan.online.segments.certified_team import CertifiedTeam
from ltlplan.online.segments.segment_planning import find_piece, require_proved, with_endurance_left
from verify.data import NotCertified, parse_mission
from verify.data.events import NewFormula

FLIGHT = """
format: 1
name: flight
spec: {formula: F a}
regions: {a: {center: [0.8, 0, 1], radii: [0.2, 0.2, 0.2]}, b: {center: [0.2, 0.9, 1], radii: [0.2, 0.2, 0.2]}}
agents: {quad0: {start: [-0.3, 0, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-2, -2, 0.2], max: [2, 2, 2]}
planner: {speed: 0.8, pace: nominal}
"""


@pytest.fixture(scope="module")
def at_start():
    return CertifiedTeam(parse_mission(FLIGHT), seed=1)


@pytest.fixture
def team(at_start):
    """Half a second into its flight, just before it is asked for something else."""
    team = copy.deepcopy(at_start)
    team.step(0.5, {"quad0": tuple(team.present.team["quad0"].evaluate(0.5)[:3])})
    return team


def resting(team, formula="F b"):
    """Ask for something else, and go on to where it has come to rest."""
    team.close_piece(NewFormula(time=0.5, formula=formula), Fraction(1, 2))
    team.take_stop(come_to_rest(team.stop()))
    for pilot in team.pilots.values():
        team.root(pilot, float(team.present.end))
    return team


def test_questions_and_answers_are_the_same_when_they_were_sent_to_another_process(team):
    team.close_piece(NewFormula(time=0.5, formula="F b"), Fraction(1, 2))
    stop = team.stop()
    here, there = come_to_rest(stop), pickle.loads(pickle.dumps(come_to_rest(pickle.loads(pickle.dumps(stop)))))
    assert not here.refused
    assert here.team["quad0"].digest() == there.team["quad0"].digest()
    team.take_stop(there)
    left = team.what_is_left(Fraction(5))
    found, back = find_piece(left), pickle.loads(pickle.dumps(find_piece(pickle.loads(pickle.dumps(left)))))
    assert found.certified.certificate.digest() == back.certified.certificate.digest()
    require_proved(pickle.loads(pickle.dumps(team.with_next(left, back, team.present.end))))


def test_robots_fly_on_until_a_stop_was_found(team):
    before = team.present.team["quad0"]
    team.close_piece(NewFormula(time=0.5, formula="F b"), Fraction(1, 2))
    assert team.present.team["quad0"].digest() == before.digest()
    assert team.present.since == Fraction(1, 2)
    assert team.holding.startswith("Waiting")
    for reaction in (REACTION, 0.6):
        stop = come_to_rest(replace(team.stop(), reaction=reaction))
        assert not stop.refused
        slowed = stop.team["quad0"]
        assert 0.5 + reaction <= slowed.knots[-2] + 1e-6
        assert slowed.evaluate(0.5 + reaction) == pytest.approx(before.evaluate(0.5 + reaction), abs=1e-6)


def test_what_is_flown_is_watched_though_its_words_are_not_proved(team):
    team.close_piece(NewFormula(time=0.5, formula="F b"), Fraction(1, 2))
    link, record = SimulatedLink(team.mission, {"quad0": (-0.3, 0.0, 1.0)}), Record()
    watch = watch_on(link, record, team.present, began=link.now() - 0.5, without=())
    for _ in range(30):
        link.sleep(0.02)
        look = watch.look()
    assert look.stage == "flight"
    assert look.errors["quad0"] > team.mission.margin, "it stands, and should fly"
    assert "from its plan; the margin is" in watch.alarm()
    assert watch.lost() is None


def test_a_piece_is_flown_only_from_when_it_was_judged_to_begin(team):
    resting(team)
    left = team.what_is_left(Fraction(5))
    answer = find_piece(left)
    with pytest.raises(NotCertified, match=r"to begin by 5\.00 s, not at 6\.00 s"):
        team.with_next(left, answer, Fraction(6))
    flight = team.with_next(left, answer, Fraction(3))
    require_proved(flight)
    team.take_over(flight.last, answer)
    assert team.present.start == 3
    assert len(team.all_pieces) == 3
    assert team.holding is None


def test_a_certified_piece_that_does_not_complete_what_was_flown_is_refused(team):
    resting(team, "F b & (!a U b)")
    left = team.what_is_left(Fraction(5))
    answer = find_piece(left)
    asked = NewFormula(time=0.5, formula="a & F b").apply(team.mission)
    with pytest.raises(NotCertified, match="with what was flown before"):
        require_proved(replace(team.with_next(left, answer, Fraction(3)), mission=asked))


def test_endurance_is_counted_as_if_a_piece_began_as_late_as_was_said():
    mission = parse_mission(FLIGHT + "limits: {endurance: 60}\n")
    assert with_endurance_left(mission, Fraction(10)).limits_of("quad0").endurance == 50
    without = parse_mission(FLIGHT)
    before = without.limits_of("quad0").endurance
    assert with_endurance_left(without, Fraction(10)).limits_of("quad0").endurance == (None if before is None else before - 10)
