"""Kernels of sampled loops: closed forms, worst signals that reach them, tails."""

from itertools import product

import numpy as np
import pytest
from flint import arb, arb_mat

from tests.helpers.few import few_of
from verify.data.airframe import load_airframe
from verify.data.vehicle import load_vehicle
from verify.tracking.loops import LoopChoice, heading_loop, lateral_loop, vertical_loop
from verify.tracking.sampled_loop import SUBSTEPS, Matrix, SampledLoop, kernels_of

VEHICLE, AIRFRAME = load_vehicle("crazyflie-2.1"), load_airframe("crazyflie-2.1")


def scalar(shrink: float) -> SampledLoop:
    one = Matrix.exact(np.array([[1.0]]))
    return SampledLoop(
        ("x",), Matrix.exact(np.array([[shrink]])), one, (), SUBSTEPS, {"w": one}, {"v": one}, {"x": np.array([1.0])}
    )


@pytest.mark.parametrize("shrink", [0.5, -0.9, 0.99])
def test_a_loop_of_first_order_has_its_closed_form(shrink):
    kernels = kernels_of(scalar(shrink), 400)
    exact = 1.0 / (1.0 - abs(shrink))
    within = 1.0 + (1.0 - abs(shrink)) * SUBSTEPS  # each command counts the step at which it is largest
    assert exact * (1 - 1e-9) <= kernels.gain("x", "w") <= exact * within
    jumps = 1.0 / (1.0 - abs(shrink) ** SUBSTEPS)
    assert jumps <= kernels.gain("x", "v") <= jumps * (1 + 1e-6)


@pytest.mark.parametrize("remembered", [1, 3, 40])
def test_a_geometric_tail_is_no_less_than_the_sum_it_stands_for(remembered):
    whole, cut = kernels_of(scalar(0.99), 2000), kernels_of(scalar(0.99), 2000, remembered)
    for name in ("w", "v"):
        assert cut.gain("x", name) >= whole.gain("x", name) * (1 - 1e-9)
        assert cut.gain("x", name) <= whole.gain("x", name) * 3.0


def test_a_loop_that_does_not_settle_has_no_tail():
    with pytest.raises(ArithmeticError):
        kernels_of(scalar(1.01), 2000, 10)


@few_of(3, "make", [lateral_loop, vertical_loop, heading_loop])
@pytest.mark.parametrize("late", [0, 4, 10])
def test_tails_of_the_vehicles_loops_cover_what_is_summed(make, late):
    loop = make(VEHICLE, AIRFRAME, LoopChoice(1.02, 1.01, late, 0.9))
    whole, cut = kernels_of(loop, 900, 900), kernels_of(loop, 900, 200)
    for pair in product(whole.outputs, whole.inputs):
        assert cut.gain(*pair) >= whole.gain(*pair) * (1 - 1e-9), pair


@pytest.mark.parametrize("ticks", [1, 30, 700, 1600])
def test_a_response_is_the_sum_of_kernels_times_bounds(ticks):
    kernels = kernels_of(vertical_loop(VEHICLE, AIRFRAME, LoopChoice(1.0, 1.0, 2, 1.0)), ticks, 300)
    rng, once = np.random.default_rng(ticks), np.arange(ticks) == 0
    driven = {"acc": rng.uniform(0.0, 1.0, ticks), "place": rng.uniform(0.0, 1.0, ticks), "begin": 1.0 * once, "u": 0.0 * once}
    found, near = kernels.response(driven, ticks), kernels.near_response(driven, ticks)
    kept = kernels.sums.shape[-1]
    for row, output in enumerate(kernels.outputs):
        sums = np.zeros(ticks)
        for name, bound in driven.items():
            column = kernels.inputs.index(name)
            for tick in range(ticks):
                lags = np.arange(min(tick + 1, kept))
                sums[tick] += kernels.sums[row, column, lags] @ bound[tick - lags] + kernels.tails[row, column] * bound.max()
        np.testing.assert_allclose(found[output], sums, rtol=1e-12)
        np.testing.assert_allclose(near[output], sums, rtol=1e-9, atol=1e-12 * sums.max())
    assert not np.any(np.isfinite(kernels.near_response({"acc": np.full(ticks, np.inf)}, ticks)["xi"]))


@pytest.mark.parametrize("late", [0, 7])
def test_the_worst_signal_reaches_the_gain(late):
    """Inputs with the signs of the response, read backwards, move the loop by its gain, but for the step at which it is read."""
    loop = lateral_loop(VEHICLE, AIRFRAME, LoopChoice(1.0, 1.0, late, 1.0))
    ticks, gain = 300, kernels_of(loop, 300).gain("xi", "acc")
    step, jump, push = loop.step.mid, loop.jump.mid, loop.stepped["acc"].mid[:, 0]
    seen, taken = [s for s, _ in loop.recorded], [t for _, t in loop.recorded]

    def flown(signs):
        x = np.zeros(len(loop.states))
        for tick in range(ticks):
            x = jump @ x
            for sub in range(SUBSTEPS):
                x = step @ x + push * signs[tick * SUBSTEPS + sub]
                if sub + 1 == loop.seen:
                    x[taken] = x[seen]
        return x[0]

    answer, row = np.zeros(ticks * SUBSTEPS), np.eye(len(loop.states))[0]
    for k in range(ticks * SUBSTEPS - 1, -1, -1):  # the response, read backwards from the end
        if k % SUBSTEPS + 1 == loop.seen:
            row = row.copy()
            row[seen], row[taken] = row[seen] + row[taken], 0.0
        answer[k], row = row @ push, row @ step
        if k % SUBSTEPS == 0:
            row = row @ jump
    worst = flown(np.sign(answer))
    assert worst == pytest.approx(np.abs(answer).sum(), rel=1e-9)
    assert 0.9 * gain <= worst <= gain * (1 + 1e-12)


def test_gyroscopic_moments_and_what_the_law_asks_against_them_cancel_in_the_end():
    """Both as one input move tilts as they do apart, much less than the sum of both, and not at all where they last."""
    loop = lateral_loop(VEHICLE, AIRFRAME, LoopChoice(1.0, 1.0, 2, 1.0))
    kernels, at = kernels_of(loop, 300), loop.states.index("d")
    rng = np.random.default_rng(3)
    for signal in (rng.choice([-1.0, 1.0], 3000), np.repeat(rng.choice([-1.0, 1.0], 60), 50), np.ones(3000)):
        x, found = np.zeros(len(loop.states)), []
        for step, size in enumerate(signal):
            x = loop.jump.mid @ x if step % SUBSTEPS == 0 else x
            x = loop.step.mid @ x + (loop.stepped["u"].mid[:, 0] - loop.stepped["eacc"].mid[:, 0]) * size
            if step % SUBSTEPS + 1 == loop.seen:
                x[[t for _, t in loop.recorded]] = x[[s for s, _ in loop.recorded]]
            found.append(abs(x[at]))
        assert max(found) <= kernels.gain("d", "spun")
    assert found[-1] < 0.01 * max(found)
    assert kernels.gain("d", "spun") < 0.5 * (kernels.gain("d", "u") + kernels.gain("d", "eacc"))


def test_matrices_enclose_what_they_are_made_of():
    made = arb_mat(2, 2, [arb(1) / 3, arb(2), arb(0), arb(1) / 7])
    found = Matrix.of(made)
    assert np.all(found.rad < 1e-15)
    assert abs(found.mid[0, 0] - 1 / 3) <= found.rad[0, 0] + 1e-17
    product = found @ found
    assert np.all(np.abs(product.mid - np.array([[1 / 9, 20 / 21], [0.0, 1 / 49]])) <= product.rad + 1e-16)
