"""Whole plans: what comes back passes the judge."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flight
import verify
from refine import refine
from refine import team as refined_teams
from refine.corridor import planned
from refine.corridor.planned import corridor_of
from refine.corridor.points import thinned
from refine.single_robot import time_optimised
from refine.single_robot.task import Pace
from refine.spline.spline import Spline
from tests.helpers.few import few_of
from tests.helpers.missions.random_missions import random_mission
from tests.helpers.motion.plans_by_hand import ball, fire_plan, patrol_plan, robot_plan, room, sequence_plan, straight
from verify.data import DoesNotFit, Infeasible, Mission, Plan, RobotPlan, Visit, Waypoint, Witness, Word
from verify.data.plan import Precedence
from verify.data.sections import Agent, Box, LegLimits, Limits, Spec
from verify.data.shapes.region import Hoop, Region
from verify.data.vehicle import load_vehicle


@few_of(1, "make", [sequence_plan, patrol_plan, fire_plan])
def test_what_comes_back_is_certified(make) -> None:
    plan = make()
    team = refine(plan)
    assert list(team) == list(plan.robots)
    assert all(flight.is_float32 for flight in team.values())
    certificate = verify.judge(plan, team, largest=False)
    assert [claim.sentence for claim in certificate.claims if claim.outcome != "holds"] == []


@pytest.mark.slow
def test_a_patrol_closes_and_may_be_time_optimised() -> None:
    plan = patrol_plan()
    slow, fast = refine(plan)["quad0"], refine(plan, pace="time")["quad0"]
    assert fast.duration < 0.8 * slow.duration
    assert verify.judge(plan, {"quad0": fast}, largest=False).holds
    for derivative, jump in enumerate((1e-6, 1e-4, 1e-3, 1e-2)):
        ends = fast.derivative_coefficients(derivative)
        last = (ends[-1] * fast.durations[-1] ** np.arange(ends.shape[-1])).sum(axis=-1)
        np.testing.assert_allclose(last, ends[fast.cycle][:, 0], atol=jump)


@few_of(1, "seed", [0, 6, 12, 28])
def test_random_missions_are_certified(seed: int, pace: Pace) -> None:
    """Some of these need what repairs are for: a path that comes back into a region, robots that hover in the way."""
    import ltlplan

    plan = ltlplan.plan(random_mission(seed, samples=20, rounds=2), seed=0)
    certificate = verify.judge(plan, refine(plan, pace=pace), largest=False)
    assert [claim.sentence for claim in certificate.claims if claim.outcome != "holds"] == []


def test_a_region_in_the_way_is_flown_around() -> None:
    mission = room({"wall": ball(0, 0), "goal": ball(1.5, 0)}, {"q": Agent(start=(-1.5, 0.0, 1.0))})
    plan = Plan(mission=mission, robots={"q": straight((-1.5, 0, 1), (1.5, 0, 1), visits={1: "goal"})})
    flight = refine(plan)["q"]
    times = np.linspace(0, flight.duration, 2000)
    assert np.sqrt(mission.regions["wall"].level(flight.evaluate(times)[:, :3])).min() >= 1 + 0.05 / 0.3
    assert verify.judge(plan, {"q": flight}, largest=False).holds


def test_yaw_follows_the_path_and_looks_at_a_point() -> None:
    corners = [(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1), (-1, -0.5, 1)]
    for heading in ("path", (0.0, 0.0, 1.0)):
        mission = room({"far": ball(2.5, 2.5)}, {"q": Agent(start=(-1.0, -1.0, 1.0), heading=heading)})
        plan = Plan(mission=mission, robots={"q": straight(*corners)})
        flight = refine(plan)["q"]
        assert verify.judge(plan, {"q": flight}, largest=False).holds
        times = np.linspace(0.35, 0.9, 40) * flight.duration
        at, yaw = flight.evaluate(times), flight.evaluate(times)[:, 3]
        wanted = flight.evaluate(times, 1)[:, :2] if heading == "path" else -at[:, :2]
        off = np.angle(np.exp(1j * (yaw - np.arctan2(wanted[:, 1], wanted[:, 0]))))
        assert np.abs(off).mean() < 0.35
        assert np.abs(np.diff(flight.evaluate(np.linspace(0, flight.duration, 4000))[:, 3])).max() < 0.05


def test_legs_keep_limits_of_their_own() -> None:
    slow = Limits(legs={"b": LegLimits(speed=0.25)})
    mission = room({"a": ball(0, 0), "b": ball(1.5, 0)}, {"q": Agent(start=(-1.5, 0.0, 1.0))}, limits=slow)
    plan = Plan(mission=mission, robots={"q": straight((-1.5, 0, 1), (0, 0, 1), (1.5, 0, 1), visits={1: "a", 2: "b"})})
    flight = refine(plan)["q"]
    certificate = verify.judge(plan, {"q": flight}, largest=False)
    assert [claim.sentence for claim in certificate.claims if claim.outcome != "holds"] == []
    everywhere = plan.changed(mission=mission.changed(limits=Limits(speed=0.25)))
    assert flight.duration <= 1.03 * refine(everywhere)["q"].duration  # no slower than if all legs had the limit of one


@pytest.mark.parametrize("visits", [{3: "b"}, {1: "a", 4: "b"}])
def test_a_leg_with_points_on_the_way_keeps_its_limits_from_where_it_begins(visits: dict[int, str]) -> None:
    slow = Limits(legs={"b": LegLimits(speed=0.25, acceleration=0.5)})
    points = np.linspace(-1.5, 1.5, max(visits) + 1)
    regions = {name: ball(float(points[index]), 0) for index, name in visits.items()}
    mission = room(regions, {"q": Agent(start=(-1.5, 0.0, 1.0))}, limits=slow)
    plan = Plan(mission=mission, robots={"q": straight(*((float(x), 0, 1) for x in points), visits=visits)})
    flight = refine(plan)["q"]
    certificate = verify.judge(plan, {"q": flight}, largest=False)
    assert [claim.sentence for claim in certificate.claims if claim.outcome != "holds"] == []


def test_where_a_programme_fails_the_best_valid_flight_stands_with_a_note(monkeypatch: pytest.MonkeyPatch) -> None:
    mission = room({"a": ball(0, 0)}, {"q": Agent(start=(-1.5, 0.0, 1.0))})
    plan = Plan(mission=mission, robots={"q": straight((-1.5, 0, 1), (0, 0, 1), (1.0, 1.1, 1), visits={1: "a"})})
    nominal, notes = refine(plan, pace="nominal")["q"], []
    quickest = refine(plan, pace=1, note=notes.append)["q"]
    assert notes == []

    def hopeless(_problem: object) -> Spline:
        raise Infeasible("maximum iterations exceeded")

    time_optimised.forget()
    monkeypatch.setattr(time_optimised, "optimise", hopeless)
    fitted = refine(plan, pace=1, note=notes.append)["q"]
    assert notes == ["q: a faster flight was looked for and not found: maximum iterations exceeded"]
    assert quickest.duration < fitted.duration < 0.6 * nominal.duration
    assert verify.judge(plan, {"q": fitted}, largest=False).holds

    time_optimised.forget()
    monkeypatch.setattr(time_optimised, "solve", hopeless)
    sped_up = refine(plan, pace=1, note=notes.append)["q"]
    assert fitted.duration <= sped_up.duration < nominal.duration
    assert verify.judge(plan, {"q": sped_up}, largest=False).holds
    time_optimised.forget()


@pytest.mark.slow
@pytest.mark.parametrize("shares", [(0.0, 1e-13, 1e-4)])
def test_an_answer_that_no_longer_gets_better_is_taken_before_its_multipliers_rest(shares, shipped_run) -> None:
    """With points free in their rooms the multipliers of this mission's blend may go back and forth for ever.

    The flight must not hang on a platform's last digits: starts that differ in them, or in the fourth, end in it as well.
    """
    run = shipped_run("hoops-ltl")
    plan = run.plan
    robot = plan.robots["quad0"]
    rng = np.random.default_rng(0)
    durations = []
    for share in shares:
        times = robot.times * (1.0 + share * rng.random(len(robot.times)))
        near = plan.model_copy(update={"robots": {"quad0": robot.model_copy(update={"times": tuple(map(float, times))})}})
        flight = refine(near, pace="blend", weight=100.0)["quad0"]
        assert verify.judge(near, {"quad0": flight}, largest=False).holds
        durations.append(flight.duration)
    assert max(durations) < 0.75 * refine(plan, pace="nominal")["quad0"].duration
    assert max(durations) < 1.02 * min(durations)


@pytest.mark.slow
def test_visits_of_time_optimised_flights_may_be_anywhere_in_their_rooms(monkeypatch: pytest.MonkeyPatch) -> None:
    """A region's point moves within the region less the margin, a passage's across the hoop's axis."""
    mission = room({"a": ball(0, 0.5, 0.4)}, {"q": Agent(start=(-1.5, 0.0, 1.0))})
    hoop = Hoop(center=(1.2, 0.0, 1.0), radii=(0.3, 0.3, 0.3), opening=0.28, rim=0.02)
    mission = mission.model_copy(update={"hoops": {"h": hoop}})
    points = [(-1.5, 0, 1), (0, 0.5, 1), (0.75, 0, 1), (1.2, 0, 1), (1.65, 0, 1), (2.2, -0.8, 1)]
    roles = ("start", "centre", "rear", "centre", "front", "via")
    visits = (None, 0, 1, 1, 1, None)
    waypoints = [
        Waypoint(position=tuple(map(float, point)), role=role, visit=visit, region=None if visit is None else "ah"[visit])
        for point, role, visit in zip(points, roles, visits, strict=True)
    ]
    plan = Plan(mission=mission, robots={"q": robot_plan(waypoints, (Visit(region="a"), Visit(region="h", direction="F")))})
    rooms = corridor_of(mission, "q", plan.robots["q"]).rooms
    assert [body is not None for body in rooms] == [False, True, True, True, True, False]
    fast = refine(plan, pace="time")["q"]
    certificate = verify.judge(plan, {"q": fast}, largest=False)
    assert [claim.sentence for claim in certificate.claims if claim.outcome != "holds"] == []
    assert np.linalg.norm(fast.coefficients[1, :3, 0] - [0, 0.5, 1]) > 0.1
    for node, body in enumerate(rooms):
        if body is not None:
            assert np.linalg.norm(body.root @ (fast.coefficients[node, :3, 0] - body.centre)) <= 1 + 1e-4
    monkeypatch.setattr(planned, "visit_room", lambda *_: None)
    assert fast.duration < 0.95 * refine(plan, pace="time")["q"].duration


def test_every_flight_has_two_pieces_at_least(tmp_path: Path) -> None:
    """Crazyswarm2's loader fails on files with one piece; its export then has nothing to add."""
    agents = {"still": Agent(start=(1.5, 1.5, 1.03)), "hop": Agent(start=(-1.5, 0.1, 1.0), heading=(0.0, 0.0, 1.0))}
    mission = room({"far": ball(2.5, -2.5)}, agents)
    plan = Plan(mission=mission, robots={"still": straight((1.5, 1.5, 1.03)), "hop": straight((-1.5, 0.1, 1), (0.7, 0.3, 1.2))})
    team = refine(plan, pace="nominal")
    assert [len(path) for path in team.values()] == [2, 2]
    assert team["still"].duration == 1.0
    assert all(path.is_float32 for path in team.values())
    np.testing.assert_array_equal(team["hop"].coefficients[1, :, 1:], 0.0)
    certificate = verify.judge(plan, team, largest=False)
    assert [claim.sentence for claim in certificate.claims if claim.outcome != "holds"] == []
    folder = flight.export(team, certificate, tmp_path / "out", force=True).folder
    assert all(len((folder / f"{name}.csv").read_text().splitlines()) == 3 for name in team)
    assert not any("second piece" in file.read_text() for file in folder.rglob("*.*"))


def test_a_departure_later_by_less_than_a_tick_is_no_hover(monkeypatch: pytest.MonkeyPatch) -> None:
    """Programmes for times leave some 1e-11 s; as a piece these could not be slowed down."""
    mission = room({"far": ball(2.5, -2.5)}, {"hop": Agent(start=(-1.5, 0.1, 1.0))})
    plan = Plan(mission=mission, robots={"hop": straight((-1.5, 0.1, 1), (-0.5, 0.3, 1.2), (0.7, 0.3, 1.2))})
    expected, found = refine(plan)["hop"], refined_teams.together
    monkeypatch.setattr(refined_teams, "together", lambda *asked: (found(*asked)[0], {"hop": 2e-11}))
    assert np.array_equal(refine(plan)["hop"].durations, expected.durations)


def test_a_patrol_that_only_hovers_has_two_pieces() -> None:
    mission = room({"far": ball(2.5, -2.5)}, {"still": Agent(start=(1.5, 1.5, 1.0))})
    point = Waypoint(position=(1.5, 1.5, 1.0), role="start")
    hovering = RobotPlan(word=Word.of([[]]), waypoints=(point, point), times=(0.0, 1.0), cycle_visit=0, cycle_waypoint=0)
    flight = refine(Plan(mission=mission, robots={"still": hovering}))["still"]
    assert (len(flight), flight.cycle, flight.duration) == (2, 0, 1.0)


def test_robots_wait_for_each_other(pace: Pace) -> None:
    mission = room({"a": ball(0, 0)}, {"p": Agent(start=(-1.5, 0.0, 1.0)), "q": Agent(start=(0.0, -1.5, 1.0))})
    robots = {
        "p": straight((-1.5, 0, 1), (0, 0, 1), (1.5, 0, 1), visits={1: "a"}),
        "q": straight((0, -1.5, 1), (0, 0, 1), (0, 1.5, 1), visits={1: "a"}),
    }
    plan = Plan(mission=mission, robots=robots, precedences=(Precedence(first=("q", 0), then=("p", 0)),))
    team = refine(plan, pace=pace)
    assert verify.judge(plan, team, largest=False).holds
    assert len(team["p"]) == len(team["q"]) + 1  # p hovers first
    gap = [np.linalg.norm(team["p"].evaluate(t)[:3] - team["q"].evaluate(t)[:3]) for t in np.linspace(0, 15, 600)]
    assert min(gap) >= 0.4


@few_of(1, "heading", ["fixed", "path"])
def test_robots_wait_in_the_middle_where_departures_do_not_suffice(heading: str, pace: Pace) -> None:
    """q's first visit after p's first, p's second after q's second: whoever departs first, the other has to wait for it."""
    agents = {"p": Agent(start=(-2.0, -1.0, 1.0), heading=heading), "q": Agent(start=(-2.0, 1.0, 1.0), heading=heading)}
    mission = room({"a": ball(-1, -1), "b": ball(1, -1), "c": ball(-1, 1), "d": ball(1, 1)}, agents)
    robots = {
        "p": straight((-2, -1, 1), (-1, -1, 1), (0, -1, 1), (1, -1, 1), (2, -1, 1), visits={1: "a", 3: "b"}),
        "q": straight((-2, 1, 1), (-1, 1, 1), (0, 1, 1), (1, 1, 1), (2, 1, 1), visits={1: "c", 3: "d"}),
    }
    waits = (Precedence(first=("p", 0), then=("q", 0)), Precedence(first=("q", 1), then=("p", 1)))
    plan = Plan(mission=mission, robots=robots, precedences=waits)
    team = refine(plan, pace=pace)
    certificate = verify.judge(plan, team, largest=False)
    assert [claim.sentence for claim in certificate.claims if claim.outcome != "holds"] == []
    times = np.linspace(0, max(flight.duration for flight in team.values()), 6000)
    inside = {
        (name, region): times[mission.regions[region].level(team[name].evaluate(times)[:, :3]) <= 1]
        for name, region in (("p", "a"), ("q", "c"), ("q", "d"), ("p", "b"))
    }
    assert inside["p", "a"].max() < inside["q", "c"].min()
    assert inside["q", "d"].max() < inside["p", "b"].min()
    circle = (*waits, Precedence(first=("p", 1), then=("q", 0)))
    with pytest.raises(Infeasible):
        refine(Plan(mission=mission, robots=robots, precedences=circle), pace=pace)


@pytest.mark.slow
def test_witnesses_tighten_what_was_refused() -> None:
    plan = sequence_plan()
    base = refine(plan)["quad0"]
    peak = np.linalg.norm(base.evaluate(np.linspace(0, base.duration, 4000), 1)[:, :3], axis=1).max()
    witness = Witness(claim="limits.speed", sentence="too fast", robot="quad0", bound=1.05, limit=1.0)
    again = refine(plan, witnesses=(witness,))["quad0"]
    slower = np.linalg.norm(again.evaluate(np.linspace(0, again.duration, 4000), 1)[:, :3], axis=1).max()
    assert slower <= min(peak, 1.0 / 1.05) + 1e-6
    near = (Witness(claim="visits", sentence="too near", robot="quad0"),) * 2
    nominal, wide = (refine(plan, witnesses=witnesses, pace="nominal")["quad0"] for witnesses in ((), near))
    assert verify.judge(plan, {"quad0": wide}, largest=False).holds
    assert wide.digest() != nominal.digest()


def test_the_same_plan_gives_the_same_bytes() -> None:
    first, second = refine(fire_plan()), refine(fire_plan())
    assert {name: flight.digest() for name, flight in first.items()} == {
        name: flight.digest() for name, flight in second.items()
    }


def test_pieces_are_merged_where_the_target_is_small(pace: Pace) -> None:
    plan = sequence_plan()
    few = refine(plan, max_pieces=11, pace=pace)["quad0"]
    assert len(few) <= 11 < len(refine(plan, pace=pace)["quad0"])
    assert verify.judge(plan, {"quad0": few}, largest=False).holds
    with pytest.raises(DoesNotFit, match="holds 3"):
        refine(plan, max_pieces=3, pace=pace)


def test_detours_do_not_pile_up() -> None:
    plan = sequence_plan()
    corridor = corridor_of(plan.mission, "quad0", plan.robots["quad0"])
    fewer = thinned(corridor, len(corridor) - 2)
    assert len(fewer) <= len(corridor) - 2
    assert fewer.durations.sum() == pytest.approx(corridor.durations.sum())
    for index, leg in enumerate(fewer.legs):
        for body in leg.obstacles:
            assert body.plane(fewer.points[index], fewer.points[index + 1]) is not None


def test_uneven_times_do_not_slow_a_whole_flight(pace: Pace) -> None:
    room = Region(center=(0.0, 0.0, 1.6), radii=(0.4, 0.4, 0.4))
    mission = Mission(
        name="climb",
        spec=Spec(formula="F room"),
        regions={"room": room},
        agents={"quad0": Agent(start=(-1.0, -1.0, 0.8))},
        vehicle=load_vehicle("crazyflie-2.1"),
        limits=Limits(speed=1.2),
        workspace=Box(min=(-3.0, -3.0, 0.2), max=(3.0, 3.0, 2.5)),
    )
    shares = (0.0, 1 / 6, 1 / 3, 1 / 2, 2 / 3, 0.7038, 1.0)
    times = (0.0, 1.79, 2.235, 2.59, 2.93, 3.01, 4.61)  # the leg into the room is given less than a tenth of a second
    start, goal = np.array(mission.agents["quad0"].start), np.array(room.center)
    points = [tuple((start + share * (goal - start)).tolist()) for share in shares]
    waypoints = (
        Waypoint(position=points[0], role="start"),
        *(Waypoint(position=point, role="via") for point in points[1:5]),
        Waypoint(position=points[5], role="via", region="room", visit=0),
        Waypoint(position=points[6], role="centre", region="room", visit=0),
    )
    robot = RobotPlan(word=Word.of([[], ["room"]]), visits=(Visit(region="room"),), waypoints=waypoints, times=times)
    plan = Plan(mission=mission, robots={"quad0": robot})
    team = refine(plan, pace=pace)
    assert verify.certify(plan, team)
    assert team["quad0"].duration <= 1.2 * times[-1]
    heights = team["quad0"].evaluate(np.linspace(0.0, team["quad0"].duration, 400))[:, 2]
    assert heights.min() > 0.8 - 0.01  # no swing behind the start
