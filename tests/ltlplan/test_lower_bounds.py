"""`Plan.lower_bound` is what it says: no plan has a smaller cost, in one unit, whatever the method and the terms of the cost."""

from __future__ import annotations

import pytest

import ltlplan
from tests.golden import mission_of
from tests.helpers.few import few_of
from tests.helpers.missions.random_missions import random_mission
from tests.helpers.missions.shipped import GOLDEN_MISSIONS
from verify.data import Mission

COSTS = ({"length": 1.0}, {"time": 1.0}, {"length": 0.5, "time": 1.0, "effort": 0.3}, {"energy": 1.0})


def assert_below(mission: Mission) -> None:
    made = ltlplan.plan(mission, seed=0)
    if made.lower_bound is not None:
        assert 0.0 <= made.lower_bound <= made.cost, (made.method, made.cost, made.lower_bound)


def asking(mission: Mission, method: str, cost: dict[str, float]) -> Mission:
    return mission.changed(planner=mission.planner.model_copy(update={"method": method, "cost": cost}))


@pytest.mark.slow
@few_of(1, "name", ["window-inspection", "firefighting"])
def test_bounds_of_shipped_missions_are_below_their_costs(name: str) -> None:
    assert_below(ltlplan.load_mission(name))


@pytest.mark.slow
def test_the_bound_is_known_and_close_where_regions_are_small() -> None:
    made = ltlplan.plan(ltlplan.load_mission("window-inspection"), seed=0)
    assert made.lower_bound is not None
    assert made.lower_bound > 0.5 * made.cost


@pytest.mark.slow
@pytest.mark.parametrize("name", GOLDEN_MISSIONS)
def test_bounds_of_all_shipped_missions_are_below_their_costs(name: str) -> None:
    assert_below(ltlplan.load_mission(name))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(25))
def test_bounds_of_golden_missions_are_below_their_costs(seed: int) -> None:
    assert_below(mission_of(f"random {seed}"))


@pytest.mark.slow
@pytest.mark.parametrize("cost", COSTS, ids=lambda cost: "+".join(cost))
@pytest.mark.parametrize("method", ["exact", "mtac-e"])
@pytest.mark.parametrize("seed", range(4))
def test_bounds_are_below_costs_by_any_method_and_terms(seed: int, method: str, cost: dict[str, float]) -> None:
    assert_below(asking(random_mission(seed, samples=20, rounds=4), method, cost))
