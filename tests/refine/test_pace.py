"""Pace: a share of the fastest flight, which is judged, never slower than the plan's own times, and the same each time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import strategies as st

import ltlplan
import verify
from ltlplan.pipeline import certified_team
from refine import parts, refine
from refine.coordination import team_flights
from refine.coordination.avoidance import conflict_resolution
from refine.coordination.common_clock import Flown, on_faster_clock
from refine.coordination.midway_waits import with_hovers
from refine.coordination.spacing import spacing_for
from refine.coordination.team_flights import together
from refine.corridor.fitting import monotone_rules
from refine.feedback import feedback_of
from refine.limits.limits import Limits as FlightLimits
from refine.limits.stretching import stretch_to_limits
from refine.single_robot import least_time, time_optimised
from refine.single_robot.flight import robot_flight
from refine.single_robot.task import Fitted, Problem, RefinementOptions, Task
from refine.single_robot.visits_shown import showing_visits
from refine.slowing import Dip, slowed_at
from refine.solvers import ipopt_engine
from refine.spline.spline import Spline
from refine.team_pauses import Resting
from tests.helpers.few import few_of, given_few
from tests.helpers.missions.random_missions import mission_of_many_kinds, random_mission
from tests.helpers.motion.plans_by_hand import ball, fire_plan, patrol_plan, room, sequence_plan, straight
from verify.data import Infeasible, LtlplanError, Plan, Trajectory
from verify.data.progress import silent
from verify.data.sections import Agent, LegLimits, Limits
from verify.data.shapes.region import Region


def assert_holds(plan: Plan, team: dict[str, Trajectory]) -> None:
    claims = verify.judge(plan, team, largest=False).claims
    assert [claim.sentence for claim in claims if claim.outcome != "holds"] == []


def lasts(team: dict[str, Trajectory]) -> float:
    return max(flight.duration for flight in team.values())


@few_of(1, "make", [sequence_plan, fire_plan])
def test_a_pace_is_a_share_of_the_fastest_flight(make: Callable[[], Plan]) -> None:
    plan = make()
    fastest, half, nominal = (refine(plan, pace=pace) for pace in (1, 0.5, "nominal"))
    for team in (fastest, half):
        assert_holds(plan, team)
    assert lasts(half) == pytest.approx(2.0 * lasts(fastest), rel=1e-3)
    assert lasts(fastest) < 0.6 * lasts(nominal)


@pytest.mark.slow
def test_the_missions_pace_is_the_default_and_agents_may_have_their_own() -> None:
    plan = fire_plan()
    assert lasts(refine(plan)) == pytest.approx(lasts(refine(plan, pace=0.7)))
    quad2 = plan.mission.agents["quad2"].model_copy(update={"pace": "nominal"})
    own = plan.changed(mission=plan.mission.changed(agents={**plan.mission.agents, "quad2": quad2}))
    team, nominal = refine(own), refine(plan, pace="nominal")
    assert team["quad2"] == nominal["quad2"]
    assert team["quad0"].duration < nominal["quad0"].duration
    assert_holds(own, team)


def test_what_is_remembered_of_a_flight_names_no_other_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    def lost(task: Task, *_: object, **__: object) -> least_time.Guess:
        raise Infeasible(f"{task.name}: no points.")

    monkeypatch.setattr(time_optimised, "least_time", lost)
    said: list[str] = []
    for name in ("one", "other"):
        mission = room({"a": ball(0, 0)}, {name: Agent(start=(-1.5, 0.0, 1.0))})
        plan = Plan(mission=mission, robots={name: straight((-1.5, 0, 1), (0, 0, 1), (1.5, 0, 1), visits={1: "a"})})
        assert_holds(plan, refine(plan, pace=1, note=said.append))
    assert said == [f"{name}: a faster flight was looked for and not found: {name}: no points." for name in ("one", "other")]


@pytest.mark.slow
def test_a_team_that_no_faster_clock_suits_stays_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object) -> None:
        raise Infeasible("No pace keeps the limits.")

    plan = fire_plan()
    feedback, options = feedback_of(plan, ()), RefinementOptions(1.0, 1e3, None)
    problem = Problem(plan, feedback, options, spacing_for(plan, feedback))
    team = together(plan, feedback, options, silent)
    monkeypatch.setattr(conflict_resolution, "along", never)
    assert conflict_resolution.hurried(problem, *team) is None


@pytest.mark.slow
@given_few(1, 40, st.integers(0, 10_000))
def test_flights_of_random_teams_are_judged_and_never_slower_than_the_plans_own_times(seed: int) -> None:
    plan = ltlplan.plan(random_mission(seed, samples=20, rounds=2))
    fastest = refine(plan, pace=1)
    assert_holds(plan, fastest)
    assert lasts(fastest) <= lasts(refine(plan, pace="nominal"))


def test_a_mission_whose_own_pace_is_nominal_waits_on_the_way_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def waited(*_: object) -> None:
        raise Infeasible("Robots wait on the way.")

    agents = {name: Agent(start=(-1.5, y, 1)) for name, y in (("q0", 0.5), ("q1", -0.5))}
    robots = {name: straight(agent.start, (1.0, agent.start[1], 1.0)) for name, agent in agents.items()}
    plan = Plan(mission=room({}, agents), robots=robots)
    planner = plan.mission.planner.model_copy(update={"pace": "nominal"})
    monkeypatch.setattr(team_flights, "MEANS", team_flights.MEANS[-1:])
    monkeypatch.setattr(team_flights, "schedule_safe_intervals", waited)
    with pytest.raises(Infeasible, match="wait on the way"):
        refine(plan, pace="nominal")
    with pytest.raises(Infeasible, match="wait on the way"):
        refine(plan.changed(mission=plan.mission.changed(planner=planner)))


@pytest.mark.slow
@given_few(1, 60, st.integers(0, 10_000))
def test_missions_of_many_kinds_that_nominal_times_certify_are_certified_at_every_pace(seed: int) -> None:
    mission = mission_of_many_kinds(seed)
    try:
        nominal = certified_team(ltlplan.plan(mission, pace="nominal"))
    except LtlplanError:
        return  # not every one can be flown
    fastest, usual = (certified_team(ltlplan.plan(mission, pace=pace)) for pace in (1.0, 0.7))
    assert nominal.certificate.holds == fastest.certificate.holds == usual.certificate.holds is True
    assert fastest.plan.words != nominal.plan.words or lasts(fastest.team) <= lasts(nominal.team)


def test_limits_of_a_leg_slow_that_leg_and_not_the_whole() -> None:
    slow = Limits(legs={"b": LegLimits(speed=0.25, acceleration=0.5)})
    mission = room({"a": ball(0, 0), "b": ball(1.5, 0)}, {"q": Agent(start=(-1.5, 0.0, 1.0))}, limits=slow)
    plan = Plan(mission=mission, robots={"q": straight((-1.5, 0, 1), (0, 0, 1), (1.5, 0, 1), visits={1: "a", 2: "b"})})
    flight = refine(plan, pace=1)
    assert_holds(plan, flight)
    everywhere = plan.changed(mission=mission.changed(limits=Limits(speed=0.25, acceleration=0.5)))
    assert lasts(flight) < 0.6 * lasts(refine(everywhere, pace=1))


@few_of(1, "heading", ["path", (0.0, 0.0, 1.0)])
def test_yaw_keeps_its_limits_at_the_greatest_pace(heading: Literal["path"] | tuple[float, float, float]) -> None:
    agents = {"q": Agent(start=(-1.5, 0.0, 1.0), heading=heading)}
    mission = room({"a": ball(0, 0.8)}, agents, limits=Limits(yaw_rate_deg=60.0))
    plan = Plan(mission=mission, robots={"q": straight((-1.5, 0, 1), (0, 0.8, 1), (1.5, 0, 1), visits={1: "a"})})
    flight = refine(plan, pace=1)
    assert_holds(plan, flight)
    assert np.ptp(flight["q"].evaluate(np.linspace(0.0, lasts(flight), 100))[:, 3]) > 0.3


@pytest.mark.slow
def test_robots_that_wait_on_the_way_are_not_tried_at_the_plans_own_times() -> None:
    plan = fire_plan()
    feedback, options = feedback_of(plan, ()), RefinementOptions(1.0, 1e3, None)
    flown = robot_flight(Problem(plan, feedback, options, spacing_for(plan, feedback)), "quad0", rests=frozenset({1}))
    waiting = with_hovers(flown, dict.fromkeys(flown.halts.values(), 1.0))
    assert waiting.corridor is not None
    assert len(waiting.path) == len(waiting.corridor) == len(flown.path) + 1
    times = conflict_resolution._at_times  # pyright: ignore[reportPrivateUsage]
    assert [robot.path for (robot,) in times((flown,))] == [flown.planned, flown.path]
    assert [robot.path for (robot,) in times((waiting,))] == [waiting.path]


def test_a_patrol_has_the_pace_that_is_asked() -> None:
    plan = patrol_plan()
    fast, nominal = refine(plan, pace=1), refine(plan, pace="nominal")
    assert_holds(plan, fast)
    assert lasts(fast) < 0.6 * lasts(nominal)


LAPS = """
format: 1
name: laps
vehicle: crazyflie-2.1
workspace: {min: [-3, -3, 0.2], max: [3, 3, 2.2]}
regions:
  a: {center: [1.5, 1.2, 1.0], radii: [0.3, 0.3, 0.3]}
  b: {center: [-1.5, 1.2, 1.0], radii: [0.3, 0.3, 0.3]}
  d: {center: [-1.5, -1.4, 1.2], radii: [0.3, 0.3, 0.3]}
"""


@pytest.mark.slow
def test_a_flight_that_its_heading_slows_down_is_faster_than_its_nominal_times() -> None:
    text = LAPS + "agents: {q: {start: [0, 0, 1], heading: path}}\nspec: {formula: G F a & G F d, trace: infinite, repeat: 3}\n"
    plan, said = ltlplan.plan(ltlplan.parse_mission(text)), list[str]()
    nominal, fastest = refine(plan, pace="nominal"), refine(plan, pace=1, note=said.append)
    assert_holds(plan, fastest)
    assert not said
    assert lasts(fastest) < 0.6 * lasts(nominal)
    assert lasts(refine(plan)) < lasts(nominal)


@given_few(
    1, 30, st.integers(0, 10_000), st.sampled_from(["path", "fixed", (0.5, 0.5, 1.0)]), st.sampled_from([15.0, 60.0, 200.0])
)
def test_flights_that_turn_are_judged_and_faster_than_their_nominal_times(seed: int, heading: Any, rate: float) -> None:
    rng = np.random.default_rng(seed)
    angles = rng.uniform(0.0, 2.0) + rng.permutation(4) * (np.pi / 2)  # places apart, in an order that turns back
    places = [(1.6 * np.cos(angle), 1.6 * np.sin(angle)) for angle in angles]
    agents = {"q": Agent(start=(*places[0], 1.0), heading=heading, yaw_deg=rng.uniform(-180.0, 180.0))}
    regions = {name: ball(*place) for name, place in zip("abc", places[1:], strict=True)}
    mission = room(regions, agents, limits=Limits(yaw_rate_deg=rate))
    order = "abcab"[: rng.integers(2, 6)]
    points = [(*places["abc".index(name) + 1], 1.0) for name in order]
    plan = Plan(mission=mission, robots={"q": straight((*places[0], 1.0), *points, visits=dict(enumerate(order, start=1)))})
    nominal, usual, fastest = (refine(plan, pace=pace) for pace in ("nominal", 0.7, 1))
    assert_holds(plan, usual)
    assert_holds(plan, fastest)
    assert lasts(fastest) < 0.95 * lasts(nominal)
    own = nominal["q"]
    turns = np.degrees(np.abs(own.evaluate(np.arange(0.0, own.duration, 0.002), 1)[:, 3]).max())
    if turns < 0.7 * rate:  # else the nominal flight uses more of what there is than a share of 0.7
        assert lasts(usual) < lasts(nominal)


@pytest.mark.slow
def test_only_pieces_that_turn_are_given_more_time() -> None:
    """It flies straight on for most of its way, then back beside it."""
    agents = {"q": Agent(start=(-2.5, 0.0, 1.0), heading="path")}
    mission = room({"a": ball(2.4, 0.0), "b": ball(0.9, 0.5, 0.2)}, agents, limits=Limits(yaw_rate_deg=60.0))
    way = [(x, 0.0, 1.0) for x in (-2.5, -1.25, 0.0, 1.2, 2.4)]
    robot = straight(*way, (0.9, 0.5, 1.0), visits={4: "a", 5: "b"})
    plan = Plan(mission=mission, robots={"q": robot})
    own = plan.changed(mission=mission.changed(agents={"q": Agent(start=(-2.5, 0.0, 1.0))}))
    turning, straight_on = refine(plan, pace=1)["q"], refine(own, pace=1)["q"]
    assert turning.duration > 1.2 * straight_on.duration
    slower = turning.durations / straight_on.durations
    assert slower[:2].max() < 0.8 * slower[3:].max()


@pytest.mark.slow
def test_a_fast_flight_is_cut_into_parts_where_a_nominal_one_is() -> None:
    """Within the second in which it would slow down it flies more pieces than its vehicle holds."""
    text = LAPS + "agents: {q: {start: [0, 0, 1]}}\nlimits: {pieces: 6}\n"
    text += "spec: {formula: G F a & G F b & G F d, trace: infinite, repeat: 3}\n"
    plan = ltlplan.plan(ltlplan.parse_mission(text))
    nominal, fastest = refine(plan, pace="nominal", too_long="rest"), refine(plan, pace=1, too_long="rest")
    assert_holds(plan, fastest)
    assert fastest["q"].cuts
    assert lasts(fastest) < lasts(nominal)


@pytest.mark.slow
def test_a_flight_in_parts_is_no_slower_than_its_nominal_times(monkeypatch: pytest.MonkeyPatch) -> None:
    text = LAPS + "agents: {q: {start: [0, 0, 1]}}\nlimits: {pieces: 6}\nspec: {formula: F (a & F (d & F b))}\n"
    plan, said = ltlplan.plan(ltlplan.parse_mission(text)), list[str]()
    nominal, fastest = (refine(plan, pace=pace, too_long="rest") for pace in ("nominal", 1))
    assert nominal["q"].cuts
    assert fastest["q"].cuts
    assert lasts(fastest) < lasts(nominal)
    cut = parts.resting

    def slowly(paths: dict[str, Spline], *args: Any) -> Resting:
        long = lasts(nominal) if paths["q"].duration < 0.9 * float(plan.robots["q"].times[-1]) else 0.0
        found = cut(paths, *args)
        return Resting({name: path.stretched(1.0 + long / path.duration) for name, path in found.paths.items()}, found.cuts)

    monkeypatch.setattr(parts, "resting", slowly)
    assert refine(plan, pace=1, too_long="rest", note=said.append) == nominal
    assert any("longer in parts than at the plan's own times" in sentence for sentence in said)


def test_robots_that_end_in_one_region_end_where_the_plan_has_them_apart() -> None:
    """From two sides both would stop at the near edge, where the nearer one of them is in the other's way."""
    wide = Region(center=(1.0, 0.0, 1.0), radii=(0.8, 0.8, 0.3))
    agents = {name: Agent(start=(-1.5, y, 1)) for name, y in (("q0", 0.5), ("q1", -0.5))}
    mission = room({"wide": wide}, agents, separation=0.3)
    ends = {name: (1.0, y, 1.0) for name, y in (("q0", 0.35), ("q1", -0.35))}
    robots = {name: straight(agents[name].start, ends[name], visits={1: "wide"}) for name in agents}
    plan = Plan(mission=mission, robots=robots)
    team = refine(plan, pace=1)
    assert_holds(plan, team)
    for name, flight in team.items():
        np.testing.assert_allclose(flight.evaluate(np.array([flight.duration]))[0, :3], ends[name], atol=1e-4)
    alone = refine(Plan(mission=room({"wide": wide}, {"q0": agents["q0"]}), robots={"q0": robots["q0"]}), pace=1)
    assert lasts(alone) < lasts(team)


OVERLAPPING = """
format: 1
name: overlapping
vehicle: crazyflie-2.1
limits: {speed: 1.0}
workspace: {min: [-3, -3, 0.2], max: [3, 3, 2.2]}
regions:
  a: {center: [1.0, 0.6, 1.0], radii: [0.6, 0.6, 0.5]}
  b: {center: [1.7, 0.6, 1.0], radii: [0.6, 0.6, 0.5]}
"""


@few_of(
    1,
    ("world", "start", "spec"),
    [
        (OVERLAPPING, [1.7, -1.0, 1.0], "{formula: F (a & F (b & !a)), trace: finite}"),
        (LAPS, [1.5, 1.2, 1.0], "{formula: F G free, trace: infinite}"),  # at its start it is in a
    ],
)
def test_labels_change_in_the_order_of_the_nominal_flight(world: str, start: list[float], spec: str) -> None:
    plan = ltlplan.plan(ltlplan.parse_mission(f"{world}agents: {{q: {{start: {start}}}}}\nspec: {spec}\n"))
    said = list[str]()
    nominal, fastest = refine(plan, pace="nominal"), refine(plan, pace=1, note=said.append)
    assert_holds(plan, nominal)
    assert_holds(plan, fastest)
    assert not said
    assert lasts(fastest) < 0.9 * lasts(nominal)


def test_a_lap_of_a_team_ends_where_it_began_in_a_region_that_it_visits_there() -> None:
    text = """
format: 1
name: back
vehicle: crazyflie-2.1
workspace: {min: [-2.4, -2.3, 0.2], max: [2.4, 2.3, 2.8]}
regions: {a: {center: [0.309, 1.056, 0.942], cylinder: {radius: 0.382, height: 0.611}}}
hoops: {b: {center: [-1.058, 1.597, 1.766], yaw_deg: 351, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}}
agents: {q0: {start: [1.034, 0.578, 1.039]}, q1: {start: [-1.052, -1.0, 1.471]}}
margin: 0.03
spec: {formula: G F a & G F b, team: joint, trace: infinite}
"""
    plan = ltlplan.plan(ltlplan.parse_mission(text))
    assert_holds(plan, refine(plan, pace=1))


@pytest.mark.slow
def test_a_step_of_the_search_that_goes_much_too_far_is_taken_back() -> None:
    """Legs that must be slow beside legs that need not: durations once became so different that no spline was found."""
    text = """
format: 1
name: slow-legs
vehicle: crazyflie-2.1
workspace: {min: [-2.787, -2.606, 0.2], max: [2.787, 2.606, 2.2]}
regions:
  a: {center: [2.182, -0.773, 0.9], radii: [0.14, 0.145, 0.112], yaw_deg: 54}
  c: {union: [{center: [1.171, 1.263, 1.254], size: [0.864, 0.864, 0.864]}, {center: [1.361, 1.463, 1.305], radii: [0.432, 0.432, 0.432]}]}
hoops: {b: {center: [1.672, 0.057, 0.879], yaw_deg: 174, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}}
agents: {q0: {start: [-0.886, 0.925, 1.602]}}
limits: {legs: {a: {speed: 0.113, acceleration: 0.291}}}
margin: 0.002
separation: 0.3
spec: {formula: 'G F b & G F c & G F a', team: joint, trace: infinite, repeat: 2}
"""
    plan = ltlplan.plan(ltlplan.parse_mission(text))
    fast = refine(plan, pace=1)
    assert_holds(plan, fast)
    assert lasts(fast) < 0.5 * lasts(refine(plan, pace="nominal"))


@pytest.mark.slow
@few_of(1, "make", [fire_plan, sequence_plan])
def test_flights_that_are_wanted_soon_are_found_without_programmes_of_free_states(
    make: Callable[[], Plan], monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = make()
    full, nominal = refine(plan), refine(plan, pace="nominal")
    monkeypatch.setattr(time_optimised, "optimise", None)
    soon = refine(plan, effort="soon")
    assert_holds(plan, soon)
    assert lasts(full) <= lasts(soon) < lasts(nominal)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["door-puzzle", "wall-swap", "meeting", "office"])
def test_shipped_teams_are_certified_at_the_greatest_pace(name: str) -> None:
    plan = ltlplan.plan(name)
    fastest = refine(plan, pace=1, too_long="rest")
    assert_holds(plan, fastest)
    assert lasts(fastest) < 0.75 * lasts(refine(plan, pace="nominal", too_long="rest"))


def task_of(plan: Plan) -> tuple[Task, Fitted]:
    """Return a robot's part of a plan, and its flight at the plan's own times."""
    from refine.corridor.planned import corridor_of

    (name, robot), *_ = plan.robots.items()
    limits = FlightLimits.of_mission(plan.mission, name)
    corridor = corridor_of(plan.mission, name, robot)
    task = Task(plan.mission, name, robot, corridor, limits, 0.0, RefinementOptions(1.0, 1e3, None))
    return task, showing_visits(task, frozenset())


@pytest.mark.parametrize("weight", [None, 100.0])
def test_the_gradient_of_the_search_for_least_time_is_that_of_finite_differences(weight: float | None) -> None:
    task, fitted = task_of(sequence_plan())
    legs = frozenset(range(len(task.corridor)))
    start = least_time.Guess(fitted.motion.path.durations, fitted.motion.path.nodes)
    search = least_time.Search(task, fitted.rest, monotone_rules(task.corridor, legs), start, weight)
    rng = np.random.default_rng(0)
    at = search.packed(least_time.Guess(0.4 * start.durations, start.points))
    at = at + 0.05 * rng.normal(size=at.shape)
    way, step = rng.normal(size=at.shape), 1e-7
    found = (search(at + step * way)[0] - search(at - step * way)[0]) / (2 * step)
    assert found == pytest.approx(float(search(at)[1] @ way), rel=1e-4)


def test_a_faster_clock_keeps_limits_and_the_order_of_a_team() -> None:
    plan = fire_plan()
    nominal = refine(plan, pace="nominal")
    limits = {name: FlightLimits.of_mission(plan.mission, name) for name in plan.robots}
    tasks = {name: task_of(plan.model_copy(update={"robots": {name: plan.robots[name]}})) for name in ("quad0", "quad2")}
    team = {name: Flown(fitted.motion.path, 0.5, limits[name], 1.0) for name, (_, fitted) in tasks.items()}
    found = on_faster_clock(team)
    factor = max(stretch_to_limits(path, None, limits[name], faster=True) for name, (path, _) in found.items())
    assert factor < 1.2  # what is left of breaches
    assert factor * max(start + path.duration for path, start in found.values()) < 0.75 * lasts(nominal)
    for name, (path, start) in found.items():
        assert start == pytest.approx(next(iter(found.values()))[1])
        np.testing.assert_allclose(path.nodes[[0, -1]], team[name].path.nodes[[0, -1]])


def test_a_team_is_slowed_where_it_strays_and_nowhere_else() -> None:
    plan = sequence_plan()
    flight = refine(plan, pace=1)
    slow = slowed_at(flight, [Dip(3.0, 1.5)])
    assert_holds(plan, slow)
    assert 1.02 * lasts(flight) < lasts(slow) < 1.3 * lasts(flight)
    early = np.linspace(0.0, 0.5, 20)
    np.testing.assert_allclose(slow["quad0"].evaluate(early), flight["quad0"].evaluate(early), atol=2e-2)
    laps = refine(patrol_plan(), pace=1)
    slower = slowed_at(laps, [Dip(1.0, 1.25)])
    assert lasts(slower) == pytest.approx(1.25 * lasts(laps), rel=1e-3)
    assert_holds(patrol_plan(), slower)


@pytest.mark.slow
def test_the_same_plan_gives_the_same_bytes() -> None:
    """It comes last, as the tests before take what is remembered of each other's flights."""
    plan = sequence_plan()
    first = refine(plan, pace=1)
    time_optimised.forget()
    ipopt_engine.forget()
    assert refine(plan, pace=1) == first
