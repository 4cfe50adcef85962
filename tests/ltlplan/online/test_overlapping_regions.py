"""Online flights over regions that overlap or lie in each other: robots begin inside them, join inside them, and the checker holds."""

import numpy as np
import pytest

from ltlplan.online.simulated_online_flight import fly_online
from tests.helpers.few import few_of
from tests.helpers.missions.overlaps import NEST, PAIR, THREE, Ball, mission_of, overlapping
from tests.helpers.words.spot_reading import spot_accepts
from tests.ltlplan.online_mtac.test_online_team import Flight
from verify.data import Word
from verify.data.events import NewFormula, RobotJoins
from verify.data.sections import Agent

STARTS = ["out of two, to the far side", "out of a region in another", "in the outer one", "out of three"]
JOINS: list[tuple[dict[str, Ball], tuple[float, float, float], tuple[float, float, float], str]] = [
    (PAIR, (-2.5, 0.0, 1.2), (0.2, 0.0, 1.2), "F c & F d & (!d U c)"),
    (NEST, (-2.8, 0.0, 1.2), (0.35, 0.0, 1.2), "F (room & desk) & F c & F d"),
    (THREE, (-2.8, 0.0, 1.2), (0.25, 0.2, 1.2), "F c & F d"),
]


def read(mission, words):
    """Whether Spot accepts what the robots showed, read one robot after another."""
    return spot_accepts(mission.formula, Word(tuple(letter for word in words.values() for letter in word)))


@few_of(1, "case", STARTS)
def test_a_team_that_shares_in_flight_begins_inside_them(case):
    flight = Flight(mission_of(case))
    assert flight.team.belief.held["quad0"] == frozenset(flight.team.pilots["quad0"].where.inside)
    assert flight.fly(60) is not None
    assert flight.team.belief.accepts()
    assert read(flight.team.mission, flight.words)
    assert flight.said == []


@few_of(1, ("regions", "start", "joins", "formula"), JOINS)
@pytest.mark.slow
def test_a_robot_joins_inside_them_and_takes_its_part(regions, start, joins, formula):
    event = RobotJoins(time=1.0, robot="late", agent=Agent(start=joins))
    flight = Flight(overlapping(formula, start, regions=regions), events=[event])
    assert flight.fly(60) is not None
    inside = {name for name, region in flight.team.mission.all_regions.items() if region.level(np.array(joins)) <= 1.0}
    assert len(inside) == 3 if regions is THREE else len(inside) == 2
    assert flight.words["late"][0] == inside
    assert len(flight.words["late"]) > 1
    assert flight.team.belief.accepts()


@pytest.mark.slow
def test_a_new_formula_is_shared_from_where_a_robot_hovers_inside_two():
    flight = Flight(mission_of("into a region in another"), events=[NewFormula(time=6.5, formula="F desk & F d")])
    assert flight.fly(60) is not None
    assert [set(letter) for letter in flight.words["quad0"]] == [set(), {"room"}, {"desk", "room"}, {"room"}, set(), {"d"}]
    assert read(flight.team.mission, flight.words)


@pytest.mark.slow
@pytest.mark.parametrize("certified", [False, True])
@pytest.mark.parametrize("case", STARTS)
def test_the_checker_holds_a_flight_that_begins_inside_them(case, certified):
    flight = fly_online(mission_of(case), seed=1, certified=certified, noise=0.001)
    assert flight.require() is flight
    assert flight.certified is certified
    assert read(flight.mission, flight.words)


@pytest.mark.slow
@pytest.mark.parametrize("certified", [False, True])
@pytest.mark.parametrize(("regions", "start", "joins", "formula"), JOINS)
def test_the_checker_holds_a_flight_in_which_a_robot_joins_inside_them(regions, start, joins, formula, certified):
    event = RobotJoins(time=1.0, robot="late", agent=Agent(start=joins))
    mission = overlapping(formula, start, regions=regions)
    flight = fly_online(mission, seed=1, certified=certified, noise=0.001, events=[event])
    assert flight.require() is flight
    assert flight.certified is certified
    assert len(flight.words["late"][0]) >= 2
