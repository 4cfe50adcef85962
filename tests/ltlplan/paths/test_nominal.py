import itertools

import numpy as np
import pytest

from ltlplan.allocation import Context
from ltlplan.paths import nominal
from ltlplan.planner import make_plan
from ltlplan.search.exact import assign, exact
from verify import check_word
from verify.data import Infeasible
from verify.data.files.mission_file import parse_mission

HOOPS = """
  near: {center: [0.9, 0, 1], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}
  wall: {center: [0, 0, 1], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}
  far: {center: [-2.6, 0, 1], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}
"""


def nominal_paths(mission, **given):
    def allocate(blocked):
        return exact(mission, Context(np.random.default_rng(0), blocked=blocked))

    return nominal.nominal_paths(mission, allocate, **given)


def mission_with(formula, hoops=HOOPS, workspace="{min: [-4, -0.31, 0.69], max: [2, 0.31, 1.31]}", trace="finite"):
    return parse_mission(
        f"""
format: 1
name: narrow
spec: {{formula: "{formula}", trace: {trace}}}
hoops: {hoops}
agents: {{quad0: {{start: [-0.8, 0, 1]}}}}
vehicle: crazyflie-2.1
workspace: {workspace}
planner: {{method: exact, iterations: 0}}
"""
    )


def test_where_the_cheapest_hoop_is_behind_a_blocked_one_the_next_is_flown():
    mission = mission_with("F (near | far) & G !wall")
    assert [v.region for v in assign(mission).robots["quad0"].visits] == ["near"]
    found = nominal_paths(mission)
    assert [v.region for v in found.paths["quad0"].visits] == ["far"]
    assert not found.complete
    assert found.lower_bound == pytest.approx(1.7)  # of the cheapest words, flown or not
    assert any("passed over" in note and "'wall' stands in the way" in note for note in found.notes)
    assert set(found.notes) <= set(make_plan(mission).notes)


def test_a_lasso_takes_the_next_cycle_too():
    found = nominal_paths(mission_with("G F (near | far) & G !wall", trace="infinite"))
    assert {v.region for v in found.paths["quad0"].visits} == {"far"}


def test_where_no_word_can_be_flown_the_hoop_in_the_way_is_named():
    with pytest.raises(Infeasible, match="'wall' stands in the way"):
        nominal_paths(mission_with("F near & G !wall"))


def test_what_can_be_flown_is_flown_as_before():
    mission = mission_with("F near & F far", workspace="{min: [-4, -2, 0.2], max: [2, 2, 2]}")
    found = nominal_paths(mission)
    cheapest = assign(mission)
    assert found.robots == cheapest.robots
    assert found.complete
    assert found.notes == cheapest.notes


def test_orders_are_tried_in_the_order_of_their_cost_and_none_twice():
    hoops = "".join(
        f"\n  h{i}: {{center: [{x}, {y}, 1], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}}"
        for i, (x, y) in enumerate([(1.0, 1.2), (1.3, -1.0), (-1.5, -1.3)])
    )
    mission = mission_with("F h0 & F h1 & F h2", hoops, "{min: [-3, -3, 0.2], max: [3, 3, 2]}")
    tried = []

    def refuse(_mission, _name, itinerary):
        tried.append(tuple(v.region for v in itinerary.visits))
        raise Infeasible("no way")

    with pytest.raises(Infeasible, match="no way"):
        nominal_paths(mission, lay=refuse)
    places = {name: np.array(hoop.center) for name, hoop in mission.hoops.items()}
    start = np.array(mission.agents["quad0"].start)

    def length(order):
        return sum(np.linalg.norm(a - b) for a, b in itertools.pairwise([start, *(places[name] for name in order)]))

    orders = sorted(itertools.permutations(places), key=length)  # by brute force
    assert tried == orders
    assert all(check_word(mission.spec.formula, [set(), *({name} for name in order)]) for order in tried)
