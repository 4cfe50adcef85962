import math

import numpy as np
import pytest

from ltlplan.missions import load_mission
from ltlplan.paths.costs import CostError, WeightedCost, plan_cost
from ltlplan.paths.cross_entropy.cross_entropy import improve, minimise, options_of, searches
from ltlplan.paths.cross_entropy.gaussian import Options, Search, Tournament
from ltlplan.paths.hoops import route, route_sequence
from ltlplan.paths.path_result import flown_pieces
from ltlplan.paths.sampling.path_problem import path_problem
from ltlplan.pipeline import certified_team
from ltlplan.reproduction.hoops_flights import LIMIT, lengths, under_the_limit, wide_course
from tests.helpers.few import few_of
from tests.helpers.missions.courses import courses
from tests.helpers.motion.nominal_trajectories import nominal_trajectory
from verify import judge
from verify.data import Plan, Trajectory, Visit, Word

EFFORT = WeightedCost.of({"length": 1.0, "effort": 0.5})


def quadratic(size, condition=100.0, seed=0):
    rng = np.random.default_rng(seed)
    axes = np.linalg.qr(rng.normal(size=(size, size)))[0]
    form = axes @ np.diag(np.geomspace(1.0, condition, size)) @ axes.T
    optimum = rng.uniform(-2, 2, size)

    def cost(points):
        return 1.5 + np.einsum("ni,ij,nj->n", points - optimum, form, points - optimum)

    return cost, optimum


# The search itself


@pytest.mark.parametrize("size", [1, 3, 12])
def test_a_convex_cost_converges_to_its_known_optimum(size):
    cost, optimum = quadratic(size)
    search = Search.start(np.zeros(size), np.eye(size), Options(samples=200, rounds=120))
    found, history = minimise(cost, search, rng=np.random.default_rng(1))
    assert np.allclose(found.mean, optimum, atol=1e-4)
    assert found.best_cost == pytest.approx(1.5, abs=1e-6)
    assert list(history) == sorted(history, reverse=True)


def test_a_constraint_is_kept_by_what_counts():
    def cost(points):  # the optimum of the sum is at the edge of what counts
        return np.where(np.all(points >= 0.25, axis=1), points.sum(axis=1), np.inf)

    search = Search.start(np.ones(4), 0.1 * np.eye(4), Options(samples=300, rounds=80))
    found, _ = minimise(cost, search, rng=np.random.default_rng(0))
    assert np.all(found.best >= 0.25)
    assert found.best_cost == pytest.approx(1.0, abs=2e-3)


def test_it_stops_at_its_target():
    cost, _ = quadratic(2)
    search = Search.start(np.zeros(2), np.eye(2), Options(samples=100, rounds=50, target=1.6))
    found, history = minimise(cost, search, rng=np.random.default_rng(0))
    assert found.best_cost <= 1.6
    assert len(history) < 50


def test_ask_and_tell_leave_what_they_are_given():
    cost, _ = quadratic(3)
    search = Search.start(np.zeros(3), np.eye(3), Options(samples=50))
    candidates = search.ask(np.random.default_rng(0))
    assert candidates.shape == (50, 3)
    later = search.tell(candidates, cost(candidates))
    assert np.array_equal(search.mean, np.zeros(3))
    assert later.best_cost == cost(candidates).min()
    assert np.all(np.linalg.eigvalsh(later.covariance) >= 0)


def test_the_elite_is_fitted_about_the_old_mean():
    options = Options(samples=10, elite=0.2)
    search = Search.start(np.zeros(1), np.eye(1), options)
    candidates = np.arange(10.0)[:, None]
    later = search.tell(candidates, -candidates[:, 0])  # elites 9 and 8
    first, second = math.log(2.5) - math.log(1), math.log(2.5) - math.log(2)
    share = first / (first + second)
    assert later.mean == pytest.approx([9 * share + 8 * (1 - share)])
    news = 2 / (2 + 10)  # two elites in one dimension
    assert later.covariance == pytest.approx(np.array([[1 - news + news * (81 * share + 64 * (1 - share))]]))


def test_a_round_in_which_nothing_counts_draws_more_narrowly_next_time():
    search = Search.start(np.zeros(2), np.eye(2), Options(samples=20))
    later = search.tell(search.ask(np.random.default_rng(0)), np.full(20, np.inf))
    assert np.array_equal(later.covariance, np.eye(2) / 4)
    assert later.best_cost == math.inf


# Several populations


def valleys(points):
    """Two valleys along each axis, the one at -1 deeper by 0.3 than the one at +1."""
    return (np.minimum((points + 1) ** 2, (points - 1) ** 2 + 0.3)).sum(axis=1)


def ended(populations, seed):
    options = Options(samples=400, rounds=40, batch=40, populations=populations)
    search = Search.start(np.full(3, 0.4), 0.3 * np.eye(3), options)
    return minimise(valleys, search, rng=np.random.default_rng(seed))[0].best_cost


@pytest.mark.slow
def test_several_populations_miss_the_deeper_valley_less_often_than_one():
    one, four = (np.array([ended(populations, seed) for seed in range(12)]) for populations in (1, 4))
    assert four.mean() < one.mean() - 0.05
    assert np.all(np.isclose(four % 0.3, 0, atol=1e-3) | np.isclose(four % 0.3, 0.3, atol=1e-3))  # the bottom of a valley


def test_the_worse_half_leaves_twice_and_the_best_cost_stays():
    options = Options(samples=80, rounds=10, batch=20, populations=4)
    state, rng, left, best = Tournament.start(Search.start(np.ones(2), np.eye(2), options)), np.random.default_rng(0), [], []
    cost, _ = quadratic(2)
    for _ in range(40):
        candidates = state.ask(rng)
        assert candidates.shape == (20, 2)
        state = state.tell(candidates, cost(candidates))
        left.append(len(state.searches))
        best.append(state.best.best_cost)
    assert left == [4] * 19 + [2] * 10 + [1] * 11
    assert best == sorted(best, reverse=True)


def test_small_budgets_are_one_population_and_one_batch_a_round():
    assert (Options().gaussians, Options().sizes) == (1, (200,))
    large = Options(samples=1000, rounds=200)
    assert (large.gaussians, large.sizes) == (4, (250,) * 4)
    assert Options(samples=1001, rounds=10, batch=300).sizes == (334, 334, 333)


def test_each_round_draws_exactly_its_samples_however_many_populations_there_are():
    cost, _ = quadratic(2)
    rounds = []
    search = Search.start(np.zeros(2), np.eye(2), Options(samples=103, rounds=7, batch=20, populations=3))
    minimise(
        cost,
        search,
        rng=np.random.default_rng(0),
        watch=lambda i, candidates, costs: rounds.append((i, len(candidates), len(costs))),
    )
    assert rounds == [(i, 103, 103) for i in range(7)]


def test_populations_with_the_same_seed_give_the_same_bytes():
    cost, _ = quadratic(4)

    def once():
        search = Search.start(np.zeros(4), np.eye(4), Options(samples=120, rounds=9, batch=30, populations=4))
        found, history = minimise(cost, search, rng=np.random.default_rng(5))
        return found.best.tobytes(), history

    assert once() == once()


# Paths


def shipped():
    for name in ("hoops-sequence", "hoops-published"):
        mission = load_mission(name)
        yield mission, "quad0", route_sequence(mission)
    mission = load_mission("firefighting")
    yield (
        mission,
        "quad0",
        route(mission, "quad0", [Visit(region="water", actions=mission.robot.actions), Visit(region="smoke")]),
    )


def test_shipped_paths_become_cheaper_and_keep_their_word():
    for mission, robot, nominal in shipped():
        found = improve(
            mission, robot, nominal, rng=np.random.default_rng(0), options=Options(samples=100, rounds=15), cost=EFFORT
        )
        assert found.cost < found.nominal
        assert found.cost == pytest.approx(plan_cost(found.plan, EFFORT))
        assert found.nominal == pytest.approx(plan_cost(nominal, EFFORT))
        assert (found.plan.word, found.plan.visits) == (nominal.word, nominal.visits)
        assert found.plan.waypoints[0].position == nominal.waypoints[0].position
        assert len(found.history) == len(found.kept) == 15
        assert list(found.history) == sorted(found.history, reverse=True)


def judged(mission, plan):
    trajectory = nominal_trajectory([w.position for w in plan.waypoints], plan.times, cycle=plan.cycle_waypoint)
    flown = Trajectory(
        trajectory.durations.astype(np.float32), trajectory.coefficients.astype(np.float32), cycle=trajectory.cycle
    )
    robots = {"quad0": plan}
    claims = judge(Plan(mission=mission, robots=robots), {"quad0": flown}).claims
    return [claim.sentence for claim in claims if claim.outcome != "holds"]


@pytest.mark.slow
def test_every_returned_path_passes_the_judge():
    cases = [(m, p) for m, _, p in shipped() if len(m.agents) == 1] + courses(seed=21, count=2)
    for mission, nominal in cases:
        found = improve(
            mission, "quad0", nominal, rng=np.random.default_rng(0), options=Options(samples=60, rounds=10), cost=EFFORT
        )
        assert found.cost < found.nominal
        assert judged(mission, nominal) == []
        assert judged(mission, found.plan) == []


@pytest.mark.slow
def test_paths_of_several_populations_pass_the_judge_and_give_the_same_bytes():
    ((mission, nominal),) = courses(seed=22, count=1)
    options = Options(samples=60, rounds=12, batch=20, populations=3)
    once, again = (
        improve(mission, "quad0", nominal, rng=np.random.default_rng(0), options=options, cost=EFFORT) for _ in range(2)
    )
    assert once.cost < once.nominal
    assert once.plan == again.plan
    assert judged(mission, once.plan) == []


def test_populations_begin_at_the_nominal_path_and_over_and_under_it():
    mission = load_mission("hoops-sequence")
    nominal = route_sequence(mission)
    problem = path_problem(mission, nominal, EFFORT)
    middle, raised, lowered = (problem.paths(start[None]).position[0] for start in problem.starts())
    at = np.linspace(nominal.times[0], nominal.times[-1], len(middle))
    for over, sign in ((raised, 1), (lowered, -1)):
        assert np.isfinite(problem.costs(problem.starts()[1 if sign > 0 else 2][None])[0])
        moved = over[:, 2] - middle[:, 2]
        assert sign * moved[np.argmax(np.abs(moved))] > 0.09
        assert np.allclose(over[:, :2], middle[:, :2], atol=1e-9)
        for visit in problem.visits:
            assert abs(moved[np.argmin(np.abs(at - visit))]) < 0.1
    large, small = Options(samples=1000, rounds=200), Options()
    assert [len(searches(problem, options)) for options in (large, small)] == [3, 1]
    one = searches(problem, small)[0]
    assert np.array_equal(one.mean, problem.mean)
    assert one.best_cost == problem.costs(problem.mean[None])[0]


@pytest.mark.slow
def test_blocks_of_a_round_cost_what_the_round_costs():
    mission = load_mission("hoops-sequence")
    problem = path_problem(mission, route_sequence(mission), EFFORT)
    root = np.linalg.cholesky(problem.covariance(0.04))
    candidates = problem.mean + np.random.default_rng(0).standard_normal((540, len(problem.mean))) @ root.T
    costs = problem.costs(candidates)
    assert 50 < np.isfinite(costs).sum() < 520
    assert costs == pytest.approx(np.concatenate([problem.costs(c[None]) for c in candidates]), rel=1e-9)


def test_the_same_seed_gives_the_same_bytes():
    mission = load_mission("hoops-published")
    nominal = route_sequence(mission)

    def once(seed):
        found = improve(mission, "quad0", nominal, rng=np.random.default_rng(seed), options=Options(samples=40, rounds=5))
        return Plan(mission=mission, robots={"quad0": found.plan}).to_json()

    assert once(3) == once(3)
    assert once(3) != once(4)


def test_a_path_that_nothing_improves_is_returned_as_it_was():
    mission = load_mission("hoops-published")
    nominal = route_sequence(mission)
    found = improve(
        mission,
        "quad0",
        nominal,
        rng=np.random.default_rng(0),
        options=Options(samples=20, rounds=1),
        cost=lambda p: np.ones(len(p)),
    )
    assert found.plan.waypoints == nominal.waypoints
    assert found.cost == found.nominal == 1.0


def test_any_function_of_sampled_paths_is_a_cost():
    mission = load_mission("hoops-published")
    nominal = route_sequence(mission)
    highest = lambda paths: paths.position[:, :, 2].max(axis=1)  # noqa: E731
    found = improve(
        mission, "quad0", nominal, rng=np.random.default_rng(0), options=Options(samples=100, rounds=10), cost=highest
    )
    assert found.cost < found.nominal


def test_a_cost_that_returns_nan_is_refused():
    mission = load_mission("hoops-published")
    with pytest.raises(CostError, match="nan"):
        improve(
            mission,
            "quad0",
            route_sequence(mission),
            rng=np.random.default_rng(0),
            cost=lambda paths: np.full(len(paths), np.nan),
        )


def test_a_robot_that_stays_where_it_is_has_nothing_to_improve():
    mission = load_mission("firefighting")
    idle = route(mission, "quad1", ())
    found = improve(mission, "quad1", idle, rng=np.random.default_rng(0))
    assert found.plan.waypoints == idle.waypoints
    assert (found.cost, found.history) == (0.0, ())


def test_options_come_from_the_mission():
    options = options_of(load_mission("firefighting"))
    assert (options.samples, options.rounds, options.elite) == (50, 12, 0.1)


def test_rounds_can_be_watched():
    mission = load_mission("hoops-published")
    seen = []
    improve(
        mission, "quad0", route_sequence(mission), rng=np.random.default_rng(0), options=Options(samples=30, rounds=3),
        watch=lambda index, problem, candidates, costs: seen.append((index, problem.paths(candidates).position.shape, costs.shape)),
    )  # fmt: skip
    assert [s[0] for s in seen] == [0, 1, 2]
    assert all(s[1][0] == 30 and s[1][2] == 3 and s[2] == (30,) for s in seen)


def test_a_lassos_closing_point_moves_with_its_first():
    mission = load_mission("hoops-published")
    problem = path_problem(mission, route_sequence(mission), EFFORT)
    moved = problem.points(problem.mean[None] + 0.1)
    assert problem.spline.cycle is not None
    assert np.array_equal(moved[:, -1], moved[:, problem.spline.cycle])
    assert np.array_equal(moved[0, 0], problem.nominal[0])


def test_the_word_of_a_plan_is_not_touched():
    mission = load_mission("hoops-published")
    plan = route_sequence(mission)
    assert plan.word == Word.of([[], ["hoop1"], []], [["hoop2"], []])


def test_optimised_laps_fit_the_vehicles_memory():
    mission = load_mission("hoops-ltl")
    nominal = route(mission, "quad0", [Visit(region=n) for n in ("hoop0", "hoop2", "hoop1")], 0)
    found = improve(
        mission, "quad0", nominal, rng=np.random.default_rng(0), options=Options(samples=100, rounds=20), cost=EFFORT
    )
    assert found.cost < found.nominal
    assert flown_pieces(mission, found.plan) <= 30
    cycle = found.plan.cycle_waypoint
    assert cycle is not None
    assert flown_pieces(mission, found.plan) == cycle + 2 * (len(found.plan.waypoints) - 1 - cycle)


def test_a_word_too_long_for_the_search_keeps_its_nominal_path():
    mission, _ = courses(seed=4, count=1, hoops=4, passages=4)[0]
    longer = mission.model_copy(update={"sequence": " ".join([str(mission.sequence)] * 8)})
    nominal = route_sequence(longer)
    found = improve(longer, "quad0", nominal, rng=np.random.default_rng(0), options=Options(samples=40, rounds=2))
    assert found.cost <= found.nominal
    assert [v.region for v in found.plan.visits] == [v.region for v in nominal.visits]


@few_of(1, "seed", range(3))
def test_prefix_and_suffix_come_below_five_metres_where_they_are_not_at_first(seed: int) -> None:
    """Scenario 4.3's example J <= 5, on a course whose nominal lap is above it; a sample that is not kept ends no search."""
    nominal, found, _ = under_the_limit(seed)
    before, after = lengths(nominal), lengths(found.plan)
    assert before[1] is not None
    assert after[1] is not None
    assert before[1] > 6.0
    assert max(after[0], after[1]) <= LIMIT
    assert found.cost <= LIMIT < found.history[0]
    assert 5 < len(found.history) < 60  # it takes rounds, and stops when it is there
    assert found.plan.word == nominal.word


def test_the_path_below_five_metres_is_certified() -> None:
    mission = wide_course()
    _, found, _ = under_the_limit(0)
    plan = Plan(mission=mission, robots={"quad0": found.plan}, method="sequence")
    done = certified_team(plan)
    assert done.certificate.holds
    flown = done.team["quad0"]
    assert flown.cycle is not None
    at = flown.evaluate(np.linspace(flown.knots[flown.cycle], flown.knots[-1], 4000))[:, :3]
    assert np.linalg.norm(np.diff(at, axis=0), axis=1).sum() <= LIMIT
