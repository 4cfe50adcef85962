"""The online method's laws: the threshold rests at the quantile, the mean goes to the optimum, Delta follows eq. 6.4."""

import math

import numpy as np
import pytest

from ltlplan.online_mtac import cross_entropy as online
from ltlplan.online_mtac.cross_entropy import OnlineSettings
from tests.helpers.few import few_of
from tests.helpers.online_cross_entropy import ask, beta, tell
from verify.data import BadInput

ALL = np.ones(1, dtype=bool)


def rows(count, **keys):
    return online.start(np.zeros((count, 1, 2)), 0.1, np.random.default_rng(0), settings=OnlineSettings(**keys))


def follow(chosen, steps, rng):
    """Feed the thresholds of 40 rows with costs from an exponential distribution of mean 2; return them a step."""
    state = online.start(np.zeros((40, 1, 1)), 0.5, rng, settings=chosen, threshold=1.0)
    for _ in range(steps):
        costs = rng.exponential(2.0, size=40)
        yield state.threshold, costs
        state = tell(state, np.zeros((40, 1, 1)), costs, np.ones(40, bool), settings=chosen)


@few_of(1, "elite", [0.05, *(pytest.param(elite, marks=pytest.mark.slow) for elite in (0.1, 0.3)), 0.5])
def test_the_threshold_tracks_the_quantile_of_a_fixed_distribution(elite):
    # with the paper's a and b the step stays as large as the costs' own differences, so lambda is restless, but the
    # share of paths that pass it is rho; with a = 0 the step stays small and lambda itself is the quantile
    restless = list(follow(OnlineSettings(elite=elite, trajectories=100), 4000, np.random.default_rng(7)))[1000:]
    passed = np.mean([costs <= threshold for threshold, costs in restless])
    assert passed == pytest.approx(elite, abs=0.01)
    calm = list(follow(OnlineSettings(elite=elite, trajectories=100, weight=0.0), 5000, np.random.default_rng(8)))[2500:]
    assert np.mean([threshold for threshold, _ in calm]) == pytest.approx(-2 * math.log(1 - elite), abs=0.04)


@pytest.mark.slow
def test_the_mean_converges_on_a_quadratic():
    chosen = OnlineSettings()
    rng = np.random.default_rng(3)
    best = np.array([[1.0, -0.5, 0.8]])
    state = online.start(np.zeros((8, 1, 3)), 0.5, rng, settings=chosen)
    for _ in range(4000):
        paths = ask(state, rng)
        costs = np.sum((paths - best) ** 2, axis=(1, 2))
        state = tell(state, paths, costs, np.ones(8, bool), settings=chosen)
    assert np.abs(state.mean - best).max() < 0.05
    assert np.linalg.norm(state.root, axis=(2, 3)).max() < 0.1


def test_an_elite_lowers_the_threshold_and_others_raise_it():
    state = rows(3, weight=0.0)
    state = online.OnlineState(*(np.ones(3) if n == "threshold" else getattr(state, n) for n in online.OnlineState.__slots__))
    after = tell(state, np.zeros((3, 1, 2)), np.array([0.5, 1.0, 1.5]), np.ones(3, bool), settings=OnlineSettings(weight=0.0))
    assert after.threshold == pytest.approx(1 + state.step * [-0.9, -0.9, 0.1])
    assert after.found.tolist() == [1, 1, 0]
    assert after.step == pytest.approx(state.step)


def test_paths_that_miss_the_hoop_leave_the_row_alone():
    state = tell(rows(1), np.zeros((1, 1, 2)), np.array([2.0]), ALL, settings=OnlineSettings())
    missed = tell(state, np.ones((1, 1, 2)), np.array([0.1]), ~ALL, settings=OnlineSettings())
    for name in ("threshold", "step", "cost", "mean", "root", "elites", "found"):
        assert np.array_equal(getattr(missed, name), getattr(state, name), equal_nan=True), name
    assert missed.count == state.count + 1


def test_delta_follows_the_printed_recursion():
    # a = 0.1, b = 0.01: Delta <- (1 - beta) Delta + beta |f_t - f_{t-1}|, beta = a exp(-b t), t from 0
    chosen = OnlineSettings(weight=0.1, decay=0.01)
    rng = np.random.default_rng(5)
    state = online.start(np.zeros((1, 1, 3)), 0.05, rng, settings=chosen)
    delta, last = float(state.step[0]), None
    for step in range(200):
        cost = float(rng.normal(5.0, 1.0))
        if last is not None:
            share = 0.1 * math.exp(-0.01 * step)
            delta = (1 - share) * delta + share * abs(cost - last)
        last = cost
        state = tell(state, ask(state, rng), np.array([cost]), ALL, settings=chosen)
        assert float(state.step[0]) == pytest.approx(delta)


def test_delta_is_first_the_quantile_step_and_then_not_computed_again():
    rng = np.random.default_rng(11)
    state = online.start(np.zeros((2, 3, 3)), 0.05, rng, settings=OnlineSettings(weight=0.0))
    before = state.step
    for _ in range(5):
        state = tell(state, ask(state, rng), rng.normal(size=2), np.ones(2, bool), settings=OnlineSettings(weight=0.0))
    assert np.array_equal(state.step, before)
    assert np.all(before > 0)


def test_beta_is_the_papers():
    assert beta(0) == pytest.approx(0.01)
    assert beta(1000) == pytest.approx(0.01 * math.exp(-1.0))


def test_rows_do_not_see_each_other():
    chosen = OnlineSettings(window=2)
    rng = np.random.default_rng(1)
    state = online.start(np.zeros((2, 1, 2)), 0.1, rng, settings=chosen)
    only_first = np.array([True, False])
    for _ in range(30):
        state = tell(state, ask(state, rng), rng.normal(size=2), only_first, settings=chosen)
    assert state.found[1] == 0
    assert np.isnan(state.threshold[1])
    assert np.array_equal(state.mean[1], np.zeros((1, 2)))


def test_the_same_seed_gives_the_same_bytes():
    def run():
        chosen = OnlineSettings()
        rng = np.random.default_rng(42)
        state = online.start(np.zeros((3, 2, 3)), 0.3, rng, settings=chosen)
        for _ in range(300):
            paths = ask(state, rng)
            state = tell(state, paths, np.sum(paths**2, axis=(1, 2)), np.ones(3, bool), settings=chosen)
        return state.mean.tobytes(), state.threshold.tobytes()

    assert run() == run()


def test_bad_settings_and_shapes_are_refused():
    for keys in ({"trajectories": 10}, {"elite": 0}, {"weight": 2.0}, {"decay": -1.0}, {"window": 1}, {"floor": -0.1}):
        with pytest.raises(BadInput):
            OnlineSettings(**keys)
    rng = np.random.default_rng(0)
    for mean, covariance in (
        (np.zeros((2, 3)), 0.1),
        (np.full((1, 1, 3), np.nan), 0.1),
        (np.zeros((1, 1, 3)), -0.1),
        (np.zeros((1, 1, 3)), np.eye(3)),
    ):
        with pytest.raises(BadInput):
            online.start(mean, covariance, rng, settings=OnlineSettings())


def test_paths_told_together_are_told_one_after_another():
    chosen = OnlineSettings(window=3, weight=0.1, decay=0.01)
    rng = np.random.default_rng(9)
    one = together = online.start(np.zeros((1, 2, 3)), 0.2, rng, settings=chosen)
    for _ in range(10):
        paths = online.ask_all(together, rng, 8)
        costs = np.sum(paths**2, axis=(1, 2))
        valid = rng.random(8) < 0.8
        for path, cost, good in zip(paths, costs, valid, strict=True):
            one = tell(one, path[None], np.array([cost]), np.array([good]), settings=chosen)
        together = online.tell_all(together, paths, costs, valid, settings=chosen)
        for name in online.OnlineState.__slots__:
            assert getattr(one, name) == pytest.approx(getattr(together, name), nan_ok=True), name
    with pytest.raises(BadInput, match="one row"):
        online.tell_all(rows(2), np.zeros((1, 1, 2)), np.zeros(1), ALL, settings=chosen)
