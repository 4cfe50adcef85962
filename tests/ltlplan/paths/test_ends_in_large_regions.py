"""Routes touch regions where that is shortest, and are priced so."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.optimize import minimize

import ltlplan
from ltlplan.allocation import Context
from ltlplan.paths.k_best_words import exact
from ltlplan.systems.touching_points import is_large, touching_points
from refine import refine
from refine.single_robot.task import Pace
from tests.helpers.few import few_of
from tests.helpers.missions.rooms_and_rests import fields_or_spots
from tests.helpers.missions.worlds import world
from verify import judge
from verify.data import Mission, mission_to_yaml, parse_mission
from verify.data.progress import silent

FIELD, SPOT = ((3.0, 0.0), (5.0, 2.0)), ((-1.5, 0.0), (0.4, 0.4))
DEEP, SHALLOW = 0.185, 0.095
"""m; how deep in a field and in a spot flights end: the margin of 5 cm, and 30 % of what that leaves of the least radius."""


def away(box: tuple[tuple[float, float], tuple[float, float]], less: float) -> float:
    """Return how far the origin is from a box whose sides are moved inwards, m."""
    centre, size = np.array(box[0]), np.array(box[1])
    return float(np.linalg.norm(np.maximum(np.abs(centre) - size / 2.0 + less, 0.0)))


def test_a_field_that_begins_nearer_than_a_spot_is_flown_to(pace: Pace) -> None:
    made = ltlplan.plan(fields_or_spots({"field": FIELD, "spot": SPOT}))
    assert [visit.region for visit in made.robots["q"].visits] == ["field"]
    assert made.cost == pytest.approx(away(FIELD, DEEP), abs=1e-3)
    assert made.lower_bound == pytest.approx(away(FIELD, 0.0), abs=1e-5)
    assert judge(made, refine(made, pace=pace), largest=False).holds


@few_of(1, "seed", [*range(2), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 12))])
def test_of_random_fields_the_one_that_begins_nearest_is_flown_to(seed: int, pace: Pace) -> None:
    rng, boxes = np.random.default_rng(seed), {}
    corners = [(-3.0, -3.0), (3.0, -3.0), (-3.0, 3.0), (3.0, 3.0)]
    for k, corner in enumerate(corners):
        size = rng.uniform(1.0, 3.5, 2).round(2).tolist()
        boxes[f"f{k}"] = (tuple((np.array(corner) + rng.uniform(-0.4, 0.4, 2)).round(2).tolist()), tuple(size))
    made = ltlplan.plan(fields_or_spots(boxes))
    least = min(away(box, DEEP) for box in boxes.values())
    assert made.cost == pytest.approx(least, rel=0.02)
    assert made.lower_bound is not None
    assert 0.7 * min(away(box, 0.0) for box in boxes.values()) <= made.lower_bound <= made.cost
    assert judge(made, refine(made, pace=pace), largest=False).holds


def test_small_regions_are_touched_less_deep_and_the_smallest_in_their_middles() -> None:
    mission = fields_or_spots({"field": FIELD, "spot": SPOT, "dot": ((0.0, -2.0), (0.14, 0.14))})
    assert [is_large(mission, name) for name in ("field", "spot", "dot")] == [True, True, False]
    start, above = np.array([0.0, 0.0, 1.0]), np.array([0.0, 3.0, 1.4])
    near, side, top = 0.5 + DEEP, 1.0 - DEEP, 1.5 - DEEP
    assert touching_points(mission, [start, "field"])[1] == pytest.approx([near, 0.0, 1.0], abs=1e-5)
    assert touching_points(mission, [above, "field"])[1] == pytest.approx([near, side, top], abs=1e-3)
    for box, end in ((SPOT, -1.3 - SHALLOW), (((-1.5, 0.0), (0.14, 0.14)), -1.5)):
        made = ltlplan.plan(fields_or_spots({"spot": box}))
        assert made.robots["q"].waypoints[-1].position == pytest.approx((end, 0.0, 1.0), abs=1e-5)


def test_a_route_around_a_wall_touches_the_region_where_the_way_is_shortest() -> None:
    field = fields_or_spots({"field": ((3.0, 2.0), (1.0, 1.0))})
    mission = parse_mission(mission_to_yaml(field) + "obstacles: {wall: {center: [1.5, 0, 1], size: [0.2, 3, 4]}}\n")
    made = ltlplan.plan(mission)
    corner, nearest = np.array([1.4, 1.5]), np.array([2.5, 1.5]) + mission.margin  # the wall's edge itself is flown around
    least = float(np.linalg.norm(corner) + np.linalg.norm(nearest - corner))
    assert least <= made.cost <= 1.12 * least
    x, y, _ = made.robots["q"].waypoints[-1].position
    assert (x, y) == pytest.approx((2.5 + DEEP, 1.5 + DEEP), abs=0.15)
    assert judge(made, refine(made), largest=False).holds


FIELDS = {
    "a": ((3.0, 0.0), (3.0, 2.0)),
    "b": ((-1.5, 2.5), (1.4, 1.4)),
    "c": ((-3.0, -3.0), (2.0, 2.0)),
    "d": ((0.0, -3.5), (0.5, 0.5)),
}


def test_a_whole_route_is_as_short_as_any_through_the_same_fields() -> None:
    mission = fields_or_spots(FIELDS)
    found = touching_points(mission, [np.array([0.0, 0.0, 1.0]), "a", "b", "c"])
    boxes = [(np.array(FIELDS[name][0]), np.array(FIELDS[name][1]) / 2.0 - DEEP) for name in "abc"]

    def length(corners: np.ndarray) -> float:
        points = [np.zeros(2), *(centre + half * at for (centre, half), at in zip(boxes, corners.reshape(3, 2), strict=True))]
        return float(sum(np.linalg.norm(b - a) for a, b in itertools.pairwise(points)))

    rng = np.random.default_rng(0)
    least = min(minimize(length, rng.uniform(-1, 1, 6), bounds=[(-1, 1)] * 6).fun for _ in range(4))
    assert float(np.linalg.norm(np.diff(found, axis=0), axis=1).sum()) == pytest.approx(least, abs=1e-5)


@few_of(
    1,
    ("formula", "visits", "cheapest"),
    [
        ("F(a & F(b & F c))", "abc", 9.91),  # middles cost 11.4
        ("F(d & F a)", "da", 7.0),  # 7.9
        ("(!a U d) & F a & F(b & F free)", "dab", 10.6),  # left where it is touched; middles cost 13.3
    ],
)
def test_visits_on_the_way_are_made_where_the_route_touches_their_regions(
    formula: str, visits: str, cheapest: float, pace: Pace
) -> None:
    mission = fields_or_spots(FIELDS, formula=formula)
    made = ltlplan.plan(mission)
    assert "".join(visit.region for visit in made.robots["q"].visits) == visits
    assert made.lower_bound is not None
    assert made.lower_bound <= made.cost <= cheapest
    assert made.complete
    assert judge(made, refine(made, pace=pace), largest=False).holds


@few_of(1, ("formula", "team"), [("F(a & F b) & F c & F d", "own"), ("(!b U a) & F b & F d", "joint")])
def test_teams_touch_fields_too_and_cost_little_more_than_their_bound(formula: str, team: str, pace: Pace) -> None:
    mission = fields_or_spots(FIELDS, formula=formula)
    agents = {f"q{k}": mission.agents["q"].changed(start=(x, 0.0, 1.0)) for k, x in enumerate((-0.7, 0.7))}
    made = ltlplan.plan(mission.changed(agents=agents, spec=mission.spec.model_copy(update={"team": team})))
    assert made.lower_bound is not None
    assert made.lower_bound <= made.cost <= 1.3 * made.lower_bound
    assert judge(made, refine(made, pace=pace), largest=False).holds


def test_a_team_too_large_for_several_searches_keeps_the_bound_of_the_first() -> None:
    mission = fields_or_spots(FIELDS, formula="F a & F(b & F c)")
    agents = {f"q{k}": mission.agents["q"].changed(start=(-5.0 + k, -5.0, 1.0)) for k in range(9)}
    found = exact(mission.changed(agents=agents), Context(np.random.default_rng(0), silent))
    assert found.lower_bound is not None
    assert 0.8 * found.cost <= found.lower_bound <= found.cost


def patrol(seed: int, robots: int, visits: str, flipped: bool = False, turned: bool = False) -> Mission:
    """Return rounds of two to four random fields for ever; mirrored in x, or with names and formula in another order."""
    rng = np.random.default_rng(seed)
    count, sign = int(rng.integers(2, 5)), -1.0 if flipped else 1.0
    regions: dict[str, str] = {}
    for k, corner in enumerate(rng.permutation([(-3.0, -3.0), (3.0, -3.0), (-3.0, 3.0), (3.0, 3.0)])[:count]):
        x, y = (corner + rng.uniform(-0.4, 0.4, 2)).round(2).tolist()
        wide, long = rng.uniform(0.8, 2.2, 2).round(2).tolist()
        regions[f"{'zyxw' if turned else 'abcd'}"[k]] = f"{{center: [{sign * x}, {y}, 1], size: [{wide}, {long}, 1.2]}}"
    formula = " & ".join(f"G F {name}" for name in sorted(regions))
    agents = ", ".join(f"q{k}: {{start: [{sign * (2 * k - 4.8)}, {-4.6 if k % 2 else 4.6}, 1]}}" for k in range(robots))
    return parse_mission(
        f"format: 1\nname: patrol\nspec: {{formula: '{formula}', trace: infinite}}\nvehicle: crazyflie-2.1\nlimits: {{speed: 1.0}}\n"
        f"regions: {{{', '.join(f'{name}: {body}' for name, body in sorted(regions.items()))}}}\nagents: {{{agents}}}\n"
        f"planner: {{visits: {visits}}}\nworkspace: {{min: [-6, -6, 0.2], max: [6, 6, 2.2]}}\n"
    )


def shortest_patrol(mission: Mission) -> float:
    """Return the length of the shortest way to some fields and once around them, by a general solver over all orders, m."""
    start = np.array(mission.agents["q0"].start)
    boxes: list[tuple[np.ndarray, np.ndarray]] = []
    for region in mission.regions.values():
        deep = mission.margin + min(0.2, 0.3 * (region.inner_radius - mission.margin))
        half = np.array(region.half_lengths) - deep
        boxes.append((np.array(region.center) - half, np.array(region.center) + half))

    def length(order: tuple[int, ...]) -> float:
        low, high = (np.concatenate([boxes[k][side] for k in order]) for side in (0, 1))

        def metres(values: np.ndarray) -> float:
            places = values.reshape(-1, 3)
            legs = np.diff(np.vstack([start, places, places[:1]]), axis=0)
            return float(np.sqrt((legs**2).sum(axis=1) + 1e-12).sum())

        return float(minimize(metres, (low + high) / 2.0, bounds=list(zip(low, high, strict=True)), method="L-BFGS-B").fun)

    return min(map(length, itertools.permutations(range(len(boxes)))))


@few_of(1, "seed", range(12))
def test_laps_of_one_robot_touch_their_regions(seed: int, pace: Pace) -> None:
    mission = patrol(seed, 1, "near")
    made, least = ltlplan.plan(mission), shortest_patrol(mission)
    assert made.lower_bound is not None
    assert made.lower_bound <= min(least, made.cost)
    assert made.cost <= 1.15 * least
    assert made.cost <= ltlplan.plan(patrol(seed, 1, "middle")).cost
    assert judge(made, refine(made, pace=pace), largest=False).holds


@pytest.mark.slow
@few_of(1, "seed", [*range(1), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 12))])
def test_laps_of_a_team_touch_their_regions_and_end_where_they_begin(seed: int, pace: Pace) -> None:
    made = ltlplan.plan(patrol(seed, 2, "near"))
    assert made.cost <= ltlplan.plan(patrol(seed, 2, "middle")).cost
    assert judge(made, refine(made, pace=pace), largest=False).holds


@pytest.mark.slow
@few_of(1, ("seed", "robots"), [(0, 1), *((k, n) for k in range(1, 6) for n in (1, 2))])
def test_mirroring_and_renaming_change_neither_cost_nor_duration_of_laps(seed: int, robots: int, pace: Pace) -> None:
    costs, durations, orders = [], [], []
    for flipped, turned in ((False, False), (True, False), (False, True)):
        made = ltlplan.plan(patrol(seed, robots, "near", flipped, turned))
        flown = refine(made, pace=pace)
        costs.append(made.cost)
        durations.append(max(flight.duration for flight in flown.values()))
        same = str.maketrans("zyxw", "abcd") if turned else {}
        orders.append({name: [visit.region.translate(same) for visit in robot.visits] for name, robot in made.robots.items()})
    for cost, duration, order in zip(costs, durations, orders, strict=True):
        again = order == orders[0]  # else a lap is flown the other way round, which is as long: names choose between the two
        assert cost == pytest.approx(costs[0], rel=1e-6 if again else 2e-2)
        assert duration == pytest.approx(durations[0], rel=1e-6 if again else 5e-2)


@pytest.mark.parametrize(("laps", "patrolled"), [(1, "b"), (5, "c")])
def test_several_laps_go_to_the_field_that_begins_nearer_and_one_to_the_spot_at_the_start(laps: int, patrolled: str) -> None:
    places, radius = {"a": (0.0, 0.0), "b": (2.0, 0.0), "c": (-2.6, 0.0)}, 1.2
    formula, start = "G F a & (G F b | G F c)", (2.0, 0.5)
    mission = world(formula, regions=places, radii={"c": radius}, starts=(start,), trace="infinite", repeat=laps)
    far = radius - mission.margin - 0.2  # from its middle a route touches the field
    near = 0.7 * (0.2 - mission.margin)  # and from theirs the spots
    spot = 0.5 - near + 2 * laps * (2.0 - 2 * near)
    field = math.hypot(start[0] + near, start[1]) + 2 * laps * (2.6 - far - near)
    assert (spot < field) == (patrolled == "b")  # middles alone would choose the spot
    found = exact(mission, Context(np.random.default_rng(0), silent))
    assert {visit.region for visit in found.robots["quad0"].visits} == {"a", patrolled}
    assert found.lower_bound is not None
    assert found.lower_bound <= field + 1e-3
    assert laps == 1 or found.cost == pytest.approx(field, abs=1e-3)  # one lap is priced by its spline
