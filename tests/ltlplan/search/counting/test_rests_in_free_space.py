"""Robots rest in free space beside what they wait for, as an ordinary choice of the search."""

from __future__ import annotations

import math

import numpy as np
import pytest

import ltlplan
from ltlplan.search.exact import assign
from refine import refine
from refine.single_robot.task import Pace
from tests.helpers.few import few_of
from tests.helpers.missions.rooms_and_rests import STARTS, escort, shared_machine
from verify import judge
from verify.data import Mission

SHELF = "shelf: {center: [-1.3, 0, 1], size: [1.0, 2.0, 0.8]}"


def to_the_machine(robots: int) -> float:
    """Return the sum of straight ways to the machine's middle, m: no plan by such ways costs less."""
    return sum(math.dist(start, (1.3, 0.0)) for start in STARTS[:robots])


@few_of(2, "robots", [2, 4, *(pytest.param(robots, marks=pytest.mark.slow) for robots in (3, 5))])
def test_a_machine_for_one_costs_no_more_than_the_ways_to_it(robots: int) -> None:
    for more in ("", SHELF):
        found = assign(shared_machine(robots, more=more))
        assert found.cost == pytest.approx(to_the_machine(robots), abs=1e-5)
        assert found.complete


def certified(mission: Mission, pace: Pace) -> tuple[float, float]:
    made = ltlplan.plan(mission)
    team = refine(made, pace=pace)
    assert judge(made, team, largest=False).holds
    return made.cost, max(flown.duration for flown in team.values())


@pytest.mark.parametrize("robots", [2, 3, 4, 5])
@pytest.mark.slow
def test_an_unrelated_region_makes_a_shared_machine_no_dearer_and_no_slower(robots: int) -> None:
    paces: tuple[Pace, ...] = ("nominal", 0.7)
    for pace in paces:
        alone, beside = (certified(shared_machine(robots, more=more), pace) for more in ("", SHELF))
        assert beside == pytest.approx(alone)


@few_of(1, "radius", [0.25, 0.2])
def test_robots_take_turns_at_a_machine_that_holds_one(radius: float) -> None:
    """Who has left it hovers where the next one comes past, and is not said to be in it still."""
    mission = shared_machine(3)
    machine = mission.regions["machine"].changed(radii=(radius, radius, radius))
    _, lasts = certified(mission.changed(regions={"machine": machine}), "nominal")
    assert lasts < 7.0


@few_of(1, "seed", [*range(2), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 20))])
def test_no_unrelated_region_makes_a_search_dearer(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, y = rng.uniform((-1.6, -1.3), (-1.2, 1.3)).round(2).tolist()
    wide = round(float(rng.uniform(0.15, 0.3)), 2)
    more = f"other: {{center: [{x}, {y}, 1], radii: [{wide}, {wide}, {wide}]}}"
    robots = int(rng.integers(2, 5))
    one, other = (assign(shared_machine(robots, more=each)) for each in ("", more))
    assert other.cost <= one.cost + 1e-6
    assert other.complete


@few_of(1, "parts", [False, True])
def test_mirrors_names_and_orders_change_no_cost(parts: bool) -> None:
    costs = [
        assign(shared_machine(3, parts=parts, mirrored=mirrored, names=names, order=order)).cost
        for mirrored in (False, True)
        for names in (("a", "b", "c"), ("z", "m", "k"))
        for order in ((0, 1, 2), (2, 0, 1))
    ]
    assert costs == pytest.approx([costs[0]] * len(costs), abs=1e-6)


@few_of(1, ("robots", "pace"), [(2, "nominal"), (2, 0.7), (3, "nominal"), (3, 0.7)])
def test_mirrors_names_and_orders_change_no_flight(robots: int, pace: Pace) -> None:
    listed, backwards = tuple(range(robots)), tuple(reversed(range(robots)))
    plain = certified(shared_machine(robots), pace)
    for mirrored, names, order in (
        (True, ("a", "b", "c"), listed),
        (False, ("z", "m", "k"), listed),
        (False, ("a", "b", "c"), backwards),
        (True, ("z", "m", "k"), backwards),
    ):
        assert certified(shared_machine(robots, mirrored=mirrored, names=names, order=order), pace) == pytest.approx(plain)


@few_of(1, "pace", ["nominal", pytest.param(0.7, marks=pytest.mark.slow)])
def test_who_is_guarded_waits_between_two_zones_until_the_guard_has_come(pace: Pace) -> None:
    made = ltlplan.plan(escort())
    assert made.complete
    assert [str(word) for word in made.words.values()] == ["{} {one} {} {other}"] * 2
    assert judge(made, refine(made, pace=pace), largest=False).holds
