"""Regions that a formula forbids are to a leg what obstacles are."""

from __future__ import annotations

import numpy as np
import pytest

import ltlplan
from ltlplan.search.exact import assign
from refine import refine
from refine.single_robot.task import Pace
from tests.helpers.few import few_of
from tests.helpers.missions.rooms_and_rests import keeping_out
from tests.helpers.missions.worlds import world
from verify import judge
from verify.data.language.lasting import lasting_regions


def test_forbidden_cylinders_cost_no_more_than_solid_ones(pace: Pace) -> None:
    made, solid = ltlplan.plan(keeping_out()), ltlplan.plan(keeping_out(of="obstacles"))
    assert made.cost <= 1.01 * solid.cost  # a vehicle's radius is kept from what is solid, too
    assert made.lower_bound is not None
    assert made.lower_bound <= made.cost
    assert judge(made, refine(made, pace=pace), largest=False).holds


@few_of(1, "seed", [*range(2), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 12))])
def test_random_regions_that_are_forbidden_cost_no_more_than_obstacles(seed: int, pace: Pace) -> None:
    rng, cylinders = np.random.default_rng(seed), dict[str, tuple[float, float, float]]()
    while len(cylinders) < 4:
        x, y, r = (round(float(v), 2) for v in rng.uniform((-1.2, -1.6, 0.2), (1.2, 1.6, 0.5)))
        if all(np.hypot(x - a, y - b) > r + c + 0.5 for a, b, c in cylinders.values()):
            cylinders[f"nf{len(cylinders)}"] = (x, y, r)
    made, solid = (ltlplan.plan(keeping_out(of=of, cylinders=cylinders)) for of in ("regions", "obstacles"))
    assert made.cost <= 1.03 * solid.cost
    assert judge(made, refine(made, pace=pace), largest=False).holds


def test_the_goal_that_no_forbidden_region_shuts_off_is_the_cheaper_one() -> None:
    places = {"near": (2.0, 0.0), "wall": (1.0, 0.0), "far": (-2.1, 0.0)}
    asked = "F (near | far) & G !wall"
    mission = world(asked, regions=places, radii={"near": 0.2, "far": 0.2, "wall": 0.7}, starts=((0.0, 0.0),))
    assert [visit.region for visit in assign(mission).robots["quad0"].visits] == ["far"]
    narrow = world(asked, regions=places, radii={"near": 0.2, "far": 0.2, "wall": 0.1}, starts=((0.0, 0.0),))
    assert [visit.region for visit in assign(narrow).robots["quad0"].visits] == ["near"]


@pytest.mark.parametrize(
    ("formula", "forbidden"),
    [
        ("F c & G !(a | b)", {"a", "b"}),
        ("F c & G(!a & !b)", {"a", "b"}),
        ("F c & G !a & G !b", {"a", "b"}),
        ("F c & G !(a & b)", set()),
        ("F c & G(!a | !b)", set()),
        ("F c & !a U c", set()),
        ("F(c & G !a)", set()),
        ("G !!(c | !a)", set()),
        ("G !!(!c & !a)", {"a", "c"}),
    ],
)
def test_regions_that_are_always_forbidden_are_read_off_the_formula(formula: str, forbidden: set[str]) -> None:
    assert lasting_regions(world(formula), "quad0", inside=False) == forbidden


def test_a_region_that_is_forbidden_to_one_robot_is_so_to_no_other() -> None:
    mission = world("F quad0.b & G !quad0.a", robots=2, team="joint")
    assert lasting_regions(mission, "quad0", inside=False) == {"a"}
    assert lasting_regions(mission, "quad1", inside=False) == set()
