"""Flights in closed loop: what the log holds, that it is the seed's alone, and that bad input is refused."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

import flight
from flight.closed_loop import Setup, steps
from flight.model.reference import sample_reference
from flight.model.sensing import MotionCapture
from flight.model.timing import CONTROL_STEP, SUBSTEPS
from tests.helpers.few import few_of
from tests.helpers.motion.stand_ins import Instant, StandIn, hop, mission, rest_to_rest, stand_in, through_a_hoop
from tests.helpers.motion.stand_ins import flight as made_flight
from verify.data import BadInput, NotCertified, Plan, RobotPlan, Trajectory, Visit, Waypoint, Word, load_vehicle
from verify.data.files.mission_file import parse_mission


@pytest.fixture(scope="module")
def plan_and_team():
    return made_flight()


@few_of(
    1,
    ("model", "controller"),
    [
        ("full", "geometric"),
        ("paper", "paper"),
        pytest.param("full", "paper", marks=pytest.mark.slow),
        pytest.param("paper", "geometric", marks=pytest.mark.slow),
    ],
)
def test_the_team_stays_near_its_plan_and_its_letters_are_the_planned_words(plan_and_team, model, controller):
    plan, team = plan_and_team
    log = flight.fly(plan, team, stand_in(plan, team), model=model, controller=controller)
    assert log.worst_error() < 0.03
    for name in log.robots:
        assert tuple(letter for _, letter in log.word(name)) == plan.robots[name].word.prefix
    assert log.margin == 0.05
    assert log.certificate is not None


def test_the_same_seed_gives_the_same_log_and_another_seed_another():
    plan, team = hop()
    conditions = {"wind": "0.3,0.1,0+0.2", "noise": 0.001}
    first, again, other = (flight.fly(plan, team, seed=seed, **conditions) for seed in (3, 3, 4))
    assert first.to_csv() == again.to_csv()
    assert first.to_csv() != other.to_csv()


def test_a_run_among_many_is_bit_for_bit_the_run_alone(plan_and_team):
    _, team = plan_and_team
    short = {name: rest_to_rest([path.evaluate(0)[:3], path.evaluate(9)[:3]], [0.5]) for name, path in team.items()}
    reference = sample_reference(short, CONTROL_STEP, SUBSTEPS)
    setup = Setup(
        (flight.airframe_of(load_vehicle("crazyflie-2.1")),),
        reference,
        flight.Conditions(flight.Wind((0.4, 0, 0), 0.3), MotionCapture(dropout=0.1)),
    )
    together = list(steps(setup, [5, 6, 7]))[-1]
    alone = list(steps(setup, [6]))[-1]
    assert np.array_equal(together.position[:, 2:4], alone.position)
    assert np.array_equal(together.attitude[:, 2:4], alone.attitude)


@pytest.mark.slow
def test_without_a_certificate_the_log_says_so(plan_and_team):
    plan, team = plan_and_team
    log = flight.fly(plan, team, model="paper")
    assert log.margin is None
    assert any("no certificate" in note for note in log.notes)


def test_a_certificate_of_other_trajectories_is_refused(plan_and_team):
    plan, team = plan_and_team
    certificate = stand_in(plan, team)
    other = {**team, "quad1": rest_to_rest([(1.2, 0.9, 0.8), (0.0, 0.8, 1.0)], [2.6])}
    with pytest.raises(NotCertified, match="does not cover"):
        flight.fly(plan, other, certificate)


def test_a_team_that_is_not_the_missions_is_refused(plan_and_team):
    plan, team = plan_and_team
    with pytest.raises(BadInput, match="quad1"):
        flight.fly(plan, {"quad0": team["quad0"]})


@pytest.mark.parametrize("wind", ["breeze", "1,2", "1+", "nan", "900", "1+-3"])
def test_a_wind_that_is_none_is_refused(plan_and_team, wind):
    plan, team = plan_and_team
    with pytest.raises(BadInput):
        flight.fly(plan, team, wind=wind)


@pytest.mark.parametrize("noise", ["loud", -0.1, 5.0])
def test_a_noise_that_is_none_is_refused(plan_and_team, noise):
    plan, team = plan_and_team
    with pytest.raises(BadInput):
        flight.fly(plan, team, noise=noise)


def test_a_vehicle_without_an_airframe_flies_on_an_estimate_and_the_log_says_so(plan_and_team):
    plan, team = plan_and_team
    vehicle = plan.mission.vehicle.model_copy(update={"name": "homemade"})
    log = flight.fly(plan.model_copy(update={"mission": mission().model_copy(update={"vehicle": vehicle})}), team)
    assert any("homemade" in note for note in log.notes)
    assert log.worst_error() < 0.03


@pytest.mark.slow
def test_a_lasso_is_flown_for_its_laps_with_its_actions_in_each():
    """A robot that goes round between two regions for ever, filling its tank in each lap; two laps are flown."""
    text = """
format: 1
name: patrol
spec: {formula: G F left & G F tank, trace: infinite, repeat: 2}
regions:
  left: {center: [0.0, 0.8, 1.0], radii: [0.2, 0.2, 0.2]}
  tank: {center: [0.8, -0.4, 0.9], radii: [0.2, 0.2, 0.2]}
robot:
  initial: empty
  states: {empty: [], full: [carrying]}
  actions: [{from: empty, to: full, at: tank}, {from: full, to: empty, at: left}]
agents: {quad0: {start: [1.2, 0.9, 0.8]}}
vehicle: crazyflie-2.1
workspace: {min: [-1.6, -1.3, 0.2], max: [1.6, 1.3, 1.8]}
"""
    made = parse_mission(text)
    start, left, tank = made.agents["quad0"].start, made.regions["left"].center, made.regions["tank"].center
    line = rest_to_rest([start, left, tank, left], [1.6, 1.6, 1.6])
    path = Trajectory(line.durations, line.coefficients, cycle=1)
    fill, drop = made.robot.actions
    plan = Plan(
        mission=made,
        robots={
            "quad0": RobotPlan(
                word=Word.of([[]], [["tank"], ["left"]]),
                visits=(Visit(region="left"), Visit(region="tank", actions=(fill,)), Visit(region="left", actions=(drop,))),
                waypoints=(Waypoint(position=start, role="start"),),
                times=(0.0,),
                cycle_visit=1,
                cycle_waypoint=0,
            )
        },
    )
    instants = (Instant("quad0", 1, Fraction(16, 5), "empty", "full"), Instant("quad0", 2, Fraction(47, 10), "full", "empty"))
    cert = StandIn(made, {"quad0": path.digest()}, actions=instants, duration=4.8)
    log = flight.fly(plan, {"quad0": path}, cert, model="paper")
    assert log.times[-1] == pytest.approx(8.0)
    carrying = np.array(["carrying" in row[0] for row in log.letters])
    expected = ((log.times >= 3.2) & (log.times < 4.7)) | ((log.times >= 6.4) & (log.times < 7.9))
    assert np.mean(carrying != expected) < 0.005
    assert log.satisfied is None
    assert log.tube == "inside"
    assert any("still open" in sentence for sentence in log.verdicts)
    assert flight.compare(log, cert, {"quad0": path}).covered
    assert flight.campaign(plan, {"quad0": path}, cert, runs=2, model="paper").share_satisfied.value == 1.0


@pytest.mark.parametrize("wind", ["1e308", "1e308,1e308,1e308", "-1e308", "0+1e308", "51", "30,30,30"])
def test_absurd_winds_are_refused_without_a_warning(wind):
    with pytest.raises(BadInput, match="is a storm; speeds are in m/s, at most 50"):
        flight.Wind.parse(wind)


def test_of_a_sequence_of_hoops_no_formula_is_called_satisfied():
    plan, team = through_a_hoop()
    cert = stand_in(plan, team)
    kept = flight.fly(plan, team, cert, model="paper")
    assert kept.tube == "inside"
    assert kept.satisfied is None
    assert not [event for event in kept.events if event.kind == "formula"]
    assert not [note for note in kept.notes if "judged" in note]
    left = flight.fly(plan, team, stand_in(plan, team, margin=1e-5), model="paper")
    assert left.tube == "outside"
    assert left.satisfied is None
    assert left.notes[-1].startswith("whether hoops were passed in their order was not judged; `ltlplan certify RUN --flight`")


@pytest.mark.slow
def test_a_campaign_of_a_sequence_of_hoops_counts_tubes_alone():
    plan, team = through_a_hoop()
    found = flight.campaign(plan, team, stand_in(plan, team), runs=2, wind="0+0.1", model="paper")
    assert found.share_inside.value == 1.0
    assert found.satisfied is found.share_satisfied is None
    assert found.contradictions == ()
    assert [row["satisfied"] for row in found.to_dict()["runs"]] == [None, None]
    assert found.sentences[1].startswith("the mission has no formula; who stayed inside the tubes passed hoops in their order")
    bare = flight.campaign(plan, team, runs=2, model="paper")
    assert "the mission has no formula; whether hoops were passed in their order was not judged." in bare.sentences


@pytest.mark.parametrize("seed", [-1, 1.5, float("nan"), "a", True])
def test_what_is_no_seed_is_refused(seed):
    with pytest.raises(BadInput, match="a seed is a whole number from 0 on, not"):
        flight.fly(*hop(), seed=seed)


def test_a_vehicle_that_cannot_be_simulated_is_named():
    plan, team = hop()
    tiny = plan.mission.vehicle.changed(name="tiny", inertia=(1e-300, 1e-300, 1e-300))
    plan = plan.model_copy(update={"mission": plan.mission.model_copy(update={"vehicle": tiny})})
    said = "quad0 is nowhere any more {}: what its profile 'tiny' says, or what its controller asks for, cannot be simulated in steps"
    with pytest.raises(BadInput, match=said.format(r"at 0\.\d\d s")):
        flight.fly(plan, team, controller="mellinger", noise=0.001)
    with pytest.raises(BadInput, match=said.format("in the flight with seed 3")):
        flight.campaign(plan, team, runs=2, seed=3, controller="mellinger", noise=0.001)
