import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ltlplan.missions import load_mission
from ltlplan.paths.costs import CostError, Sampling, WeightedCost, cost_of, evaluate, parse_cost, plan_cost
from ltlplan.paths.hoops import route_sequence
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from verify.data import GRAVITY


def sampled(seed=0, paths=5, points=8, count=1500):
    rng = np.random.default_rng(seed)
    sampling = Sampling(LeastSnapSpline(np.concatenate([[0.0], np.cumsum(rng.uniform(0.5, 1.5, points - 1))])), count)
    return sampling.paths(rng.uniform(-1, 1, (paths, points, 3)))


def test_a_straight_line_is_as_long_as_its_ends_are_apart():
    sampling = Sampling(LeastSnapSpline([0.0, 2.0]), 2000)
    paths = sampling.paths([[(0, 0, 0), (3, 4, 0)]])
    assert WeightedCost.of({"length": 1.0})(paths) == pytest.approx([5.0], rel=1e-6)
    assert WeightedCost.of({"time": 2.0})(paths) == pytest.approx([4.0])
    speed = np.linalg.norm(paths.velocity, axis=2).max()  # from rest to rest the effort is twice the greatest speed
    assert WeightedCost.of({"effort": 1.0})(paths) == pytest.approx([2 * speed], rel=1e-4)


def test_hovering_costs_its_time_in_energy_and_nothing_else():
    paths = Sampling(LeastSnapSpline([0.0, 3.0]), 300).paths([[(1, 1, 1), (1, 1, 1)]])
    assert WeightedCost.of({"energy": 1.0})(paths) == pytest.approx([3.0])
    for term in ("length", "effort", "snap"):
        assert WeightedCost.of({term: 1.0})(paths) == pytest.approx([0.0], abs=1e-12)


def test_terms_are_the_integrals_that_they_are_named_after():
    paths = sampled()
    at = np.linspace(0.0, paths.duration[0], 1500)
    for index in range(len(paths)):
        norms = {
            "length": np.linalg.norm(paths.velocity[index], axis=1),
            "effort": np.linalg.norm(paths.acceleration[index], axis=1),
            "snap": np.linalg.norm(paths.snap[index], axis=1) ** 2,
            "energy": (np.linalg.norm(paths.acceleration[index] + [0, 0, GRAVITY], axis=1) / GRAVITY) ** 1.5,
        }
        for term, values in norms.items():
            assert WeightedCost.of({term: 1.0})(paths)[index] == pytest.approx(np.trapezoid(values, at), rel=1e-9)


@given(st.floats(0.5, 3.0), st.integers(0, 1000))
@settings(max_examples=15, deadline=None)
def test_costs_scale_with_time_as_their_units_say(scale, seed):
    paths = sampled(seed, count=200)
    slower = paths.rescaled(np.full(len(paths), scale))
    for term, power in (("length", 0), ("effort", -1), ("time", 1), ("snap", -7)):
        cost = WeightedCost.of({term: 1.0})
        assert np.allclose(cost(slower), cost(paths) * scale**power, rtol=1e-9)
    assert np.allclose(slower.velocity, paths.velocity / scale)


@given(st.integers(0, 1000))
@settings(max_examples=10, deadline=None)
def test_costs_do_not_change_when_the_world_is_moved_and_turned_about_z(seed):
    rng = np.random.default_rng(seed)
    angle, shift = rng.uniform(0, 2 * math.pi), rng.uniform(-3, 3, 3)
    turn = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    paths = sampled(seed, count=200)
    moved = paths.sampling.paths(paths.points @ turn.T + shift)
    cost = WeightedCost.of({"length": 1.0, "effort": 0.5, "snap": 0.01, "energy": 0.2, "time": 1.0})
    assert np.allclose(cost(moved), cost(paths), rtol=1e-8)


def test_a_weighted_cost_is_the_sum_of_its_terms():
    paths = sampled()
    parts = WeightedCost.of({"length": 1.0})(paths) + 0.5 * WeightedCost.of({"effort": 1.0})(paths)
    assert np.allclose(WeightedCost.of(parse_cost("length=1,effort=0.5"))(paths), parts)


def test_a_cost_is_read_from_text_and_written_again():
    assert parse_cost("length=1,effort=0.5") == {"length": 1.0, "effort": 0.5}
    assert parse_cost(" snap = 1e-3 ") == {"snap": 1e-3}
    assert str(WeightedCost.of(parse_cost("length=1,effort=0.5"))) == "length=1,effort=0.5"


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("lenght=1", "Did you mean 'length'"),
        ("length", "no cost"),
        ("length=", "no cost"),
        ("", "no cost"),
        ("length=one", "must be a number"),
        ("length=nan", "finite"),
        ("length=inf", "finite"),
        ("length=-1", "not below zero"),
        ("length=0", "above zero"),
        ("length=1,length=2", "twice"),
        ("__import__('os')=1", "not a cost term"),
    ],
)
def test_bad_cost_texts_are_refused(text, match):
    with pytest.raises(CostError, match=match):
        parse_cost(text)


def test_a_function_of_sampled_paths_is_a_cost_and_is_checked():
    paths = sampled(paths=4)
    highest = evaluate(lambda p: p.position[:, :, 2].max(axis=1), paths)
    assert np.allclose(highest, paths.position[:, :, 2].max(axis=1))
    with pytest.raises(CostError, match="nan for path 2 of 4"):
        evaluate(lambda _: [1.0, 2.0, math.nan, math.nan], paths)
    with pytest.raises(CostError, match=r"shape \(\) for 4"):
        evaluate(lambda _: 1.0, paths)
    with pytest.raises(CostError, match="-inf"):
        evaluate(lambda _: [1.0, -math.inf, 1.0, 1.0], paths)
    assert evaluate(lambda _: [1.0, math.inf, 1.0, 1.0], paths)[1] == math.inf


def test_robots_may_have_costs_of_their_own():
    mission = load_mission("firefighting")
    agent = mission.agents["quad1"].model_copy(update={"cost": {"snap": 2.0}})
    other = mission.model_copy(update={"agents": {**mission.agents, "quad1": agent}})
    assert str(cost_of(other, "quad1")) == "snap=2"
    assert cost_of(other, "quad0") == cost_of(mission, "quad0")


def test_a_plan_costs_what_its_spline_does():
    mission = load_mission("hoops-published")
    plan = route_sequence(mission)
    assert plan.cost == pytest.approx(plan_cost(plan, cost_of(mission, "quad0")))
    straight = sum(math.dist(a.position, b.position) for a, b in zip(plan.waypoints, plan.waypoints[1:], strict=False))
    assert straight < plan.cost < 1.3 * straight
