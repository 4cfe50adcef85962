"""Legs are counted around regions that the formula forbids until something was done, and within rooms, as they are flown."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import ltlplan
from ltlplan.search.exact import assign
from ltlplan.systems.forbidden_regions import regions_to_avoid
from ltlplan.systems.visit_words import word_of
from tests.helpers.few import few_of
from tests.helpers.missions.rooms_and_rests import room_with_a_corner
from tests.helpers.missions.worlds import world
from verify import check_word
from verify.data import Mission, Visit, parse_mission

MARGIN, PILLAR = 0.05, 0.6
Spot = tuple[float, float]


def pillar_world(seed: int, formula: str) -> tuple[Mission, dict[str, Spot]]:
    """Return a mission of small balls around an upright cylinder `b` in the middle of the world, and where they and the start are."""
    rng, spots = np.random.default_rng(seed), dict[str, Spot]()
    while len(spots) < 4:
        x, y = rng.uniform(-2.0, 2.0, 2).round(2).tolist()
        if math.hypot(x, y) > PILLAR + 0.3 and all(math.dist((x, y), other) > 0.6 for other in spots.values()):
            spots["start" if not spots else "acd"[len(spots) - 1]] = (x, y)
    regions = [
        f"{name}: {{center: [{x}, {y}, 1], radii: [0.15, 0.15, 0.15]}}" for name, (x, y) in spots.items() if name != "start"
    ]
    x, y = spots["start"]
    mission = parse_mission(f"""
format: 1
name: pillar
spec: {{formula: "{formula}"}}
regions: {{{", ".join(regions)}, b: {{center: [0, 0, 1], cylinder: {{radius: {PILLAR}, height: 2}}}}}}
agents: {{q: {{start: [{x}, {y}, 1]}}}}
vehicle: crazyflie-2.1
margin: {MARGIN}
workspace: {{min: [-2.6, -2.6, 0.2], max: [2.6, 2.6, 2]}}
""")
    return mission, {**spots, "b": (0.0, 0.0)}


def around(one: Spot, other: Spot) -> float:
    """Return the length of the shortest way around the pillar, m: straight, or along two tangents and an arc."""
    radius, far = PILLAR + MARGIN, math.dist(one, other)
    share = min(max(-np.dot(one, np.subtract(other, one)) / far**2, 0.0), 1.0)
    if math.hypot(*(np.array(one) + share * np.subtract(other, one))) >= radius:
        return far
    sides = [math.hypot(*spot) for spot in (one, other)]
    angle = math.acos(float(np.dot(one, other)) / (sides[0] * sides[1]))
    return sum(math.sqrt(side**2 - radius**2) for side in sides) + radius * (
        angle - sum(math.acos(radius / side) for side in sides)
    )


def cheapest(spots: dict[str, Spot]) -> float:
    """Return the least length of all orders to come to a, c and d in, with a visit of b anywhere after a or without one."""
    least = math.inf
    for goals in ("acd", "abcd"):
        for order in itertools.permutations(goals):
            if "b" in order and order.index("b") < order.index("a"):
                continue
            legs = itertools.pairwise(("start", *order))
            least = min(least, sum((math.dist if "b" in leg else around)(*(spots[name] for name in leg)) for leg in legs))
    return least


@few_of(1, "seed", range(24))
def test_words_are_the_cheapest_around_what_is_forbidden_for_a_while(seed: int) -> None:
    mission, spots = pillar_world(seed, "F a & F c & F d & (!b U a)")
    found, least = assign(mission), cheapest(spots)
    assert least - 1e-6 <= found.cost <= 1.01 * least + 1e-6  # the roadmap goes around a polygon
    made = ltlplan.plan(mission)
    assert made.lower_bound is not None
    assert made.lower_bound <= min(least, made.cost)


def test_a_goal_behind_what_is_forbidden_until_then_is_no_nearer_than_it_is_flown() -> None:
    places = {"near": (2.0, 0.0), "wall": (1.0, 0.0), "far": (-2.1, 0.0)}
    asked = "F (near | far) & (!wall U (near | far))"
    mission = world(asked, regions=places, radii={"near": 0.2, "far": 0.2, "wall": 0.7}, starts=((0.0, 0.0),))
    assert [visit.region for visit in assign(mission).robots["quad0"].visits] == ["far"]


@pytest.mark.parametrize("trace", ["finite", "infinite"])
def test_a_straight_leg_through_what_is_forbidden_for_a_while_breaks_the_formula(trace: str) -> None:
    places = {"a": (0.0, 0.0), "c": (2.0, 1.5)}
    mission = world("!a U c", regions=places, starts=((-1.0, -1.0),), trace=trace)
    start, goal = (-1.0, -1.0), places["c"]
    straight, middle = math.dist(start, goal), np.cross([*start, 0.0], [*goal, 0.0])[2]
    assert abs(middle) / straight < 0.2  # the line passes the middle of a so near
    flown = word_of(mission, "quad0", [Visit(region="a"), Visit(region="c")], 2 if trace == "infinite" else None, stays=True)
    assert not check_word(mission.formula, flown)
    plan = assign(mission)
    assert check_word(mission.formula, plan.robots["quad0"].word)
    assert [visit.region for visit in plan.robots["quad0"].visits] == ["c"]
    assert straight + 1e-3 < plan.cost < 1.01 * straight


POST = "post: {center: [2.0, 2.0, 1], cylinder: {radius: 0.1, height: 2}}"


@few_of(1, "touching", [True, False])
def test_an_obstacle_elsewhere_takes_no_leg_out_of_its_room(touching: bool) -> None:
    mission = room_with_a_corner(touching=touching)
    post = parse_mission(f"""
format: 1
name: post
spec: {{formula: "F a"}}
regions: {{a: {{center: [0, 0, 1], radii: [0.3, 0.3, 0.3]}}}}
obstacles: {{{POST}}}
agents: {{q: {{start: [-2, -2, 1]}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-2.4, -2.4, 0.2], max: [2.4, 2.4, 2]}}
""").obstacles
    assert assign(mission.changed(obstacles=post)).cost == pytest.approx(assign(mission).cost, abs=1e-6)


@pytest.mark.parametrize(
    ("formula", "avoided"),
    [
        ("F c & !a U c", {"a"}),
        ("F c & G !(a & b)", {"a", "b"}),
        ("F c & G(a -> F b)", {"a"}),
        ("F(a & F free)", set()),
        ("F quad0.b & G !quad1.a", set()),
        ("F count(b) >= 1 & G count(a) <= 1", set()),
    ],
)
def test_what_a_formula_may_lose_by_is_flown_around(formula: str, avoided: set[str]) -> None:
    joint = "quad" in formula or "count" in formula
    assert regions_to_avoid(world(formula, robots=2 if joint else 1, team="joint" if joint else "own"), "quad0") == avoided
