"""Tasks that change hands in flight: only in the decomposition set of the automaton's present states, and the formula holds."""

import math
from dataclasses import replace

import pytest

from ltlplan.mtac.agent_moves import RobotTask
from ltlplan.online.simulated_online_flight import fly_online
from ltlplan.online_mtac import online_team
from ltlplan.online_mtac.task_switching import Handover, may_change
from tests.ltlplan.mtac.test_offline import small
from tests.ltlplan.online_mtac.test_online_team import Flight
from verify import check_word
from verify.data.events import HoopMoves

PLACES = {"a": (-2, 0, 1), "b": (1.5, 0, 1), "c": (-2, 1.5, 1), "d": (1.5, 1, 1)}
TWO = [(-1.4, 0, 1), (1.5, 2.0, 1)]
FIRST_A = "F d & F b & (!b U a)"


def flown(flight):
    """The letters in the order in which they were shown: one of the words that the team's flight stands for."""
    first = list(flight.team.first_letters.values())
    return first + [letter for _, events in flight.team.shown for letter in events.values()]


def done_by(team, robot, *regions):
    """Return tasks by which one robot does all of it, whoever would be cheaper."""
    tasks = {name: RobotTask(pilot.where) for name, pilot in team.pilots.items()}
    for region in regions:
        move = next(move for move in team.world.moves(tasks[robot].end) if move.visit.region == region)
        tasks[robot] = replace(tasks[robot], moves=(*tasks[robot].moves, move), leaves=False)
    return tasks


def given_to(flight, robot, *regions):
    for name, task in done_by(flight.team, robot, *regions).items():
        flight.team.pilots[name].take(task, flight.team.plan_for(flight.team.pilots[name], task), flight.team.rng)
    flight.team.steps = 1  # the switch condition was asked for at take-off; the next time robots are under way


@pytest.fixture
def all_begun_by_quad0(monkeypatch):
    monkeypatch.setattr(online_team, "share_out", lambda team, _: [(0.0, (None, done_by(team, "quad0", "a", "b", "d")))])


def handed_over(flight):
    """When the one hand-over of a flight was, s; and that its giver was well under way."""
    (said,) = flight.said
    assert "quad1 takes b over from quad0" in said
    assert math.dist(flight.positions["quad0"], flight.team.mission.agents["quad0"].start) > 0.1
    return float(said.split()[1])


@pytest.fixture
def asked_at_three_seconds(monkeypatch):
    monkeypatch.setattr(online_team, "SWITCH_STEPS", 150)


@pytest.mark.usefixtures("all_begun_by_quad0")
def test_a_part_changes_hands_in_flight_once_what_binds_it_is_done():
    flight = Flight(small(FIRST_A, regions=PLACES, agents=TWO))
    assert [move.visit.region for move in flight.team.pilots["quad0"].moves] == ["a", "b", "d"]
    assert flight.fly(60) is not None
    (said,) = flight.said
    assert "quad1 takes b, d over from quad0" in said
    at = float(said.split()[1])
    # a robot that is under way hands over; it has been at `a` by then and not before
    assert frozenset({"a"}) in [letter for time, events in flight.team.shown if time < at for letter in events.values()]
    assert at > 1.0
    assert flight.words["quad0"] == [frozenset(), frozenset({"a"}), frozenset()]
    assert frozenset({"b"}) in flight.words["quad1"]
    assert flight.team.belief.accepts()
    assert check_word(FIRST_A, flown(flight))
    assert flight.nearest >= flight.team.mission.separation
    assert flight.jump < 0.03


@pytest.mark.usefixtures("all_begun_by_quad0")
@pytest.mark.slow
def test_the_checker_holds_a_flight_with_a_hand_over():
    flight = fly_online(small(FIRST_A, regions=PLACES, agents=TWO), seed=1)
    assert any("takes b, d over from quad0" in event.sentence for event in flight.log.events)
    assert flight.verdict.outcome == "holds"
    assert flight.require() is flight


@pytest.mark.usefixtures("all_begun_by_quad0")
@pytest.mark.slow
def test_the_set_is_that_of_the_present_states():
    flight = Flight(small(FIRST_A, regions=PLACES, agents=TWO))
    online_team, handover = flight.team, Handover("quad0", "quad1", 0)
    # b and d after a: while a is not done, the other robot might come to b first
    later = Handover("quad0", "quad1", 1)
    assert not may_change(online_team.world, online_team.reader, online_team.belief, online_team.pilots, later)
    while len(online_team.pilots["quad0"].moves) > 2:
        flight.fly(0.1)
    now = online_team.belief.settled
    assert may_change(online_team.world, online_team.reader, online_team.belief, online_team.pilots, handover)
    assert online_team.reader.in_decomposition_set(now, begun=now)
    # seen from take-off nothing could be handed over here, because `a` itself would be part of what may come later
    assert not online_team.reader.in_decomposition_set(now)


@pytest.mark.slow
@pytest.mark.usefixtures("asked_at_three_seconds")
def test_a_robot_whose_own_weights_make_it_dear_hands_over_in_flight():
    mission = small("F b", regions=PLACES, agents=[(-1.4, 0, 1), (1.5, -2.4, 1)])
    # they are 2.4 to 2.9 m away; each metre of quad0 costs five times as much
    dear = mission.agents["quad0"].model_copy(update={"cost": {"length": 5.0}})
    mission = mission.model_copy(update={"agents": {**mission.agents, "quad0": dear}})
    flight = Flight(mission)
    given_to(flight, "quad0", "b")
    assert flight.fly(40) is not None
    assert handed_over(flight) >= 3.0
    assert not any(frozenset({"b"}) in events.values() for time, events in flight.team.shown if time < handed_over(flight))
    assert flight.words["quad0"] == [frozenset()]
    assert frozenset({"b"}) in flight.words["quad1"]
    assert check_word("F b", flown(flight))


def test_equal_costs_change_nothing():
    flight = Flight(small("F b", regions=PLACES, agents=[(-1.4, 0, 1), (1.5, -2.9, 1)]))
    given_to(flight, "quad0", "b")
    assert flight.fly(40) is not None
    assert flight.said == []
    assert frozenset({"b"}) in flight.words["quad0"]


def asked_throughout(flight, seconds):
    """Fly on; return, several times a second, what quad0 has left and which tasks of it might go to quad1."""
    online_team, answers = flight.team, []
    for _ in range(int(seconds / 0.5)):
        flight.fly(0.5)
        moves = online_team.pilots["quad0"].moves
        allowed = [
            kept
            for kept in range(len(moves))
            if may_change(
                online_team.world, online_team.reader, online_team.belief, online_team.pilots, Handover("quad0", "quad1", kept)
            )
        ]
        answers.append(("".join(move.visit.region for move in moves), allowed))
    return answers


@pytest.mark.slow
def test_in_a_state_outside_the_set_nothing_changes_hands_however_cheap():
    # whoever goes to b must not come before anybody's visit of c: no part is anybody else's, from the first state on
    flight = Flight(small("F b & G(b -> G !c)", regions=PLACES, agents=[(-1.4, 0.6, 1), (1.5, -0.6, 1)]))
    given_to(flight, "quad0", "b")
    answers = asked_throughout(flight, 10.0)
    assert ("b", []) in answers
    assert not any(allowed for _, allowed in answers)
    assert flight.said == []
    assert frozenset({"b"}) in flight.words["quad0"]
    assert flight.words["quad1"] == [frozenset()]
    assert flight.team.belief.accepts()
    assert check_word("F b & G(b -> G !c)", flown(flight))


@pytest.mark.slow
@pytest.mark.usefixtures("asked_at_three_seconds")
def test_without_what_binds_it_the_same_part_changes_hands():
    flight = Flight(small("F b", regions=PLACES, agents=[(-1.4, 0.6, 1), (1.5, -0.6, 1)]))
    given_to(flight, "quad0", "b")
    assert flight.fly(30) is not None
    assert handed_over(flight) >= 3.0
    assert flight.words["quad0"] == [frozenset()]


@pytest.mark.slow
@pytest.mark.usefixtures("asked_at_three_seconds")
def test_a_robot_may_keep_the_first_visits_of_what_it_gives_away():
    flight = Flight(small("F a & F b", regions=PLACES, agents=[(-0.6, 0, 1), TWO[1]]))
    given_to(flight, "quad0", "a", "b")
    assert flight.fly(40) is not None
    assert handed_over(flight) >= 3.0
    assert flight.words == {"quad0": [frozenset(), frozenset({"a"})], "quad1": [frozenset(), frozenset({"b"})]}
    assert check_word("F a & F b", flown(flight))


@pytest.mark.slow
def test_a_region_that_moves_away_is_shared_again_and_another_robot_flies_there():
    mission = small("F b & F c", regions=PLACES, agents=[(0.3, -0.5, 1), (-1.0, -1.5, 1), (2.5, 2.0, 1)])
    moves = HoopMoves(time=1.5, region="b", center=(-1.5, -1.5, 1.0))
    assert Flight(mission).team.pilots["quad0"].moves[0].visit.region == "b"
    flight = Flight(mission, events=[moves])
    assert flight.fly(60) is not None
    assert frozenset({"b"}) not in flight.words["quad0"]
    assert frozenset({"b"}) in flight.words["quad1"]
    assert check_word("F b & F c", flown(flight))
