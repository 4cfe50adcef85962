"""Set-points that are rounded, of some age and without high derivatives, and starts that are not at rest: bounds against flights."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.vehicles.disturbed_flights import Disturbed
from tests.verify.tracking.test_proof import AIRFRAME, VEHICLE, bound_of, hover, line, require_steps_within_inputs
from verify.data import BadInput, Trajectory
from verify.data.disturbance import Disturbance, StreamedSetpoints, Unrest
from verify.tracking.loops import LoopChoice, lateral_loop
from verify.tracking.proof import _Loops, cells_of, model_of
from verify.tracking.sampled_loop import SUBSTEPS, kernels_of

STILL = Disturbance(airframe=AIRFRAME, sag=0.0)
MILLIMETRES = StreamedSetpoints(position=0.00087, velocity=0.00087, acceleration=0.00087)
SENT = {
    "rounded": MILLIMETRES, "floats": StreamedSetpoints(position=1e-7, velocity=1e-7, acceleration=1e-6, jerk=1e-5, snap=1e-4),
    "jerk and snap": StreamedSetpoints(jerk=0.05, snap=1.0), "late": StreamedSetpoints(age=(0.0, 0.01)), "always late": StreamedSetpoints(age=(0.03, 0.03)),
    "no snap": StreamedSetpoints(orders=3), "no jerk": StreamedSetpoints(orders=2), "heading": StreamedSetpoints(heading=0.02),
    "all": StreamedSetpoints(age=(0.01, 0.016), orders=3, position=2e-4, velocity=2e-4, acceleration=2e-4, jerk=0.01, heading=0.005),
}  # fmt: skip


def stream(told: StreamedSetpoints, n: int, rng: np.random.Generator, aimed: np.ndarray | None = None):
    """Return set-points at their worst: errors and ages jump between their ends, each in its own rhythm; or errors of places are aimed."""
    ticks = 400
    hold = rng.integers(1, 30, (6, n))

    def jumping(row: int):
        table = rng.normal(size=(ticks, 3, n))
        table[:, 2] *= rng.choice([0.0, 1.0], n)
        table /= np.linalg.norm(table, axis=1, keepdims=True)
        return np.stack([table[np.arange(ticks) // hold[row, k], :, k] for k in range(n)], axis=-1)

    errors = [size * jumping(order) for order, size in enumerate(told.rounding)]
    if aimed is not None:
        errors[0] = told.position * aimed
    ages = np.array(told.age)[rng.integers(0, 2, (ticks, n))]
    ages = np.stack([ages[np.arange(ticks) // hold[5, k], k] for k in range(n)], axis=-1)
    turned = told.heading * rng.choice([-1.0, 1.0], n)

    def at(tick: int, path: Trajectory):
        times = np.maximum(0.02 * tick - ages[tick], 0.0)
        flat = np.stack([path.evaluate(times, order).T for order in range(5)])
        before = 0.02 * tick < ages[tick]
        flat[1:, :, before] = 0.0
        flat[told.orders + 1 :] = 0.0
        for order in range(told.orders + 1):
            flat[order, :3] += errors[order][tick]
        flat[0, 3] += turned
        return flat

    return at


def farthest(flights: Disturbed, path: Trajectory, duration: float):
    flown = flights.fly(VEHICLE, path, duration)
    return np.linalg.norm(flown, axis=1).reshape(-1, SUBSTEPS, flights.n).max(1)


@few_of(2, "name", [*SENT])
@pytest.mark.parametrize("path", [line(0.3, 2.4)], ids=["line"])
def test_no_flight_on_streamed_set_points_leaves_its_bound(name, path):
    told = STILL.changed(setpoints=SENT[name], wind=0.02)
    rng, proved = np.random.default_rng(5), bound_of(path, told)
    ways = rng.normal(size=(40, 3, 24))
    winds = told.wind * ways / np.linalg.norm(ways, axis=1, keepdims=True)
    flights = Disturbed(24, given=stream(SENT[name], 24, rng), wind=lambda t: winds[round(t / 0.002) // 50])
    away = farthest(flights, path, path.duration)
    assert np.all(away.max(1) <= proved.course[: len(away)])
    assert proved.bound < 12.0 * away.max()


@few_of(1, "name", ["rounded", "jerk and snap", "no snap", "heading"])
def test_every_state_stays_within_its_bound_on_streamed_set_points(name):
    path, told = line(0.03, 0.8), STILL.changed(setpoints=SENT[name], wind=0.01)
    model = model_of(path, path.duration, tuple(path.coefficients[0, :3, 0]), VEHICLE, told)
    (cell,) = cells_of(model)
    bounds, _ = _Loops(model, cell).kept()
    flights = Disturbed(16, given=stream(SENT[name], 16, np.random.default_rng(8)), watch=True)
    flights.fly(VEHICLE, path, path.duration)
    proved = {"p": bounds.lateral["p"], "p_up": bounds.vertical["p"], "d": bounds.lateral["d"], "e": bounds.lateral["e"]}
    proved |= {"mu": bounds.lateral["mu"], "b": bounds.vertical["b"], "o": bounds.heading["o"], "f": bounds.heading["f"]}
    for state, bound in proved.items():
        flown = np.array([step[state] for step in flights.log]).max(1).reshape(len(bound), SUBSTEPS).max(1)
        assert np.all(flown <= bound + 1e-9), (state, float((flown / bound).max()))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rounded", "jerk and snap", "no snap", "no jerk", "heading"])
def test_each_step_leaves_no_more_than_its_inputs_allow_on_streamed_set_points(name):
    path = line(0.3, 2.4)
    flights = Disturbed(12, given=stream(SENT[name], 12, np.random.default_rng(9)))
    require_steps_within_inputs(path, STILL.changed(setpoints=SENT[name], wind=0.01), flights)


def test_rounding_that_is_aimed_comes_near_its_bound():
    """Errors of positions with the signs of the loop's response, read backwards: a hover goes at least half as far as is proved."""
    path, told = hover(2.0), STILL.changed(setpoints=StreamedSetpoints(position=3e-4))
    loop = lateral_loop(VEHICLE, AIRFRAME, LoopChoice(1.0, 1.0, 0, 1.0))
    x, answer = loop.commanded["place"].mid[:, 0].copy(), []
    for tick in range(100):
        x = loop.jump.mid @ x if tick else x
        for _ in range(SUBSTEPS):
            x = loop.step.mid @ x
            x[[t for _, t in loop.recorded]] = x[[s for s, _ in loop.recorded]]
        answer.append(x[0])
    aimed = np.zeros((400, 3, 1))
    aimed[:100, 0, 0] = np.sign(answer[::-1])
    away = farthest(Disturbed(1, given=stream(told.setpoints, 1, np.random.default_rng(0), aimed)), path, path.duration)
    proved = bound_of(path, told)
    assert kernels_of(loop, 100).gain("xi", "place") * 3e-4 * 0.95 < away.max() <= proved.bound <= 2.0 * away.max()


def test_a_late_stream_is_behind_its_plan_by_what_it_flies_meanwhile():
    path = line(0.3, 2.4)
    fastest = max(np.linalg.norm(path.evaluate(t, 1)[:3]) for t in np.linspace(0.0, 2.4, 500))
    on_time, late = (bound_of(path, STILL.changed(setpoints=StreamedSetpoints(age=(age, age)))) for age in (0.0, 0.04))
    assert 0.5 * 0.04 * fastest < late.bound - on_time.bound <= 0.04 * fastest * (1.0 + 1e-3)


@few_of(1, "name", ["position", "velocity", "acceleration", "jerk", "snap", "heading", "age", "orders"])
def test_more_of_an_error_of_set_points_is_never_a_smaller_bound(name):
    sizes = {"position": 1e-3, "velocity": 2e-3, "acceleration": 5e-3, "jerk": 0.05, "snap": 1.0, "heading": 0.02}
    steps = {"age": [(0.0, 0.0), (0.0, 0.004), (0.0, 0.008)], "orders": [4, 3, 2]}
    values = steps.get(name) or [share * sizes[name] for share in (0.1, 0.5, 1.0)]
    path, told = line(0.3, 2.4), StreamedSetpoints()
    bounds = [bound_of(path, STILL.changed(setpoints=told.changed(**{name: value}))).bound for value in values]
    assert bounds == sorted(bounds)
    assert bounds[0] < bounds[-1]


REST = {"speed": 0.01, "tilt": 0.01, "turn": 0.05, "heading": 0.03, "rotors": 0.01, "summed": 0.03}


@few_of(1, "names", [[*REST], *([name] for name in REST)], ids=["all", *REST])
def test_no_flight_that_begins_off_rest_leaves_its_bound(names):
    path, n, rng = line(0.015, 0.6), 40, np.random.default_rng(len(names))
    rest = Unrest(**{name: REST[name] / len(names) ** 0.5 for name in names})
    told = STILL.changed(rest=rest, start=0.001, latency=(0.0, 0.01))

    def way(size: float, rows: int = 3):
        found = rng.normal(size=(rows, n))
        return size * found / np.linalg.norm(found, axis=0)

    tilt = way(rest.tilt, 3)
    tilt[:2] *= rest.tilt / np.maximum(np.linalg.norm(tilt[:2], axis=0), 1e-12)
    tilt[2] = 0.95 * rest.heading * rng.choice([-1.0, 1.0], n)
    begun = {"speed": way(rest.speed), "turn": way(rest.turn), "summed": way(rest.summed), "tilt": tilt}
    begun["rotors"] = 1.0 + rest.rotors * rng.choice([-1.0, 1.0], (4, n))
    ages = rng.integers(0, 6, 400)
    flights = Disturbed(n, offset=way(0.001), rest=begun, late=lambda tick: int(ages[tick]), watch=True)
    away, proved = farthest(flights, path, path.duration), bound_of(path, told)
    assert np.all(away.max(1) <= proved.course[: len(away)])
    model = model_of(path, path.duration, tuple(path.coefficients[0, :3, 0]), VEHICLE, told)
    bounds, _ = _Loops(model, cells_of(model)[0]).kept()
    states = {"d": bounds.lateral["d"], "e": bounds.lateral["e"], "mu": bounds.lateral["mu"], "b": bounds.vertical["b"]}
    states |= {"f": bounds.heading["f"], "o": bounds.heading["o"], "p": bounds.lateral["p"], "p_up": bounds.vertical["p"]}
    for state, bound in states.items():
        flown = np.array([step[state] for step in flights.log]).max(1).reshape(-1, SUBSTEPS).max(1)
        assert np.all(flown <= bound[: len(flown)] + 1e-9), state


@few_of(1, "name", [*REST])
def test_a_start_farther_from_rest_is_never_a_smaller_bound(name):
    bounds = [bound_of(hover(1.6), STILL.changed(rest=Unrest(**{name: share * REST[name]}))).bound for share in (0.0, 0.5, 1.0)]
    assert bounds == sorted(bounds)
    assert bounds[-1] > 1e-9


def test_a_stream_covers_another_only_where_it_says_no_less_of_each():
    assert MILLIMETRES.covers(StreamedSetpoints(position=0.0005))
    assert MILLIMETRES.covers(MILLIMETRES)
    for other in ({"jerk": 1e-6}, {"age": (0.0, 0.02)}, {"orders": 3}, {"position": 0.001}, {"heading": 1e-6}):
        assert not MILLIMETRES.covers(StreamedSetpoints(**other))
    assert StreamedSetpoints(orders=2).covers(StreamedSetpoints(orders=4))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"setpoints": {"age": (0.02, 0.01)}}, "age 0.02 to 0.01 s is no range"),
        ({"setpoints": {"orders": 1}}, "orders"),
        ({"setpoints": {"position": -0.001}}, "position"),
        ({"setpoints": {"late": 0.1}}, "late"),
        ({"rest": {"tilt": 1.0}}, "tilt"),
        ({"rest": {"speed": math.nan}}, "speed"),
    ],
)
def test_wrong_values_are_rejected_in_a_sentence(wrong, said):
    with pytest.raises(BadInput, match=said):
        STILL.changed(**wrong)
