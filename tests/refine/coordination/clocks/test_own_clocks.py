"""Robots on paths that stay as they are, each on a clock of its own: apart at all times, and hardly later than if alone."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import strategies as st

import ltlplan
import verify
from refine import refine
from refine.coordination import team_flights
from refine.coordination.avoidance.conflict_resolution import Together, arrival, departures_of
from refine.coordination.clocks.earliest_times import Line, Times
from refine.coordination.clocks.own_clocks import on_own_clocks
from refine.coordination.clocks.passing_orders import Orders, Stuck, Zone, passing_orders, zones_of
from refine.coordination.departures import DepartureConflict
from refine.coordination.spacing import spacing_for
from refine.feedback import feedback_of
from refine.single_robot.flight import robot_flight
from refine.single_robot.task import Pace, Problem, RefinementOptions, RobotFlight, unheard
from tests.benchmarks.scale import swaps
from tests.helpers.few import few_of, given_few
from tests.helpers.missions.counted_halls import abreast, gathering, hall, longest_alone

_SHOW = """
format: 1
name: show
regions:
  ring: {{center: [0, 0, 1.9], cylinder: {{radius: 2.4, height: 0.6}}}}
  stage: {{center: [0, 0, 0.7], size: [5.4, 3.0, 0.6]}}
agents: {{{agents}}}
vehicle: crazyflie-2.1
limits: {{speed: 1.5}}
workspace: {{min: [-3, -3, 0.2], max: [3, 3, 3]}}
spec: {{formula: "F(all(ring) & F all(stage))", team: joint}}
"""


def crossing(rng: np.random.Generator, robots: int) -> list[Line]:
    """Straight paths at even speeds across a square, departing from places apart."""
    found: list[Line] = []
    for number in range(robots):
        angle = 2.0 * np.pi * number / robots + rng.uniform(-0.2, 0.2)
        begin = 2.0 * np.array([np.cos(angle), np.sin(angle), 0.0])
        end = -begin + rng.uniform(-0.6, 0.6, 3) * np.array([1.0, 1.0, 0.0])
        found.append(line(4.0, begin, end))
    return found


def line(lasts: float, begin: np.ndarray, end: np.ndarray) -> Line:
    """A straight path at even speed, in 80 cells and its rests."""
    even = np.linspace(0.0, 1.0, 81)
    borders = np.concatenate([[0.0], even, [1.0]])
    middles = 0.5 * (borders[1:] + borders[:-1])
    reach = np.append(np.insert(np.full(80, 0.55 * np.linalg.norm(end - begin) / 80), 0, 0.0), 0.0)
    return Line(lasts * borders, begin + (end - begin) * middles[:, None], reach, 0.0)


def apart(lines: list[Line], times: Times) -> float:
    """Return the least distance at dense times, by what the robots do then."""
    until = max(float(each[-1]) for each in times.times)
    dense = np.linspace(0.0, until, 4000)
    where = [
        (begin := each.places[0]) + (each.places[-1] - begin) * (np.interp(dense, when, each.times) / each.times[-1])[:, None]
        for each, when in zip(lines, times.times, strict=True)
    ]
    return min(float(np.linalg.norm(a - b, axis=1).min()) for a, b in itertools.combinations(where, 2))


def best_by_trying_all(lines: list[Line], zones: list[Zone]) -> float:
    """Return the soonest last arrival over all choices of who passes first; infinite where there is none."""
    best = np.inf
    for sides in itertools.product((0, 1), repeat=len(zones)):
        chosen = [zone.sides[side] for zone, side in zip(zones, sides, strict=True)]
        times = Times(lines)
        if all(side is not None for side in chosen) and times.add([side for side in chosen if side is not None]):
            best = min(best, times.arrivals[0])
    return best


@given_few(10, 80, st.integers(0, 2**32 - 1), st.integers(2, 4))
def test_whoever_passes_first_robots_are_apart_and_nearly_as_soon_as_by_trying_all(seed: int, robots: int) -> None:
    lines = crossing(np.random.default_rng(seed), robots)
    zones = zones_of(lines, 0.4)
    best, found = best_by_trying_all(lines, zones), passing_orders(lines, zones, [])
    if not isinstance(found, Orders):
        assert best == np.inf
        return
    times = Times(lines)
    assert times.add(found.differences)
    assert apart(lines, times) >= 0.4
    assert best - 1e-6 <= times.arrivals[0] <= 1.4 * best


def test_robots_that_stand_in_each_others_way_for_good_are_named() -> None:
    """Each ends where the other one starts."""
    here, there = np.zeros(3), np.array([2.0, 0.0, 0.0])
    lines = [line(2.0, here, there), line(2.0, there, here)]
    assert passing_orders(lines, zones_of(lines, 0.3), []) == Stuck(((0, 1),))


@few_of(1, "pace", ["nominal", "0.7"])
def test_robots_that_are_counted_wait_only_for_what_is_in_their_way(pace: str) -> None:
    mission = hall(4, "F(count(a) >= 2) & F(count(b) >= 1) & G(count(b) <= 1) & F all(home)", pace)
    plan = ltlplan.plan(mission)
    crowd = [name for name, robot in plan.robots.items() if robot.visits[0].region == "a"]
    assert {(meeting.first[0], meeting.then[0]) for meeting in plan.meetings} == set(itertools.permutations(crowd, 2))
    team = refine(plan)
    assert [claim.sentence for claim in verify.judge(plan, team, largest=False).claims if claim.outcome != "holds"] == []
    assert max(flight.duration for flight in team.values()) <= 1.3 * longest_alone(plan)


@pytest.mark.slow
def test_where_fastest_paths_find_no_own_clocks_those_of_the_plans_own_times_are_hurried(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plan = ltlplan.plan(hall(4, "F(count(a) >= 2) & F(count(b) >= 1) & G(count(b) <= 1)", "0.7"))
    nominal = refine(plan, pace="nominal")

    def at_nominal_pace(problem: Problem, robots: dict[str, RobotFlight]) -> Together | None:
        return on_own_clocks(problem, robots) if problem.options.pace == "nominal" else None

    monkeypatch.setattr(team_flights, "on_own_clocks", at_nominal_pace)
    monkeypatch.setattr(team_flights, "_CROWD", 3)
    said: list[str] = []
    team = refine(plan, note=said.append)
    assert any("hurried on one clock" in sentence for sentence in said)
    assert verify.judge(plan, team, largest=False).holds
    assert max(flight.duration for flight in team.values()) <= 0.8 * max(flight.duration for flight in nominal.values())


def test_waits_that_the_formula_asks_for_stay() -> None:
    plan = ltlplan.plan(hall(2, "F(all(a) & F all(home))", "nominal"))
    assert {(meeting.first, meeting.then) for meeting in plan.meetings} == {
        (("q0", 0), ("q1", 1)),
        (("q1", 0), ("q0", 1)),
    }


@few_of(1, "pace", ["nominal", "0.7"])
def test_robots_that_cross_fields_together_keep_to_lanes(pace: str) -> None:
    plan = ltlplan.plan(abreast(pace))
    team = refine(plan)
    assert verify.judge(plan, team, largest=False).holds
    assert max(flight.duration for flight in team.values()) <= 1.3 * longest_alone(plan)
    sides = [np.sign(np.round(flight.evaluate(np.linspace(0.0, flight.duration, 50))[:, 1], 1)) for flight in team.values()]
    assert [set(side) for side in sides] == [{-1.0}, {0.0}, {1.0}]


def test_robots_whose_ways_cross_pass_one_after_another_without_a_meeting() -> None:
    """All four ways cross at one place, at one time."""
    ends = [((-4, 0), (4, 0)), ((0, -4), (0, 4)), ((-4, -4), (4, 4)), ((4, -4), (-4, 4))]
    plan = ltlplan.plan(swaps("crossing", [((*a, 1), (*b, 1)) for a, b in ends], (-8, -8, 0.2), (8, 8, 2)))
    feedback = feedback_of(plan, ())
    options = RefinementOptions("nominal", 1000.0, None, "refuse", unheard)
    problem = Problem(plan, feedback, options, spacing_for(plan, feedback))
    alone = {name: robot_flight(problem, name) for name in plan.robots}
    found = on_own_clocks(problem, alone)
    assert found is not None
    assert not isinstance(departures_of(problem, *found), DepartureConflict)
    assert arrival(found) <= 1.1 * max(robot.path.duration for robot in alone.values())


@few_of(1, "wide", [2, 3])
def test_a_show_in_a_ring_is_flown_all_at_once(wide: int, pace: Pace) -> None:
    """Robots in rows come into a ring above their stage together, and then back: every robot waits for all others there."""
    places = [(1.2 * (k % wide) - 1.2, 0.9 * (k // wide) - 0.9) for k in range(wide * wide)]
    agents = ", ".join(f"q{k}: {{start: [{x:.2f}, {y:.2f}, 0.7]}}" for k, (x, y) in enumerate(places))
    mission = ltlplan.parse_mission(_SHOW.format(agents=agents))
    plan = ltlplan.plan(mission, pace=pace)
    assert all([visit.region for visit in robot.visits] == ["stage", "ring", "stage"] for robot in plan.robots.values())
    team = refine(plan)
    assert verify.judge(plan, team, largest=False).holds
    assert max(flight.duration for flight in team.values()) <= 1.5 * longest_alone(plan)


@pytest.mark.slow
@pytest.mark.parametrize("pace", ["nominal", "0.7"])
@pytest.mark.parametrize("count", [6, 10, 30])
def test_many_robots_arrive_hardly_later_than_the_longest_alone(count: int, pace: str) -> None:
    plan = ltlplan.plan(gathering(count, pace))
    team = refine(plan)
    assert verify.judge(plan, team, largest=False).holds
    assert max(flight.duration for flight in team.values()) <= 1.2 * longest_alone(plan)
