import dataclasses
import math

import numpy as np
import pytest

import verify
from tests.helpers.few import few_of
from tests.helpers.motion.flights import REST_TO_REST, changed, firefighting, legs, plan_of, small_mission
from tests.helpers.motion.limited_quantities import LIMITS
from verify import certify, judge
from verify.data.errors import BadInput, NotCertified
from verify.data.plan import Plan, Visit
from verify.data.sections import Action
from verify.data.trajectory import Trajectory
from verify.motion.continuity import jumps
from verify.motion.paths import read_team


@pytest.fixture(scope="module")
def fire():
    return firefighting()


def refused(plan, team, **options):
    """Judge, and return the names of the claims that do not hold."""
    certificate = judge(plan, team, largest=False, **options)
    for claim in certificate.claims:
        assert (claim.witness is None) == (claim.outcome == "holds")
        assert claim.sentence
    assert not certificate.covers(team) or certificate.holds
    return {claim.name for claim in certificate.claims if claim.outcome != "holds"}


def test_a_hand_made_flight_is_certified(fire):
    plan, team = fire
    certificate = certify(plan, team)
    assert certificate.holds
    assert certificate.covers(team)
    assert certificate.largest_margin == pytest.approx(0.0782, abs=2e-4)
    names = {claim.name for claim in certificate.claims}
    assert names == {
        "formula", "transitions", "visits", "passages", "rims", "workspace", "separation", "continuity",
        *(f"limits.{name}" for name in LIMITS),
    }  # fmt: skip
    (action,) = certificate.actions
    assert (action.robot, action.visit, action.source, action.target) == ("quad0", 0, "no_water", "carrying")
    water = plan.mission.all_regions["water"]
    assert float(water.level(team["quad0"].evaluate(action.time)[:3])) < 1
    assert certificate.duration == max(t.duration for t in team.values())
    assert certificate.digest() == judge(plan, team).digest()
    assert all(claim.bound is None or claim.margin is None or claim.margin >= 0 for claim in certificate.claims)


def test_the_largest_margin_holds_and_a_little_more_does_not(fire):
    plan, team = fire
    largest = judge(plan, team).largest_margin
    assert refused(plan, team, margin=largest) == set()
    assert refused(plan, team, margin=largest + 2.5e-4) != set()
    with pytest.raises(NotCertified) as caught:
        certify(plan, team, margin=0.1)
    assert "largest margin" in str(caught.value)
    assert judge(plan, team, margin=0.1).largest_margin == pytest.approx(largest, abs=2e-4)
    assert caught.value.witnesses


# What a certificate covers; the flights that are refused, and their witnesses, are in test_refused_*.py.


def test_without_its_wait_a_flight_is_another_one(fire):
    plan, team = fire
    path = Trajectory(team["quad1"].durations[1:], team["quad1"].coefficients[1:])
    assert not certify(plan, team).covers({**team, "quad1": path})


def test_any_last_bit_of_any_number_voids_the_certificate(fire):
    plan, team = fire
    certificate = certify(plan, team)
    assert certificate.covers(team)
    count = 0
    for robot, trajectory in team.items():
        for piece in range(len(trajectory)):
            for axis in range(4):
                for power in range(8):
                    values = trajectory.coefficients.copy()
                    value = np.float32(values[piece, axis, power])
                    values[piece, axis, power] = np.nextafter(value, np.float32(np.inf))
                    assert not certificate.covers({**team, robot: changed(trajectory, coefficients=values)})
                    count += 1
            durations = trajectory.durations.copy()
            durations[piece] = np.nextafter(np.float32(durations[piece]), np.float32(np.inf))
            assert not certificate.covers({**team, robot: changed(trajectory, durations=durations)})
    assert count > 300
    assert not certificate.covers({name: team[name] for name in ("quad0", "quad1")})


def with_visits(plan, robot, visits):
    return plan.model_copy(
        update={"robots": {**plan.robots, robot: plan.robots[robot].model_copy(update={"visits": tuple(visits)})}}
    )


# Small worlds.

BALL = "a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}"


def test_a_lap_must_close_on_itself():
    mission = small_mission("G F a", regions=BALL, trace="infinite")
    lap = legs([[0, 0, 1], [1, 0, 1], [0, 0, 1]], cycle=0)
    plan = plan_of(mission, {"r0": [Visit(region="a")]})
    robot = plan.robots["r0"].model_copy(update={"cycle_visit": 0, "cycle_waypoint": 0})
    plan = plan.model_copy(update={"robots": {"r0": robot}})
    assert refused(plan, {"r0": lap}) == set()
    open_lap = legs([[0, 0, 1], [1, 0, 1], [0.2, 0, 1]], cycle=0)
    assert "continuity" in refused(plan, {"r0": open_lap})
    one_way = legs([[0, 0, 1], [1, 0, 1], [0, 0, 1]], cycle=2 - 1)
    assert "continuity" in refused(plan, {"r0": one_way})


def test_a_joint_that_closes_is_not_said_to_be_broken_where_rounding_hides_it():
    """From rest to rest over 2^40 m: every derivative ends exactly at zero, which balls of a metre cannot tell."""
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, 2, 0] = 1.0
    coefficients[0, 0, 4:] = np.array(REST_TO_REST) * 2.0**40
    path = Trajectory([1.0], coefficients)
    (claim,) = (
        c for c in judge(plan_of(small_mission(regions=""), {}), {"r0": path}, largest=False).claims if c.name == "continuity"
    )
    assert claim.outcome == "undecided"
    (jump,) = jumps(read_team(small_mission(regions=""), {"r0": path}))
    assert jump.share > 1
    assert jump.sure <= 0


def test_limits_of_a_leg():
    for speed, expected in ((1.0, set()), (0.9, {"limits.legs.speed"})):
        mission = small_mission("F a", regions=BALL, extra=f"limits: {{legs: {{a: {{speed: {speed}}}}}}}")
        path = {"r0": legs([[0, 0, 1], [1, 0, 1]])}  # peaks at 2.1875 x 0.45 m/s
        assert refused(plan_of(mission, {"r0": [Visit(region="a")]}), path) == expected
    away = {"r0": legs([[0, 0, 1], [0, 1, 1]])}
    assert "limits.legs" in refused(plan_of(mission, {"r0": [Visit(region="a")]}), away)


@pytest.mark.parametrize("value", [-0.01, math.nan, math.inf, "0.1", True, 10**400])
def test_margins_and_clock_errors_must_be_numbers(fire, value):
    plan, team = fire
    with pytest.raises(BadInput, match="margin"):
        judge(plan, team, margin=value)
    with pytest.raises(BadInput, match="clock_error"):
        judge(plan, team, clock_error=value)


def test_a_plan_for_other_robots_is_bad_input(fire):
    plan, team = fire
    robots = {name: robot for name, robot in plan.robots.items() if name != "quad2"}
    with pytest.raises(BadInput, match="plan has robots"):
        judge(Plan.model_construct(**{**dict(plan), "robots": robots}), team)


@few_of(1, "size", [1e300, 1e4, 1e20, 1e150])
@few_of(1, "power", [7, 4, 1, 0])
def test_absurd_numbers_are_refused_without_a_traceback(size, power):
    mission = small_mission("F a", regions=BALL)
    path = legs([[0, 0, 1], [1, 0, 1]])
    values = path.coefficients.copy()
    values[0, :, power] = size
    found = refused(plan_of(mission, {"r0": [Visit(region="a")]}), {"r0": changed(path, coefficients=values)})
    assert {"continuity", "workspace"} <= found


@few_of(1, "numbers", [(1e38, 0.0), (5e-324, 0.0), (1.0, 1e150), (1.0, 1.7e308), (1e20, -1e20)])
@pytest.mark.parametrize("clock_error", [0.0, pytest.param(0.1, marks=pytest.mark.slow)])
def test_absurd_numbers_of_one_robot_near_a_hoop_and_another_robot(numbers, clock_error):
    """Bounds that are infinite on one side only, in every claim that there is."""
    hoops = "h: {center: [1.0, 1.0, 1.0], radii: [0.2, 0.2, 0.2], opening: 0.3, rim: 0.05}"
    mission = small_mission("F a", regions=BALL, hoops=hoops, starts=[[0, 0, 1], [0, 1, 1]])
    duration, size = numbers
    wild = legs([[0, 1, 1], [1, 1, 1]])
    values = wild.coefficients.copy()
    values[0, 0, 3] = size or values[0, 0, 3]
    team = {"r0": legs([[0, 0, 1], [1, 0, 1]]), "r1": changed(wild, durations=[duration], coefficients=values)}
    found = refused(plan_of(mission, {"r0": [Visit(region="a")]}), team, clock_error=clock_error)
    assert bool(found) == (duration >= 1)  # in no time at all it stays where it starts, which is allowed


@few_of(2, "duration", [1e-30, 1e-12, 1e12, 1e30])
def test_absurd_durations_are_refused_or_judged_without_a_traceback(duration):
    mission = small_mission("F a", regions=BALL)
    path = legs([[0, 0, 1], [1, 0, 1]])
    found = refused(plan_of(mission, {"r0": [Visit(region="a")]}), {"r0": changed(path, durations=[duration])})
    assert ("visits" if duration < 1 else "continuity") in found


@pytest.mark.parametrize(
    ("durations", "shape"),
    [([math.nan], (1, 4, 8)), ([math.inf], (1, 4, 8)), ([0.0], (1, 4, 8)), ([-1.0], (1, 4, 8)), ([1.0], (1, 4, 9)), ([], (0, 4, 8)),
     ([1.0] * 10_000, (10_000, 4, 8)), ([[1.0]], (1, 4, 8))],
)  # fmt: skip
def test_nonsense_is_no_trajectory(durations, shape):
    with pytest.raises(BadInput):
        Trajectory(durations, np.zeros(shape))
    for bad in (math.nan, math.inf, -math.inf):
        values = np.zeros((1, 4, 8))
        values[0, 2, 3] = bad
        with pytest.raises(BadInput):
            Trajectory([1.0], values)


def test_the_certificate_is_plain_json(fire):
    plan, team = fire
    certificate = judge(plan, team, margin=0.1)
    data = certificate.to_dict()
    assert data["format"] == 2
    assert {c["verdict"] for c in data["claims"]} >= {"holds", "fails"}
    assert all("witness" in c for c in data["claims"] if c["verdict"] != "holds")
    assert not certificate.covers(team)
    assert dataclasses.replace(certificate, margin=0.2).digest() != certificate.digest()
    assert verify.Certificate is type(certificate)


TANK = """robot:
  initial: dry
  states: {dry: [], wet: [wet]}
  actions: [{from: dry, to: wet, at: a}, {from: wet, to: dry, at: b}]"""
AB = BALL + "\nb: {center: [0.0, 1.0, 1.0], radii: [0.2, 0.2, 0.2]}"


def lap_plan(visits, cycle_visit, formula="G F wet & G F !wet"):
    mission = small_mission(formula, regions=AB, trace="infinite", extra=TANK, margin=0.01)
    plan = plan_of(mission, {"r0": visits})
    robot = plan.robots["r0"].model_copy(update={"cycle_visit": cycle_visit})
    return plan.model_copy(update={"robots": {"r0": robot}})


def test_actions_of_a_lap():
    fill, empty = Action(source="dry", target="wet", at="a"), Action(source="wet", target="dry", at="b")
    lap = {"r0": legs([[0, 0, 1], [0.5, 0.0, 1.0], [1, 0, 1], [0, 1, 1], [0.5, 0.0, 1.0]], cycle=1)}
    good = [Visit(region="a", actions=(fill,)), Visit(region="b", actions=(empty,))]
    assert refused(lap_plan(good, 0), lap) == set()
    unbalanced = [Visit(region="a", actions=(fill,)), Visit(region="b")]
    assert "visits" in refused(lap_plan(unbalanced, 0), lap)
    assert "visits" in refused(lap_plan(good, 1), lap)  # the first action would be repeated in every lap
    for visit in (None, -1, 3):
        with pytest.raises(BadInput, match="cycle"):
            judge(lap_plan(good, visit), lap)


def test_plans_that_do_not_fit_their_mission_are_bad_input(fire):
    plan, team = fire
    with pytest.raises(BadInput, match="nowhere"):
        judge(with_visits(plan, "quad0", [Visit(region="nowhere")]), team)
    robot = plan.robots["quad0"].model_copy(update={"cycle_visit": 0})
    with pytest.raises(BadInput, match="finite"):
        judge(plan.model_copy(update={"robots": {**plan.robots, "quad0": robot}}), team)


@pytest.mark.parametrize("radius", ["0.0", "-1.0", "1e-200", "1e-160", "1e-7", "1e7", "1e200", ".nan", ".inf", "1e999"])
def test_regions_without_a_sensible_size_are_bad_input(radius):
    with pytest.raises(BadInput, match="radii"):
        small_mission(regions=f"a: {{center: [1.0, 0.0, 1.0], radii: [{radius}, 0.2, 0.2]}}")


@pytest.mark.parametrize("radius", ["1e-6", "1e6"])
def test_needles_and_plates_are_judged(radius):
    mission = small_mission("G !a", regions=f"a: {{center: [1.0, 0.0, 1.0], radii: [{radius}, 0.2, 0.2]}}")
    found = refused(plan_of(mission, {}), {"r0": legs([[0, 0, 1], [0, 1, 1]])})
    assert found == (set() if radius == "1e-6" else {"formula"} | (found & {"visits"}))


TAPS = """robot:
  initial: empty
  states: {empty: [], half: [half], full: [half, full]}
  actions: [{from: empty, to: half, at: a}, {from: half, to: full, at: a}]"""
TWICE = (Action(source="empty", target="half", at="a"), Action(source="half", target="full", at="a"))


def test_two_actions_of_one_visit_are_spread_over_it():
    mission = small_mission("F full & G(full -> half)", regions=BALL, extra=TAPS)
    plan = plan_of(mission, {"r0": [Visit(region="a", actions=TWICE)]})
    path = legs([[0, 0, 1], [2, 0, 1]])
    certificate = certify(plan, {"r0": path})
    first, second = (action.time for action in certificate.actions)
    entered, left = (c.time for c in certificate.timelines["r0"].changes)
    stay = float(left.low - entered.high)
    assert first - float(entered.high) == pytest.approx(stay / 3, abs=2e-6)
    assert second - first == pytest.approx(stay / 3, abs=2e-6)
    middle = mission.model_copy(update={"spec": mission.spec.model_copy(update={"formula": "F(half & !full)"})})
    assert certify(plan.model_copy(update={"mission": middle}), {"r0": path}).holds  # there is time between them


@pytest.mark.parametrize("depth", [1e-12, 1e-14])
def test_actions_of_a_visit_of_microseconds_are_told_apart_or_refused(depth):
    mission = small_mission("F full", regions=BALL, extra=TAPS, starts=[[0.0, 0.2 - depth, 1.0]])
    values = legs([[0, 0, 1], [2, 0, 1]]).coefficients.copy()
    values[:, 1, 0] = 0.2 - depth
    path = changed(legs([[0, 0, 1], [2, 0, 1]]), coefficients=values)
    certificate = judge(plan_of(mission, {"r0": [Visit(region="a", actions=TWICE)]}), {"r0": path}, largest=False)
    times = [action.time for action in certificate.actions]
    assert times == sorted(set(times))
    region = mission.all_regions["a"]
    assert all(float(region.level(path.evaluate(time)[:3])) <= 1 + 1e-12 for time in times)
    assert certificate.holds == (len(times) == 2)
