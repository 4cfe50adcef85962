"""Lassos that end in a hover: planned, refined, certified, flown, written, proved again and exported like any other."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import ltlplan
from flight import export
from ltlplan import parse_mission
from ltlplan.paths.costs import cost_of, plan_cost
from ltlplan.paths.cross_entropy.cross_entropy import improve
from ltlplan.paths.final_hover import then_hovering, until_hover
from ltlplan.paths.hoops import route
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.pipeline import certified_team
from ltlplan.report.pictures import pictures_html
from tests.helpers.few import few_of
from tests.helpers.missions.random_missions import random_mission
from verify import check_word, recheck
from verify.data import Infeasible, Mission, Visit, mission_to_yaml
from verify.data.mission import check_mission
from verify.data.shapes.region import Hoop


def asking(formula: str, trace: str = "infinite", **changes: object) -> Mission:
    mission = ltlplan.load_mission("hoops-ltl")
    repeat = {"infinite": 2, "finite": 1}[trace]
    spec = mission.spec.model_copy(update={"formula": formula, "trace": trace, "repeat": repeat})
    quick = mission.planner.model_copy(update={"samples": 100, "iterations": 5})
    return check_mission(mission.model_copy(update={"spec": spec, "planner": quick, **changes}))


def test_a_cycle_of_one_piece_is_a_hover_at_rest():
    points = np.array([[0.0, 0.0, 1.0], [1.0, 0.4, 1.0], [1.5, -0.2, 1.2], [1.5, -0.2, 1.2]])
    spline, finite = LeastSnapSpline([0.0, 1.0, 2.0, 3.0], cycle=2), LeastSnapSpline([0.0, 1.0, 2.0])
    at = np.linspace(2.0, 3.0, 50)
    assert np.allclose(spline.evaluate(points, at), points[-1], atol=1e-12)
    early = np.linspace(0.0, 2.0, 50)
    assert np.allclose(spline.evaluate(points, early), finite.evaluate(points[:3], early), atol=1e-9)


@few_of(
    1,
    "formula",
    [
        "F hoop0 & F G free",  # through a hoop, then hover behind it
        "F(hoop0 & F G hoop1)",  # through one, then stay in another one
        "F G hoop0",
        pytest.param("F hoop1 & F hoop2 & F G !hoop2", marks=pytest.mark.slow),
    ],
)
def test_a_lasso_that_hovers_after_its_last_hoop_goes_all_the_way(formula: str, tmp_path: Path, pace):
    result = ltlplan.run(asking(formula), tmp_path / "run", pace=pace)
    (plan,), (flown,) = result.plan.robots.values(), result.team.values()
    assert plan.hovers
    assert plan.waypoints[-1].position == plan.waypoints[-2].position
    assert plan.word.cycle is not None
    assert check_word(result.mission.formula, plan.word.prefix, plan.word.cycle)
    assert all(claim.outcome == "holds" for claim in result.certificate.claims)
    assert recheck(tmp_path / "run").claims
    assert flown.cycle is not None
    lap = flown.evaluate(np.linspace(flown.knots[flown.cycle], flown.knots[-1], 20))[:, :3]
    assert np.ptp(lap, axis=0).max() < 1e-6  # it hovers
    stays = plan.word.cycle[0]
    for name, region in result.mission.all_regions.items():
        assert (float(region.level(lap[0])) <= 1.0) == (name in stays)
    assert export(result.team, result.certificate, tmp_path / "exported", format="crazyswarm2", force=True)


@few_of(1, "trace", ["finite", "infinite"])
def test_staying_in_a_hoop_does_not_fly_through_it(trace: str, pace):
    """Whoever stays in a hoop comes from one side and keeps clear of the opening, judged by samples of the flight."""
    mission = asking("F hoop2 & F G hoop1", trace)
    (flown,) = certified_team(ltlplan.plan(mission, pace=pace)).team.values()
    hoop = mission.hoops["hoop1"]
    offset = flown.evaluate(np.linspace(0.0, flown.knots[-1], 4000))[:, :3] - np.array(hoop.center)
    along = offset @ np.array(hoop.normal)
    across = np.linalg.norm(offset - along[:, None] * np.array(hoop.normal), axis=1)
    near = across <= hoop.opening + hoop.rim
    assert np.all(np.abs(along[near]) >= mission.margin)
    assert float(hoop.level(offset[-1] + np.array(hoop.center))) <= 1.0


def test_a_hoop_that_is_too_flat_to_stay_in_is_refused_in_words():
    mission = ltlplan.load_mission("hoops-ltl")
    flat = Hoop.model_validate({**mission.hoops["hoop0"].model_dump(exclude={"matrix"}), "radii": (0.09, 0.2, 0.2)})
    asked = asking("F G hoop0", hoops={**mission.hoops, "hoop0": flat})
    with pytest.raises(Infeasible, match="cannot stay in 'hoop0'"):
        ltlplan.plan(asked)


def test_improving_a_flight_that_hovers_improves_what_leads_there():
    mission = asking("F hoop0 & F G free")
    nominal = route(mission, "quad0", (Visit(region="hoop0"),), 1)
    assert nominal.hovers
    assert then_hovering(until_hover(nominal)) == nominal
    found = improve(mission, "quad0", nominal, rng=np.random.default_rng(0))
    assert found.plan.hovers
    assert found.plan.word == nominal.word
    assert found.cost < found.nominal
    assert found.history[-1] <= found.nominal
    assert found.cost == pytest.approx(plan_cost(found.plan, cost_of(mission, "quad0")))


@pytest.mark.slow
def test_pictures_of_a_lasso_that_hovers():
    assert "optimised path" in pictures_html(asking("F hoop0 & F G free"))


def test_a_round_that_reads_a_letter_twice_is_a_word_like_any_other() -> None:
    """Where it begins, the automaton may need one more reading of the region that the robot is in."""
    from ltlplan.search.exact import assign

    mission = parse_mission("""
format: 1
name: patrol
spec: {formula: "G F a & G F b", trace: infinite, repeat: 2}
regions:
  a: {center: [0.459, 0.787, 1.274], radii: [0.187, 0.191, 0.158]}
  b: {center: [1.199, -0.673, 0.725], radii: [0.244, 0.161, 0.163]}
  c: {center: [-1.069, 0.466, 1.103], radii: [0.237, 0.269, 0.212]}
agents: {q: {start: [-0.374, -0.222, 1.199]}}
vehicle: crazyflie-2.1
workspace: {min: [-1.6, -1.3, 0.2], max: [1.6, 1.3, 1.8]}
""")
    (robot,) = assign(mission).robots.values()
    assert {visit.region for visit in robot.visits[robot.cycle_visit :]} == {"a", "b"}


@few_of(3, "seed", range(12))
def test_a_patrol_costs_the_way_to_its_nearer_end_and_its_laps(seed: int) -> None:
    """Two regions, straight ways: no lap begins with a visit more than it needs."""
    from ltlplan.search.exact import assign

    mission = random_mission(seed, robots=1)
    first, second, *_ = mission.regions
    text = mission_to_yaml(mission).replace(f"formula: {mission.spec.formula}", f"formula: G F {first} & G F {second}")
    text = text.replace("trace: finite", "trace: infinite").replace("mtac-e", "exact")
    patrol = parse_mission(text)
    assert patrol.spec.formula == f"G F {first} & G F {second}"
    start, here, there = (
        np.array(point) for point in (patrol.agents["quad0"].start, patrol.regions[first].center, patrol.regions[second].center)
    )
    least = 2 * np.linalg.norm(here - there) + min(np.linalg.norm(start - here), np.linalg.norm(start - there))
    found = assign(patrol)
    (robot,) = found.robots.values()
    assert sorted(visit.region for visit in robot.visits) == sorted((first, second))
    assert math.isclose(found.cost, least, rel_tol=1e-9)
