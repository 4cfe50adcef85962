"""What is said of missions that cannot be flown as asked, and what is tried before: faster flights, other words, the other reading."""

from __future__ import annotations

import re

import pytest

import ltlplan
import verify
from ltlplan.pipeline import attempted, candidates, certified_team
from ltlplan.replanning.cuts import MAX_ROUNDS, Candidate, Flight
from ltlplan.replanning.refusal import Refusal
from ltlplan.search.explanations.held_letters import held_letter
from ltlplan.search.orders.planned_words import systems_of_words
from verify.data import Infeasible, NotCertified, Unsatisfiable, parse_mission

HEAD = "format: 1\nname: asked\nvehicle: crazyflie-2.1\n"

SITES = (
    HEAD
    + """spec: {formula: "F s0 & F s1 & F s2 & F s3"}
regions:
  s0: {center: [-3, 3, 1], radii: [0.3, 0.3, 0.3]}
  s1: {center: [3, 3, 1], radii: [0.3, 0.3, 0.3]}
  s2: {center: [3, -3, 1], radii: [0.3, 0.3, 0.3]}
  s3: {center: [-3, -3, 1], radii: [0.3, 0.3, 0.3]}
agents: {a: {start: [-2.5, 0, 1]}, b: {start: [0, -0.5, 1]}}
limits: {speed: 0.8, endurance: 32}
workspace: {min: [-4, -4, 0.2], max: [4, 4, 2]}
"""
)
NEARER = SITES.replace("a: {start: [-2.5, 0, 1]}", "a: {start: [-1.2, 0, 1]}")

# Schillinger et al. 2018, second mission, as two robots read it by themselves
DELIVERIES = (
    HEAD
    + """spec:
  formula: >-
    F(p & carry & (carry U (d10 & !carry))) & F(p & carry & (carry U (d7 & !carry))) & F(p & carry & (carry U (d5 & !carry)))
    & G(carry -> !public)
  trace: finite
  team: own
regions:
  p: {center: [0, 3, 1], radii: [0.3, 0.3, 0.3]}
  d10: {center: [3, 3, 1], radii: [0.3, 0.3, 0.3]}
  d7: {center: [3, -3, 1], radii: [0.3, 0.3, 0.3]}
  d5: {center: [-3, -3, 1], radii: [0.3, 0.3, 0.3]}
  public: {center: [0, 0, 1], radii: [0.8, 0.8, 0.8]}
robot:
  initial: free_hands
  states: {free_hands: [], c: [carry]}
  actions: [{from: free_hands, to: c, at: p}, {from: c, to: free_hands, at: d10}, {from: c, to: free_hands, at: d7}, {from: c, to: free_hands, at: d5}]
agents: {r0: {start: [-2.5, -1.5, 1]}, r1: {start: [-1.5, -1.5, 1]}}
limits: {speed: 1.0}
workspace: {min: [-4, -4, 0.2], max: [4, 4, 2]}
"""
)
WATCHED = (
    DELIVERIES.replace("robot:\n  initial", "robots:\n  watcher: {initial: idle, states: {idle: []}}\n  carrier:\n    initial")
    .replace("\n  states:", "\n    states:")
    .replace("\n  actions:", "\n    actions:")
    .replace("1.5, 1]}, r1: {", "1.5, 1], robot: carrier}, r1: {robot: watcher, ")
)

MOAT = (
    HEAD
    + """spec: {formula: "F goal & G !moat"}
regions: {goal: {center: [1, 0, 1], radii: [0.2, 0.2, 0.2]}, moat: {center: [1, 0, 1], radii: [0.6, 0.6, 0.6]}}
agents: {q: {start: [-1, 0, 1]}}
workspace: {min: [-2, -2, 0.2], max: [2, 2, 2]}
"""
)


def test_a_region_inside_a_forbidden_one_cannot_be_reached() -> None:
    with pytest.raises(
        Unsatisfiable, match="goal lies inside moat: goal cannot be reached, or left again, without entering moat"
    ):
        ltlplan.plan(parse_mission(MOAT))


def test_a_faster_plan_is_tried_where_endurance_is_short() -> None:
    made = ltlplan.plan(parse_mission(SITES), pace="nominal")
    assert made.mission.planner.speed == 0.45
    assert any("instead of 0.45 m/s" in note for note in made.notes)
    assert max(robot.times[-1] for robot in made.robots.values()) <= 21.0


@pytest.mark.slow
def test_endurance_counts_flights_at_their_pace() -> None:
    """To three sites a would fly 37 s at nominal speed, 21 s at the limit and 30 s at seven tenths of that."""
    enough, faster = parse_mission(NEARER.replace("endurance: 32", "endurance: 43")), parse_mission(SITES)
    without = parse_mission(NEARER.replace(", endurance: 32", ""))
    assert ltlplan.plan(enough).words == ltlplan.plan(without).words
    assert ltlplan.plan(enough, pace="nominal").words != ltlplan.plan(without).words
    assert not any("Planned at" in note for made in (ltlplan.plan(enough), ltlplan.plan(faster)) for note in made.notes)
    slow = ltlplan.plan(faster, pace=0.3)
    assert slow.mission.planner.pace == 0.3
    assert any("Planned at pace 1 instead of 0.3" in note for note in slow.notes)
    timed = ltlplan.plan(parse_mission(SITES + "planner: {cost: {time: 1}}\n"), pace=0.3)
    expected = [robot.times[-1] * 0.45 / (0.3 * 0.8) for robot in timed.robots.values() if not robot.still]
    assert timed.cost == pytest.approx(sum(expected), rel=1e-3), "its costs are those of its own mission"


@pytest.mark.slow
def test_a_flight_whose_nominal_times_outlast_the_endurance_is_certified_at_its_pace() -> None:
    made = ltlplan.plan(parse_mission(NEARER.replace("endurance: 32", "endurance: 43")))
    assert max(robot.times[-1] for robot in made.robots.values()) > 32.0
    found = certified_team(made)
    assert (found.certificate.holds, found.rounds) == (True, 1)
    assert found.plan.words == made.words
    assert not any("as fast as the limits allow" in note for note in found.plan.notes)


ROUND = (
    HEAD
    + """spec: {formula: F (a & F (d & F (b & F a)))}
regions:
  a: {center: [1.5, 1.2, 1.0], radii: [0.3, 0.3, 0.3]}
  b: {center: [-1.5, 1.2, 1.0], radii: [0.3, 0.3, 0.3]}
  d: {center: [-1.5, -1.4, 1.2], radii: [0.3, 0.3, 0.3]}
agents: {q: {start: [0, 0, 1]}, r: {start: [1, -1, 1]}}
limits: {endurance: 17.0}
workspace: {min: [-3, -3, 0.2], max: [3, 3, 2.2]}
"""
)


@pytest.mark.slow
@pytest.mark.parametrize("pace", ["nominal", 0.7, 1.0])
def test_an_endurance_that_nominal_flights_keep_is_kept_at_every_pace(pace: float | str) -> None:
    found = certified_team(ltlplan.plan(parse_mission(ROUND), pace=pace))
    assert found.certificate.holds
    assert max(flight.duration for flight in found.team.values()) <= 6.0


def test_nominal_times_are_tried_where_no_faster_flight_is_certified() -> None:
    alone = ROUND.replace(", r: {start: [1, -1, 1]}", "").replace("limits: {endurance: 17.0}", "planner: {cost: {time: 1}}")
    made = ltlplan.plan(parse_mission(alone.replace("F (a & F (d & F (b & F a)))", "F a")))
    found = attempted(spent := Candidate(made, rounds=MAX_ROUNDS))
    assert isinstance(found, Flight)
    tight = made.changed(mission=made.mission.changed(margin=0.31))
    refused = Flight(found.plan, found.team, verify.judge(tight, found.team))
    first, nominal = candidates(spent, [refused])
    assert (first.pace, nominal.pace) == (None, "nominal")
    assert nominal.plan.mission == made.mission
    assert nominal.plan.lower_bound == made.lower_bound
    assert any("the plan's own times are flown" in note for note in nominal.plan.notes)


@pytest.mark.slow
def test_words_that_take_longer_than_planning_counted_on_are_shared_further() -> None:
    mission = parse_mission(NEARER.replace("endurance: 32", "endurance: 31"))
    made = ltlplan.plan(mission, pace=1.0)
    found = certified_team(made)
    assert found.certificate.holds
    assert found.plan.words != made.words
    assert found.plan.mission == made.mission
    assert max(flight.duration for flight in found.team.values()) <= 20.0


def test_the_least_time_is_said_where_no_speed_keeps_the_endurance() -> None:
    with pytest.raises(Infeasible, match=r"Faster flights.*were tried: the least time .* is \d+\.\d+ s, against 11 s"):
        ltlplan.plan(parse_mission(SITES.replace("endurance: 32", "endurance: 22")))


@pytest.mark.slow
def test_flights_within_a_short_endurance_are_certified_as_fast_as_limits_allow() -> None:
    run = ltlplan.run(parse_mission(SITES), pace="nominal")
    assert run.certificate.holds
    assert max(flight.duration for flight in run.team.values()) <= 21.0


@pytest.mark.slow
def test_a_refusal_under_own_names_the_letter_and_the_reading_that_has_a_plan() -> None:
    said = list[str]()
    with pytest.raises(NotCertified, match=r"r\d's letter \{.*\} breaks `F .*Under `team: joint`.*a plan exists") as caught:
        ltlplan.run(parse_mission(WATCHED), progress=lambda sentence, _: said.append(sentence))
    assert "Whatever robots wait for" in str(caught.value)
    assert not any("round 2" in sentence for sentence in said), "no other times are tried of words that no times mend"


@pytest.mark.slow
def test_a_robot_that_carries_rests_out_of_the_way_of_one_that_brings_all_parcels() -> None:
    """Resting with free hands would break the formula whenever it is read; words planned at first let it."""
    run = ltlplan.run(parse_mission(DELIVERIES))
    assert run.certificate.holds
    assert {claim.name for claim in run.certificate.claims} >= {"precedences", "ordered"}
    assert all("carry" in robot.word.letters[-1] or len(robot.visits) > 1 for robot in run.plan.robots.values())


@pytest.mark.slow
def test_the_letter_that_breaks_words_of_six_robots_is_found_where_most_of_them_rest() -> None:
    resting = "".join(f", r{i}: {{start: [{i - 2.5}, -1.5, 1]}}" for i in range(2, 6))
    made = ltlplan.plan(
        parse_mission(DELIVERIES.replace("r1: {start: [-1.5, -1.5, 1]}", "r1: {start: [-1.5, -1.5, 1]}" + resting))
    )
    systems = systems_of_words(made)
    assert systems is not None
    (said,) = held_letter(made.mission, systems, made.mission.formula, lambda _: False)
    assert re.match(r"A single interleaving satisfies it .* breaks `F ", said)


@pytest.mark.slow
def test_costs_weigh_the_flown_time_once_however_many_rounds_it_takes() -> None:
    """A plan whose flight was refused is priced as it was made when it is refined again."""
    text = SITES.replace(", endurance: 32", "") + "planner: {cost: {time: 1}, objective: longest, pace: nominal}\n"
    made = ltlplan.plan(parse_mission(text))
    found = attempted(Candidate(made))
    assert isinstance(found, Flight)
    assert found.plan.cost == pytest.approx(max(flight.duration for flight in found.team.values()))
    again = Refusal.of(Candidate(made), found).plan
    assert again.cost == pytest.approx(made.cost)
    assert {name: robot.cost for name, robot in again.robots.items()} == pytest.approx(
        {name: robot.cost for name, robot in made.robots.items()}
    )
