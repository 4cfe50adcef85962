"""Online flights whose formula is bounded in seconds: what is left is planned in time, or said to be too late."""

from __future__ import annotations

import copy
from dataclasses import replace
from fractions import Fraction

import pytest

from ltlplan.online.segments.certified_team import CertifiedTeam
from ltlplan.online.segments.segment_planning import find_piece
from ltlplan.online.simulated_online_flight import fly_online
from tests.helpers.few import few_of
from tests.helpers.missions.timed_rooms import room
from verify.data import BadInput, Mission
from verify.data.events import HoopMoves, NewFormula, RobotLeaves, WorldEvent
from verify.flight_segments import judge_pieces

SOMETHING = HoopMoves(time=2.0, region="pit", center=(0.5, 1.4, 1.0))
"""A change that concerns nobody's way, for which all come to rest."""


def flown(mission: Mission, *events: WorldEvent):
    return fly_online(mission, certified=True, events=events, noise=0.001, max_seconds=60)


@few_of(
    1,
    ("formula", "at"),
    [
        ("F[0,4.5] dock & F[0,9] G[0,2] shelf", 2.0),
        ("F[0,12] G[0,5] dock", 5.0),
        ("G[0,20] (dock -> F[0,6] shelf) & F[0,20] dock", 3.5),
        ("G[0,8] !pit & F[0,10] pit", 0.5),
        ("F[8,9] dock", 2.0),
    ],
)
def test_bounds_are_kept_through_a_change_of_the_world(formula: str, at: float) -> None:
    flight = flown(room(formula), replace(SOMETHING, time=at))
    assert flight.certified
    assert flight.verdict
    assert len(flight.certificates) == 2
    assert flight.mission.timed_parts
    proved = judge_pieces(flight.mission, flight.pieces)
    assert [verdict.outcome for verdict in proved] == ["holds"] * len(proved)
    timing = [verdict for verdict in proved if verdict.claim == "timing"]
    assert len(timing) == len(flight.mission.timed_parts)


def test_a_formula_that_comes_in_flight_counts_from_the_flights_start() -> None:
    flight = flown(room("F dock"), NewFormula(time=2.0, formula="F[0,30] dock & F[0,12] G[0,2] pit"))
    assert flight.certified
    assert flight.verdict
    assert "`F[0,12] G[0,2] pit` holds" in flight.verdict.sentence


def test_a_deadline_that_is_over_is_said_at_once() -> None:
    flight = flown(room("F[0,12] dock"), NewFormula(time=3.0, formula="F[0,2] pit"))
    assert not flight.verdict
    said = next(event for event in flight.log.events if "can no longer be met" in event.sentence)
    assert said.sentence == "At 3.00 s `F[0,2] pit` can no longer be met."
    assert said.time == 3.0


def test_the_point_of_no_return_is_said_before_the_deadline() -> None:
    flight = flown(room("F[0,2.2] dock"), replace(SOMETHING, time=0.5, region="dock", center=(0.5, 1.5, 1.0)))
    assert not flight.verdict
    held = next(event for event in flight.log.events if "Point of no return" in event.sentence)
    over = next(event for event in flight.log.events if "comes in time any more" in event.sentence)
    assert held.time < over.time < 2.2
    assert "Times and bounds count from" in held.sentence


@pytest.mark.slow
def test_who_stays_does_what_is_due_when_another_one_fails() -> None:
    mission = room(
        "F[0,20] dock & F[0,20] pit & F[0,25] shelf", more=", team: joint", agents="  quad1: {start: [1.0, 0.8, 1.0]}"
    )
    flight = flown(mission, RobotLeaves(time=0.6, robot="quad1"))
    assert flight.certified
    assert flight.verdict


@pytest.mark.slow
def test_a_piece_that_begins_too_late_for_its_deadline_is_refused_by_the_whole_flight() -> None:
    """What is left was planned to begin now; begun later it is a flight that misses the deadline."""
    team = CertifiedTeam(room("F[0,7] shelf"), seed=1)
    team = copy.deepcopy(team)
    assert team.present is not None
    team.step(0.5, {"quad0": tuple(team.present.team["quad0"].evaluate(0.5)[:3])})
    team.change(SOMETHING, 0.5)
    rest = float(team.present.end)
    for pilot in team.pilots.values():
        team.root(pilot, rest)
    since = Fraction(round(rest / 0.02) + 1, 50)
    team.observe(float(since), {"quad0": tuple(team.present.team["quad0"].evaluate(rest)[:3])})
    left = team.what_is_left(since)
    found = find_piece(left)
    in_time, late = (team.with_next(replace(left, latest=Fraction(60)), found, since + more).pieces for more in (0, 7))
    whole = team.mission
    assert [v.outcome for v in judge_pieces(whole, in_time) if v.claim == "timing"] == ["holds"]
    assert [v.outcome for v in judge_pieces(whole, late) if v.claim == "timing"] == ["fails"]


def test_sampled_paths_plan_no_times() -> None:
    with pytest.raises(BadInput, match=r"`F\[0,9\] dock` is bounded in seconds, .* --certified"):
        fly_online(room("F[0,9] dock"))
    with pytest.raises(BadInput, match=r"`F\[0,9\] pit` is bounded in seconds"):
        fly_online(room("F dock"), events=[NewFormula(time=2.0, formula="F[0,9] pit")])
