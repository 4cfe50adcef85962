"""Rules for robots that join a team over a link, without a flight: who may join, where they wait, and climbs that are proved."""

import copy
from functools import partial

import numpy as np
import pytest

import flight
from flight.link.simulated import SimulatedLink
from ltlplan.online.event_queue import checked_events, fault_of
from ltlplan.online.segments.certified_team import CertifiedTeam
from ltlplan.online.standby import Lookout, Standby, shown_at, standby_of
from ltlplan.transfers import to_join, to_starts
from tests.helpers.live.live_missions import PAIR, pair
from tests.ltlplan.online.live.test_joining import START, joins
from tests.ltlplan.online.live.test_live_online_flight import PLACES
from verify.data import BadInput, Infeasible, NotCertified, Trajectory, parse_mission
from verify.data.events import HoopMoves, RobotJoins, RobotLeaves
from verify.data.sections import Agent

NOMINAL = PAIR + "planner: {pace: nominal}\n"


@pytest.fixture(scope="module")
def team():
    return CertifiedTeam(parse_mission(NOMINAL), seed=1)


LOW = pair("[-1.0, 0.4, 1.0]", "[1.0, 0.4, 1.4]", floor=0.2)
"""As PAIR, down to where standing robots are just out of reach."""


def test_who_may_join_is_known_before_take_off(team):
    mission = team.mission
    with pytest.raises(BadInput, match=r"three joins: it is not among .*there are none.*--standby NAME=X,Y,Z"):
        checked_events(mission, (joins(),))
    waits = standby_of(mission, {"four": (0.5, 0.5, 0.0)}, [joins()])
    assert waits.places == {"three": (0.0, -1.0, 0.0), "four": (0.5, 0.5, 0.0)}
    assert checked_events(mission, (joins(),), waits) == (joins(),)
    with pytest.raises(BadInput, match="one is a robot of the mission"):
        standby_of(mission, {"one": (0, 0, 0)}, [])
    other = RobotJoins(time=1.0, robot="three", agent=Agent(start=START, vehicle="crazyflie-brushless"))
    assert "another vehicle" in waits.fault(mission, other)


def test_what_keeps_one_from_joining_is_said_when_it_is_told(team):
    waits = standby_of(team.mission, {}, [joins()])
    said = partial(fault_of, team, standby=waits)
    assert said(joins()) is None
    assert "it may show 'left'" in said(joins(start=(-1.0, 0.4, 1.0)))
    assert "it may show 'left'" in said(joins(start=(-1.0, 0.11, 1.0))), "within the margin of its edge"
    moved = HoopMoves(time=1.0, region="left", center=(0.0, -1.0, 0.9)).apply(team.mission)
    assert "it may show 'left'" in said(joins(), earlier=[moved]), "as it was before"
    assert "at 1 s three joins" in said(joins(start=(0.0, 0.0, 5.0))).lower().replace("0 s", "1 s")
    assert "not in the air" in said(RobotLeaves(time=1.0, robot="three"))
    counted = copy.deepcopy(team)
    counted.mission = parse_mission(PAIR.replace("F left & F right}", "F(count(left) >= 1), team: joint}"))
    assert "counts robots" in fault_of(counted, joins(), waits)


@pytest.mark.parametrize(("point", "shown"), [((-1.0, 0.4, 1.31), None), ((-1.0, 0.4, 1.29), "left"), ((1.0, 0.4, 1.1), None)])
def test_a_place_shows_what_any_point_within_its_margin_does(team, point, shown):
    found = shown_at(point, team.mission)
    rng = np.random.default_rng(1)
    around = rng.normal(size=(2000, 3))
    around *= team.mission.margin / np.linalg.norm(around, axis=1)[:, None]
    region = team.mission.all_regions["left"]
    brute = bool((region.level(np.array(point) + around) <= 1).any())
    assert (found == "left") == (shown == "left")
    assert found == "left" or not brute


def test_robots_that_wait_are_out_of_reach(team):
    waits = Standby({"three": Agent(start=START)}, {"three": (0.0, -1.0, 0.0)})
    waits.require_out_of_reach(parse_mission(LOW))
    with pytest.raises(BadInput, match=r"`workspace` begins at z = 0.05 m, and must begin at 0\.\d+ m"):
        waits.require_out_of_reach(parse_mission(pair("[-1.0, 0.4, 1.0]", "[1.0, 0.4, 1.4]", floor=0.05)))


def test_what_climbs_and_lands_stays_clear_of_those_that_wait(team):
    """Held against the body itself: from each point of the climbs to the box around the one that waits."""
    waits = Standby({"three": Agent(start=START)}, {"three": (-0.7, -0.5, 0.0)})
    radius = team.mission.vehicle.radius
    climb, _ = to_starts(waits.solid(team.mission), team.present.team, PLACES)
    half = radius + team.mission.margin
    for path in climb.team.values():
        away = np.abs(path.evaluate(np.linspace(0, path.duration, 2000))[:, :3] - np.array([-0.7, -0.5, 0.0])) - half
        assert np.linalg.norm(np.maximum(away, 0), axis=1).min() > radius + team.mission.margin
    with pytest.raises(BadInput):
        to_starts(Standby(waits.agents, {"three": (-0.95, -0.5, 0.0)}).solid(team.mission), team.present.team, PLACES)


def test_a_climb_is_proved_against_those_that_hover(team):
    hovers = dict(team.present.team)
    ends = {name: track.evaluate(track.duration)[:3] for name, track in hovers.items()}

    def world(start):
        return team.mission.model_copy(update={"agents": {**team.mission.agents, "three": Agent(start=start)}})

    climb, way = to_join(world(START), "three", (0.2, -1.2, 0.0), hovers)
    for transfer, begin, end in ((climb, (0.2, -1.2, 0.0), (0.2, -1.2, 0.8)), (way, (0.2, -1.2, 0.8), START)):
        path = transfer.team["three"]
        assert path.evaluate(0.0)[:3] == pytest.approx(begin, abs=1e-5)
        assert path.evaluate(path.duration)[:3] == pytest.approx(end, abs=1e-5)
        for name, at in ends.items():
            stay = transfer.team[name].evaluate(np.linspace(0, transfer.team[name].duration, 200))[:, :3]
            assert np.abs(stay - at).max() < 1e-5
            away = path.evaluate(np.linspace(0, path.duration, 2000))[:, :3] - at
            assert np.linalg.norm(away, axis=1).min() > team.mission.separation + 2 * team.mission.margin
    above = ends["one"] + (0.0, 0.0, 0.4)  # its only way up is through the one that hovers there
    with pytest.raises((BadInput, Infeasible)):
        to_join(world(tuple(above.tolist())), "three", (*ends["one"][:2].tolist(), 0.0), hovers)


def still(place, seconds=1.0):
    rest = np.zeros((1, 4, 8))
    rest[0, :3, 0] = place
    return Trajectory([seconds], rest.astype(np.float32))


def test_others_may_hover_inside_of_a_ring_and_above_each_other():
    """Where separation counts otherwise in height, a climb below somebody is refused that would be near enough beside."""
    ring = "hoops:\n  ring: {center: [0.5, 0.0, 1.2], radii: [0.3, 0.3, 0.3], opening: 0.3, rim: 0.03}\nseparation: 0.3\nseparation_z: 0.9\n"
    mission = parse_mission(pair("[-1.0, 0.4, 1.0]", "[1.0, 0.4, 1.4]", more=ring))
    hovers = {"one": still((0.5, 0.0, 1.2)), "two": still((-1.0, 0.0, 1.7))}

    def climbs(start, asked=mission):
        agents = {**asked.agents, "three": Agent(start=start)}
        return to_join(asked.model_copy(update={"agents": agents}), "three", (*start[:2], 0.0), hovers)

    (climb,) = climbs((0.0, -1.0, 0.8))
    assert climb.mission.agents.keys() == {"one", "two", "three"}
    assert (climb.team["one"].evaluate(0.7)[:3] == np.float32((0.5, 0.0, 1.2))).all()
    (beside,) = climbs((-1.0, -0.55, 0.9))
    away = beside.team["three"].evaluate(np.linspace(0, beside.part.duration, 2000))[:, :3] - (-1.0, 0.0, 1.7)
    assert np.linalg.norm(away * (1, 1, 0.3 / 0.9), axis=1).min() > mission.separation + 2 * mission.margin
    with pytest.raises((BadInput, Infeasible)):  # 0.8 m below it
        climbs((-1.0, 0.0, 0.9))
    (below,) = climbs((-1.0, 0.0, 0.9), mission.model_copy(update={"separation_z": None}))
    assert below.name == "climb"


def test_a_climb_that_is_planned_too_near_to_somebody_is_refused_by_the_judge(team, monkeypatch):
    monkeypatch.setattr("ltlplan.transfers._with_bodies", lambda mission, robot, still: mission.obstacles)
    hovers = {"one": still((0.0, -0.8, 0.8)), "two": still((1.0, 1.0, 1.0))}
    world = team.mission.model_copy(update={"agents": {**team.mission.agents, "three": Agent(start=START)}})
    with pytest.raises(NotCertified, match=r"climb past the others: .*three"):
        to_join(world, "three", (*START[:2], 0.0), hovers)


def test_one_that_waits_has_to_be_seen_for_half_a_second(team):
    from flight.link.record import Record

    waits = standby_of(team.mission, {}, [joins()])
    link = SimulatedLink(waits.beside(team.mission), {**PLACES, **waits.places}, conditions=flight.Conditions(noise=0.001))
    climb = waits.standing(team.mission)
    lookout, record = Lookout(), Record()
    link.sleep(0.1)
    lookout.look(link, record, ["three"])
    assert [check.name for check in lookout.checks(link, climb, "three", 5.0) if not check.passed] == ["often", "quiet"]
    for _ in range(40):
        link.sleep(0.02)
        lookout.look(link, record, ["three"])
    assert all(check.passed for check in lookout.checks(link, climb, "three", 5.0))
    assert [check.name for check in lookout.checks(link, climb, "three", 500.0) if not check.passed] == ["battery"]
    link.sleep(1.0)
    assert [check.name for check in lookout.checks(link, climb, "three", 5.0) if not check.passed] == ["pose"]
    assert len(record.poses) == len({time for time, *_ in record.poses})
