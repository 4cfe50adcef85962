"""`method: online-mtac-e`: words, robots and waypoints are those of a team flown online in simulated time."""

from __future__ import annotations

import numpy as np
import pytest

import ltlplan
from ltlplan.online_mtac.online_team import OnlineTeam
from ltlplan.online_mtac.team_in_flight import PERIOD
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.planner import make_plan
from tests.conftest import Once
from tests.helpers.missions.random_missions import random_mission
from verify import check_team
from verify.data import BadInput, Mission, Plan, Unsatisfiable
from verify.data.sections import Planner


def by_online(mission: Mission, method: str = "online-mtac-e", **spec: object) -> Mission:
    planner = mission.planner.model_copy(update={"method": method})
    return mission.model_copy(update={"planner": planner, "spec": mission.spec.model_copy(update=spec)})


@pytest.fixture(scope="session")
def firefighting() -> Mission:
    return by_online(ltlplan.load_mission("firefighting"))


@pytest.fixture(scope="session")
def result(once: Once, firefighting: Mission) -> ltlplan.Result:
    return once("run of firefighting by online MTAC-E", lambda _folder: ltlplan.run(firefighting, seed=3, pace="nominal"))


@pytest.fixture(scope="session")
def plan(result: ltlplan.Result) -> Plan:
    return result.plan


def flown(mission: Mission, seed: int) -> tuple[OnlineTeam, dict[str, np.ndarray]]:
    """Fly a team on the papers' model, robots being where they are asked to be, until it has finished."""
    team = OnlineTeam(mission, rng=np.random.default_rng(seed), every_order=True)
    places = {name: [np.array(agent.start)] for name, agent in mission.agents.items()}
    for step in range(3000):
        desired = team.step(step * PERIOD, {name: tuple(track[-1]) for name, track in places.items()})  # type: ignore[misc]
        for j, name in enumerate(team.pilots):
            places[name].append(desired.flat[0, :3, j])
        if desired.finished:
            return team, {name: np.array(track) for name, track in places.items()}
    raise AssertionError("the team did not finish")


@pytest.mark.slow
def test_the_plan_is_what_the_online_team_flew(firefighting: Mission, plan):
    team, places = flown(firefighting, 3)
    assert plan.method == "online-mtac-e"
    for name, robot in plan.robots.items():
        letters = [team.first_letters[name], *(events[name] for _, events in team.shown if name in events)]
        assert list(robot.word.letters) == letters
        if robot.still:
            assert np.ptp(places[name], axis=0).max() < 1e-6
            continue
        path = LeastSnapSpline(robot.times).evaluate(
            [w.position for w in robot.waypoints], np.linspace(robot.times[0], robot.times[-1], 400)
        )
        away = np.linalg.norm(path[:, None] - places[name][None], axis=2).min(axis=1)
        assert away.max() < 0.03
        assert np.linalg.norm(path[-1] - places[name][-1]) < 1e-6
    assert check_team(firefighting.formula, plan.words).sequential


@pytest.mark.slow
def test_it_is_not_the_plan_of_another_method(firefighting: Mission, plan):
    for method in ("exact", "mtac-e"):
        other = ltlplan.plan(by_online(firefighting, method), seed=3)
        assert other.method == method
        assert other.robots != plan.robots


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_and_another_one_other_paths(firefighting: Mission, plan):
    assert ltlplan.plan(firefighting, seed=3).to_json() == plan.to_json()
    assert ltlplan.plan(firefighting, seed=4).robots != plan.robots


@pytest.mark.slow
def test_a_run_by_online_mtac_e_is_certified_and_flown(result: ltlplan.Result):
    assert result.certificate.holds
    assert result.log.satisfied


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 8))])
def test_words_hold_in_every_order_of_the_robots(seed: int):
    mission = by_online(random_mission(seed, samples=20, rounds=3))
    made = make_plan(mission, seed=seed)
    assert check_team(mission.formula, made.words).sequential


def test_a_team_that_must_hold_two_places_at_once_is_planned_online():
    mission = ltlplan.load_mission("firefighting")
    asked = by_online(mission, formula="F(loc1 & water)", team="joint")
    made = ltlplan.plan(asked, seed=0)
    assert check_team(asked.formula, made.words, team="joint").sequential


def test_what_the_method_cannot_do_is_refused_in_words(firefighting: Mission):
    with pytest.raises(BadInput, match=r"'online-mtac' is not a planning method\. Did you mean 'online-mtac-e'"):
        make_plan(by_online(firefighting, "online-mtac"))
    with pytest.raises(BadInput, match="'online-mtac'"):
        ltlplan.plan(by_online(firefighting, "online-mtac"))
    with pytest.raises(Unsatisfiable, match="loc1"):
        ltlplan.plan(by_online(firefighting, formula="F loc1 & G !loc1"))
    with pytest.raises(BadInput, match="method: exact"):
        ltlplan.plan(by_online(ltlplan.load_mission("hoops-ltl")))


@pytest.mark.parametrize("method", ["exact", "mtac-e", "online-mtac-e"])
def test_every_method_may_stand_in_a_mission_file(method: str):
    assert Planner(method=method).method == method
