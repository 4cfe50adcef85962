"""Many tasks shared in tours: words that the judge accepts, near to the exact assignment, with a gap that is told."""

from functools import partial
from itertools import product

import numpy as np
import pytest

from ltlplan.mtac.beam_search import Options
from ltlplan.mtac.many_tasks import many_tasks
from ltlplan.mtac.offline import mtac_e, share_tasks
from ltlplan.mtac.optimality_gap import best_known, straight_cost
from ltlplan.planner import make_plan
from ltlplan.search.exact import assign
from tests.helpers.few import few_of
from tests.helpers.missions.random_missions import MANY_TASKS, mission_of_many_tasks
from verify import check_team
from verify.data import parse_mission

QUICK = Options(optimality_gap=False)


def shared(mission, seed=0):
    found = share_tasks(mission, rng=np.random.default_rng(seed), options=QUICK)
    assert found is not None
    assert check_team(mission.formula, {name: path.plan.word for name, path in found.paths.items()}).sequential
    return found, {name: tuple(path.plan.visits[k] for k in found.stops[name]) for name, path in found.paths.items()}


QUICKLY_DONE = [("orders", 0, "longest"), ("responses", 0, "sum"), ("sequences", 0, "sum")]
OTHERS = sorted(set(product(MANY_TASKS, (0, 1, 3, 5, 6), ("sum", "longest"))) - set(QUICKLY_DONE))


@few_of(1, ("kind", "seed", "objective"), [*QUICKLY_DONE, *(pytest.param(*case, marks=pytest.mark.slow) for case in OTHERS)])
def test_tours_are_near_the_exact_assignment(kind, seed, objective):
    mission = mission_of_many_tasks(seed, MANY_TASKS[kind], objective=objective)
    assert many_tasks(mission) is not None
    found, _ = shared(mission, seed)
    exact = assign(mission)
    assert exact.lower_bound - 1e-6 <= straight_cost(mission, found.robots) <= 1.05 * exact.cost
    assert 0.0 < found.least <= exact.cost + 1e-6


def test_conjuncts_are_sorted_by_what_others_can_do_to_them():
    asked = many_tasks(mission_of_many_tasks(0, "F a & F b & F c & F d & F e & F(f & F g) & (!b U a) & (!d W c) & G !h"))
    kinds = asked.own.kinds()
    assert (len(kinds.free), len(kinds.own), len(kinds.kept)) == (6, 1, 2)
    assert set(asked.own.kinds(frozenset({kinds.free[0]})).own) == {kinds.free[0], *kinds.own}


def test_an_order_that_others_can_lose_is_left_to_one_robot():
    mission = mission_of_many_tasks(1, "F c & F d & F e & F f & F g & F h & F b & (!b U a)")
    _, visits = shared(mission, 1)
    at = [(name, k) for name, own in visits.items() for k, visit in enumerate(own) if visit.region in "ab"]
    assert len({name for name, _ in at}) == 1
    assert [visits[name][k].region for name, k in at][:2] == ["a", "b"]


def test_few_tasks_are_walked_as_the_paper_says():
    assert many_tasks(mission_of_many_tasks(0, "F a & F b & F c")) is None
    assert many_tasks(mission_of_many_tasks(0, "F a & F b & F c", objective="longest")) is not None


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_and_the_gap_is_told():
    mission = mission_of_many_tasks(2, MANY_TASKS["visits"], objective="longest")
    plan = make_plan(mission, method="mtac-e", seed=4)
    again = make_plan(mission, method=partial(mtac_e, options=QUICK), seed=4)
    assert again.robots == plan.robots
    assert "a gap of" in plan.notes[1]
    assert plan.lower_bound is not None


@pytest.mark.slow
def test_words_of_the_exact_search_are_taken_where_their_paths_cost_less(monkeypatch):
    monkeypatch.setattr("ltlplan.search.tours.shared_tours.ROUNDS", 0)
    mission = mission_of_many_tasks(0, MANY_TASKS["sequences"])
    kept = make_plan(mission, method=partial(mtac_e, options=QUICK), seed=4)
    plan = make_plan(mission, method="mtac-e", seed=4)
    assert plan.cost < kept.cost
    assert plan.notes[1].endswith("a gap of 0.0 %.")


def test_where_no_exact_assignment_is_found_the_gap_is_an_upper_bound(monkeypatch):
    mission = mission_of_many_tasks(2, MANY_TASKS["sequences"], robots=4)
    found, _ = shared(mission, 2)
    monkeypatch.setattr("ltlplan.mtac.optimality_gap._STATES_FOR_MANY", 3)
    known = best_known(mission, least=found.least)
    sentence, bound = known.gap(found.robots), known.bound
    assert "a gap of at most" in sentence
    assert found.least <= bound <= straight_cost(mission, found.robots) + 1e-6


@pytest.mark.slow
def test_twenty_robots_share_fifty_tasks():
    spread = np.random.default_rng(0)
    names = [f"g{i}" for i in range(50)]
    places = [
        f"{n}: {{center: [{x:.2f}, {y:.2f}, 1], radii: [0.2, 0.2, 0.2]}}"
        for n, (x, y) in zip(names, grid(spread, 50, 0), strict=True)
    ]
    starts = [f"q{i}: {{start: [{x:.2f}, {y:.2f}, 1]}}" for i, (x, y) in enumerate(grid(spread, 20, -8))]
    mission = parse_mission(
        "format: 1\nname: fifty\n"
        f"spec: {{formula: {' & '.join(f'F {n}' for n in names)}}}\n"
        f"regions: {{{', '.join(places)}}}\nagents: {{{', '.join(starts)}}}\nvehicle: crazyflie-2.1\n"
        "workspace: {min: [-2, -10, 0.2], max: [18, 18, 3]}\nplanner: {method: mtac-e, samples: 20, elite: 0.1, iterations: 2}\n"
    )
    found, _ = shared(mission)
    assert straight_cost(mission, found.robots) <= 1.2 * found.least


def grid(rng: np.random.Generator, count: int, lowest: float) -> list[tuple[float, float]]:
    """Return places 1.5 m apart or more, in disorder."""
    cells = rng.permutation([(i % 10, i // 10) for i in range(80)])[:count]
    return [(1.6 * x, lowest + 1.6 * y if lowest == 0 else lowest + 0.9 * (y % 8)) for x, y in cells.tolist()]
