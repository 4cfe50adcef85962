"""The exact method under a mission's own costs, against every assignment and every order."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ltlplan
from ltlplan.allocation import Context, Itinerary
from ltlplan.paths import k_best_words
from ltlplan.paths.costs import team_cost
from ltlplan.paths.improvement import improved_path
from ltlplan.paths.nominal import lay_path
from ltlplan.report.summary import plan_lines
from ltlplan.search.exact import assign
from ltlplan.systems.objective import objective_text
from ltlplan.systems.visit_words import word_of
from tests.helpers.missions.worlds import world
from tests.helpers.packages import install
from verify.data import Mission, Visit, parse_mission

TERMS = """
def climb(paths):
    import numpy as np
    return np.maximum(np.diff(paths.position[:, :, 2], axis=1), 0.0).sum(axis=1)

def gain(paths):
    return -paths.length
"""


def team(first: str, second: str, *, formula: str = "F a & F b & F c", objective: str = "sum", more: str = "") -> Mission:
    """Return a mission of two robots with weights of their own over three regions, searched in a few rounds."""
    return parse_mission(f"""
format: 1
name: weights
spec: {{formula: "{formula}"}}
regions:
  a: {{center: [1.2, 0.9, 1], radii: [0.2, 0.2, 0.2]}}
  b: {{center: [0.4, -0.9, 1.3], radii: [0.2, 0.2, 0.2]}}
  c: {{center: [-1.2, 0, 1], radii: [0.2, 0.2, 0.2]}}
agents:
  quad0: {{start: [-0.5, -1.7, 1], cost: {{{first}}}}}
  quad1: {{start: [1.5, 1.7, 1], cost: {{{second}}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-2, -2, 0.2], max: [2, 2, 2]}}
planner: {{objective: {objective}, samples: 20, iterations: 2{more}}}
""")


def everything(mission: Mission) -> Iterator[dict[str, tuple[str, ...]]]:
    """Yield every way to share visits of all regions, once each, in every order."""
    for order in itertools.permutations(mission.all_regions):
        for cut in range(len(order) + 1):
            yield dict(zip(mission.agents, (order[:cut], order[cut:]), strict=True))


def metres(mission: Mission, robot: str, regions: tuple[str, ...]) -> float:
    points = [mission.agents[robot].start, *(mission.all_regions[region].center for region in regions)]
    return sum(math.dist(a, b) for a, b in itertools.pairwise(points))


@pytest.mark.parametrize("objective", ["sum", "longest"])
@pytest.mark.parametrize(
    ("first", "second"),
    [("length: 5", "length: 5"), ("length: 4", "time: 0.5"), ("length: 1, time: 1", "length: 0.2"), ("time: 2", "time: 2")],
)
def test_length_and_time_are_minimised_exactly(first: str, second: str, objective: str) -> None:
    mission = team(first, second, objective=objective)

    def cost(robot: str, regions: tuple[str, ...]) -> float:
        weights = mission.weights_of(robot)
        far = metres(mission, robot, regions)
        greatest = mission.planner.pace * mission.limits_of(robot).speed  # time is flown at the mission's pace
        return weights.get("length", 0.0) * far + weights.get("time", 0.0) * far / greatest

    best = min(team_cost(mission, [cost(*own) for own in shared.items()]) for shared in everything(mission))
    found = assign(mission)
    assert (found.cost, found.lower_bound) == (pytest.approx(best), pytest.approx(best))
    assert found.complete
    own = [cost(name, tuple(visit.region for visit in does.visits)) for name, does in found.robots.items()]
    assert own == pytest.approx([does.cost for does in found.robots.values()])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("first", "second", "objective"),
    [("effort: 40", "effort: 1", "sum"), ("effort: 1", "energy: 1", "sum"), ("length: 1, effort: 2", "effort: 2", "longest")],
)
def test_other_terms_are_minimised_among_all_ways_to_share(first: str, second: str, objective: str) -> None:
    mission = team(first, second, objective=objective)
    made = ltlplan.plan(mission)
    seed = int(np.random.default_rng(mission.planner.seed).integers(2**63))

    def cost(robot: str, regions: tuple[str, ...]) -> float:
        visits = tuple(Visit(region=region) for region in regions)
        nominal, _ = lay_path(mission, robot, Itinerary(visits, word_of(mission, robot, visits)))
        return improved_path(mission, robot, nominal, lambda: np.random.default_rng(seed)).plan.cost

    costs = {own: cost(*own) for shared in everything(mission) for own in shared.items()}
    assert made.cost <= min(team_cost(mission, [costs[own] for own in shared.items()]) for shared in everything(mission)) * 1.01
    assert made.lower_bound is not None
    assert made.lower_bound < made.cost
    assert made.cost == pytest.approx(team_cost(mission, [path.cost for path in made.robots.values()]))


@pytest.mark.parametrize(
    ("first", "second"),
    [("effort: 40", "effort: 1"), pytest.param("length: 1, snap: 0.1", "effort: 1", marks=pytest.mark.slow)],
)
@pytest.mark.slow
def test_no_plan_costs_more_than_that_of_mtac_e(first: str, second: str) -> None:
    mission = team(first, second, formula="F a & F b")
    exact, sampled = (ltlplan.plan(mission, method=method) for method in ("exact", "mtac-e"))
    assert exact.cost <= sampled.cost
    assert sampled.lower_bound == exact.lower_bound


def test_a_dear_robot_that_is_nearest_stays_where_it_is() -> None:
    made = ltlplan.plan(team("effort: 40", "effort: 1", formula="F c"))
    assert [[visit.region for visit in robot.visits] for robot in made.robots.values()] == [[], ["c"]]
    assert made.notes[-1] == "Minimised: the robots' sum, quad0: 40 effort; quad1: 1 effort."
    assert any(
        "wherever regions are touched, no assignment costs less than" in line and "the gap is" in line
        for line in plan_lines(made)
    )


def test_a_bound_by_middles_and_one_for_all_paths_are_told_apart() -> None:
    lines = plan_lines(ltlplan.plan("firefighting"))
    assert sum("straight" in line for line in lines) == 1
    assert any("By straight legs between middles the assignment is the cheapest" in line for line in lines)


@pytest.mark.parametrize(("complete", "order"), [(False, ["a", "b"]), (True, ["b", "a"])])
def test_what_was_found_unproved_is_taken_only_where_its_legs_between_edges_are_shorter(
    complete: bool, order: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A path that happens to be smoother does not make up for a longer route, unless nothing is shorter for sure."""
    mission = world("F a & F b", regions={"a": (1.0, 0.0), "b": (4.0, 0.0)}, radii={"a": 0.5, "b": 0.5}, starts=((-2.0, 0.0),))
    nearest = k_best_words.exact_by_legs(mission, Context(np.random.default_rng(0)))
    visits = (Visit(region="b"), Visit(region="a"))
    does = replace(nearest.robots["quad0"], visits=visits, word=word_of(mission, "quad0", visits))
    longer = replace(nearest, robots={"quad0": does}, complete=complete, lower_bound=0.0)
    monkeypatch.setattr("ltlplan.paths.k_best_words._Shut.cheapest", lambda *_: longer)  # stands for a search that was stopped
    monkeypatch.setattr("ltlplan.paths.k_best_words._Prices.of", lambda _, found: 1.0 if found is longer else 2.0)
    found = k_best_words.exact(mission, Context(np.random.default_rng(0)))
    assert [visit.region for visit in found.robots["quad0"].visits] == order


def test_what_is_minimised_is_said_unless_it_is_length() -> None:
    assert objective_text(team("length: 1", "length: 1")) is None
    assert objective_text(team("length: 2, time: 0", "length: 2")) == "the robots' sum, 2 length"
    assert objective_text(team("length: 1", "length: 1", objective="longest")) == "the robot that costs most, 1 length"


@pytest.mark.slow
def test_a_term_of_another_package_is_minimised_and_counted_as_nothing_in_the_bound(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    terms = {name: f"brings_terms:{name}" for name in ("climb", "gain")}
    install(tmp_path, monkeypatch, "brings_terms", TERMS, {"ltlplan.cost_terms": terms})
    made = ltlplan.plan(team("length: 1, climb: 100", "length: 1.5", formula="F b"))
    assert [bool(robot.visits) for robot in made.robots.values()] == [False, True]
    assert "The lower bound counts climb as 0." in made.notes
    gained = ltlplan.plan(team("length: 3, gain: 1", "length: 3, gain: 1", formula="F b"))
    assert gained.lower_bound is None
    assert "gain was below 0: no bound on costs is known." in gained.notes


@pytest.mark.slow
def test_laps_and_meetings_are_chosen_by_the_costs_of_their_paths_with_a_bound() -> None:
    for formula, trace in (
        ("F(count(a) >= 2) & F b & F c", "finite"),
        ("G F(count(a) >= 2) & G F quad0.b & G F quad1.c", "infinite"),
    ):
        mission = world(formula, robots=2, trace=trace, team="joint", radii={"a": 0.6}, objective="sum, cost: {effort: 1.0}")
        planned = ltlplan.plan(mission)
        assert planned.lower_bound is not None
        assert 0.0 < planned.lower_bound < planned.cost
        assert not planned.complete
        assert "Minimised: the robots' sum, 1 effort." in planned.notes
        assert any("priced by their paths" in note for note in planned.notes)
