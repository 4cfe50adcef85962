"""The online method's laws: the threshold rests at the quantile, the mean goes to the optimum, Delta follows eq. 6.4."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ltlplan.online_mtac import cross_entropy as online
from ltlplan.online_mtac.cross_entropy import OnlineSettings
from tests.helpers.few import few_of
from tests.helpers.words.online_cross_entropy import beta, tell
from verify.data import BadInput

CALM = OnlineSettings(weight=0.0)


def row(points=1, dimension=2, *, variance=0.1, settings=OnlineSettings(), rng=None):  # noqa: B008 - frozen
    return online.start(np.zeros((points, dimension)), variance, rng or np.random.default_rng(0), settings=settings)


def follow(chosen, steps, rng):
    """Feed the threshold of a row with costs from an exponential distribution of mean 2; return both a step."""
    state, path = replace(row(1, 1, variance=0.5, settings=chosen, rng=rng), threshold=1.0), np.zeros((1, 1, 1))
    for _ in range(steps):
        costs = rng.exponential(2.0, size=1)
        yield state.threshold, costs[0]
        state = online.tell_all(state, path, costs, np.ones(1, bool), settings=chosen)


@few_of(1, "elite", [0.05, *(pytest.param(elite, marks=pytest.mark.slow) for elite in (0.1, 0.3)), 0.5])
def test_the_threshold_tracks_the_quantile_of_a_fixed_distribution(elite):
    # with the paper's a and b the step stays as large as the costs' own differences, so lambda is restless, but the
    # share of paths that pass it is rho; with a = 0 the step stays small and lambda itself is the quantile
    restless = list(follow(OnlineSettings(elite=elite, trajectories=100), 40_000, np.random.default_rng(7)))[1000:]
    passed = np.mean([cost <= threshold for threshold, cost in restless])
    assert passed == pytest.approx(elite, abs=0.01)
    calm = list(follow(OnlineSettings(elite=elite, trajectories=100, weight=0.0), 20_000, np.random.default_rng(8)))[5000:]
    assert np.mean([threshold for threshold, _ in calm]) == pytest.approx(-2 * math.log(1 - elite), abs=0.04)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_the_mean_converges_on_a_quadratic(seed):
    chosen, rng = OnlineSettings(), np.random.default_rng(seed)
    best = np.array([[1.0, -0.5, 0.8]])
    state = row(1, 3, variance=0.5, rng=rng)
    for _ in range(4000):
        paths = online.ask_all(state, rng, 1)
        state = online.tell_all(state, paths, np.sum((paths - best) ** 2, axis=(1, 2)), np.ones(1, bool), settings=chosen)
    assert np.abs(state.mean - best).max() < 0.05
    assert np.linalg.norm(state.root, axis=(1, 2)).max() < 0.1


@pytest.mark.parametrize(("cost", "share"), [(0.5, -0.9), (1.0, -0.9), (1.5, 0.1)])
def test_an_elite_lowers_the_threshold_and_others_raise_it(cost, share):
    state = replace(row(settings=CALM), threshold=1.0)
    after = online.tell_all(state, np.zeros((1, 1, 2)), np.array([cost]), np.ones(1, bool), settings=CALM)
    assert after.threshold == pytest.approx(1 + share * state.step)
    assert after.found == (share < 0)
    assert after.step == state.step


def test_paths_that_miss_the_hoop_leave_the_row_alone():
    chosen = OnlineSettings()
    state = online.tell_all(row(), np.zeros((1, 1, 2)), np.array([2.0]), np.ones(1, bool), settings=chosen)
    missed = online.tell_all(state, np.ones((1, 1, 2)), np.array([0.1]), np.zeros(1, bool), settings=chosen)
    for name in ("threshold", "step", "cost", "mean", "root", "elites", "found"):
        assert np.array_equal(getattr(missed, name), getattr(state, name), equal_nan=True), name
    assert missed.count == state.count + 1


def test_delta_is_first_the_quantile_step_and_then_not_computed_again():
    rng = np.random.default_rng(11)
    state = row(3, 3, variance=0.05, settings=CALM, rng=rng)
    before = state.step
    for _ in range(5):
        state = online.tell_all(state, online.ask_all(state, rng, 1), rng.normal(size=1), np.ones(1, bool), settings=CALM)
    assert state.step == before > 0


def test_beta_is_the_papers():
    assert beta(0) == pytest.approx(0.01)
    assert beta(1000) == pytest.approx(0.01 * math.exp(-1.0))


def test_the_same_seed_gives_the_same_bytes():
    def run():
        rng = np.random.default_rng(42)
        state = row(2, 3, variance=0.3, rng=rng)
        for _ in range(100):
            paths = online.ask_all(state, rng, 3)
            state = online.tell_all(state, paths, np.sum(paths**2, axis=(1, 2)), np.ones(3, bool), settings=OnlineSettings())
        return state.mean.tobytes(), state.threshold

    assert run() == run()


@pytest.mark.parametrize("keys", [{"trajectories": 10}, {"elite": 0.01}])
def test_too_few_trajectories_are_refused(keys):
    with pytest.raises(BadInput, match="more than 1 / rho"):
        OnlineSettings(**keys)


def test_paths_told_together_are_told_one_after_another_by_the_printed_recursion():
    chosen = OnlineSettings(window=3, weight=0.1, decay=0.01)
    rng = np.random.default_rng(9)
    one = together = row(2, 3, variance=0.2, settings=chosen, rng=rng)
    for _ in range(10):
        paths = online.ask_all(together, rng, 8)
        costs = np.sum(paths**2, axis=(1, 2))
        valid = rng.random(8) < 0.8
        for path, cost, good in zip(paths, costs.tolist(), valid.tolist(), strict=True):
            one = tell(one, path, cost, settings=chosen, valid=good)
        together = online.tell_all(together, paths, costs, valid, settings=chosen)
        for name in online.OnlineState.__slots__:
            assert getattr(one, name) == pytest.approx(getattr(together, name), nan_ok=True), name
