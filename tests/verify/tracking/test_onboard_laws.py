"""Laws and the linear loop on board, `mellinger` on its filter, against the simulator's own parts."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from flight.control import onboard_controller
from flight.model import ekf, timing
from flight.model.airframe import airframe_of
from flight.model.attitude import matrix
from flight.model.dynamics import QuadcopterDynamics
from tests.helpers.few import few_of
from tests.helpers.vehicles.board_flights import (
    AIRFRAME,
    EARLY,
    FRAMES,
    QUICK,
    STOCK,
    VEHICLE,
    WAY,
    exact,
    line,
    number,
    summed,
)
from tests.helpers.vehicles.disturbed_hovers import Hovers
from verify.tracking.on_board import onboard_filter, onboard_loop, onboard_model
from verify.tracking.on_board.onboard_course import maps_of, slopes
from verify.tracking.on_board.onboard_filter import Filter
from verify.tracking.on_board.onboard_loop import LINKED, SUBSTEPS
from verify.tracking.on_board.onboard_plan import setpoints
from verify.tracking.on_board.onboard_proof import loop_of
from verify.tracking.on_board.onboard_sums import COUNT, INPUT, STEPPED
from verify.tracking.on_board.rotations import estimated, flown, turned
from verify.tracking.on_board.slopes import Slopes, root, stacked
from verify.tracking.plan_samples import derivatives_at


@pytest.fixture(scope="module")
def loop():
    return loop_of(VEHICLE, AIRFRAME, QUICK, 7, FRAMES)


def test_what_both_sides_take_for_granted_is_the_same():
    assert onboard_loop.SUBSTEPS == timing.FRAME_STEPS
    assert onboard_loop.H == timing.STEP
    assert timing.FRAME_STEPS * timing.STEP == onboard_filter.FRAME
    assert onboard_model.FULL_SCALE == onboard_controller.FULL_SCALE
    assert onboard_filter.NOISE_STEPS == ekf._NOISE_STEPS


def test_slopes_enclose_what_they_are_of():
    rng = np.random.default_rng(2)

    def law(v):
        a = (1.0 + v[0] * v[1]) / root(2.0 + v[2])
        return stacked([a - v[1] * a * a, (v[0] - 0.3 * v[2]).at_least(np.array(0.05)), 1.0 / (3.0 + v[1])])

    def by_hand(x, y, z):
        a = (1.0 + x * y) / np.sqrt(2.0 + z)
        return np.array([a - y * a * a, np.maximum(x - 0.3 * z, 0.05), 1.0 / (3.0 + y)])

    for _ in range(60):
        size = rng.uniform(0.0, 0.5, 3)
        found = law(Slopes.variables(size))
        v = rng.uniform(-size[:, None], size[:, None], (3, 200))
        values = by_hand(*v)
        assert np.all(values >= found.value.low[:, None] - 1e-12)
        assert np.all(values <= found.value.high[:, None] + 1e-12)
        moved = values - number(found)[:, None]
        assert np.all(np.abs(moved - found.slope @ v) <= found.wide @ np.abs(v) + 1e-12)


def world(attitude):
    """Return what turns speed and turns from body axes into the world's. Shape (9, 9)."""
    found = np.eye(9)
    found[3:6, 3:6] = found[6:, 6:] = matrix(attitude)[:, :, 0]
    return found


@few_of(4, "seed", range(20))
def test_the_filter_is_the_simulators(seed):
    rng, kalman, law = np.random.default_rng(seed), ekf.ExtendedKalman(QUICK.ekf, 0.01), Filter(QUICK.ekf)
    rows = kalman.at_first(np.zeros((3, 1)), np.array([[1.0], [0.0], [0.0], [0.0]]))
    mine, seen = rng.normal(scale=0.2, size=3), rng.normal(scale=0.2, size=3)
    rows[:3], rows[3:6] = rng.normal(scale=0.01, size=(3, 1)), rng.normal(scale=0.3, size=(3, 1))
    rows[6:10, 0] = number(estimated(exact(mine)))
    sensed = np.zeros((ekf.SENSED, 1))
    sensed[:3], sensed[3], sensed[4:7], sensed[11] = rng.normal(size=(3, 1)), 10.1, rng.normal(scale=0.01, size=(3, 1)), 1.0
    sensed[7:11, 0] = number(flown(exact(seen)))
    turn = world(rows[6:10])
    spread = turn @ rows[10:, 0].reshape(9, 9) @ turn.T
    known, none = kalman.known(rows)[:, 0], np.zeros(3)
    given = exact(np.concatenate([rows[:3, 0], known[3:6], mine, sensed[:3, 0], sensed[3], sensed[4:7, 0], seen, none]))
    covariance = Slopes(*(_reshaped(exact(spread.ravel()), given)))
    place, speed, attitude, after = law.after(
        given[0:3], given[3:6], given[6:9], covariance, (given[9:12], given[12]), (given[13:16], given[16:19], given[19:22])
    )
    rows = kalman.after(rows, sensed)
    expected = kalman.known(rows)[:, 0]
    assert np.allclose(number(place), expected[:3], atol=1e-13)
    assert np.allclose(number(speed), expected[3:6], atol=1e-13)
    assert np.allclose(number(estimated(attitude)), expected[6:], atol=1e-13)
    turn = world(rows[6:10])
    assert np.allclose(number(after), turn @ rows[10:, 0].reshape(9, 9) @ turn.T, atol=1e-17)


def _reshaped(values: Slopes, like: Slopes):
    """Return a matrix of known numbers that has the variables of another."""
    from verify.arithmetic.intervals import Interval

    shape, n = (9, 9), len(like.size)
    none = np.zeros((*shape, n))
    centre = Interval(values.centre.low.reshape(shape), values.centre.high.reshape(shape))
    return centre, centre, none, none, like.size


@few_of(3, "seed", range(20))
def test_the_motion_is_the_simulators(seed, loop):
    rng, frame = np.random.default_rng(seed), airframe_of(VEHICLE)
    velocity, attitude, rates = rng.normal(scale=0.5, size=3), rng.normal(scale=0.2, size=3), rng.normal(size=3)
    thrusts, asked = rng.normal(scale=0.05, size=4), rng.normal(scale=0.05, size=4)
    wind = rng.normal(scale=0.5, size=3)
    light = rng.uniform(0.9, 1.1)
    found = number(loop._motion(exact(np.concatenate([velocity, attitude, rates, thrusts, asked, wind, [light - 1.0, 0.0]]))))
    signs = onboard_model.SIGNS
    state = np.zeros((17, 1))
    state[3:6, 0], state[6:10, 0], state[10:13, 0] = velocity, number(flown(exact(attitude))), rates
    state[13:, 0] = frame.hover_speed * np.sqrt(1.0 + signs @ thrusts)
    command = frame.hover_speed * np.sqrt(1.0 + signs @ asked)[:, None]
    tiny = 1e-6
    after = QuadcopterDynamics(frame, np.array([VEHICLE.mass / light])).step(state, command, wind[:, None], tiny)
    change = (after - state)[:, 0] / tiny
    assert np.allclose(found[:3], change[3:6], atol=1e-4)
    assert np.allclose(found[6:9], change[10:13], rtol=1e-3, atol=2e-3)
    lagging = (asked - thrusts) / frame.rotor_lag + found[9:]
    turned_on = (after[13:] / frame.hover_speed) ** 2 - (state[13:] / frame.hover_speed) ** 2
    assert np.allclose(lagging, 0.25 * signs.T @ turned_on[:, 0] / tiny, rtol=1e-3, atol=1e-4)
    moved = number(turned(flown(exact(attitude + tiny * found[3:6]))))
    assert np.allclose(moved, matrix(after[6:10])[:, :, 0], atol=1e-11)


def column_of(values, k):
    return values[k][:, None]


def flown_linearly(maps, inputs, offset):
    """Return states of the linear loop after every step, under inputs by name: of every step, or of every frame. Shape (steps, LINKED)."""
    z, found = np.zeros(LINKED), []
    for rows in (slice(0, 3), slice(23, 26), slice(36, 39), slice(42, 45)):
        z[rows] = offset
    for step in range(len(inputs["wind"])):
        frame, inside = divmod(step, SUBSTEPS)
        if step and inside == 0:
            z = maps.jumps[frame - 1] @ z
            for name, rows in (("position", slice(9, 12)), ("attitude", slice(12, 15))):
                z = z + maps.jumped[frame - 1][:, rows] @ inputs[name][frame]
        z = maps.steps[frame, inside] @ z
        for name, rows in (("gyroscope", slice(22, 25)), ("wind", slice(25, 28))):
            z = z + maps.stepped[frame, inside][:, rows] @ inputs[name][step]
        found.append(z.copy())
    return np.array(found)


@pytest.mark.slow  # sums responses of other loops
@pytest.mark.parametrize("late", [0, 3, 5, 7, 9])
def test_the_linear_loop_flies_as_the_simulator_does_step_by_step(late):
    autopilot = STOCK.changed(ekf=STOCK.ekf.changed(least_turn=0.0))
    course, steps = summed(autopilot, late, frames=80)[0], 400
    rng = np.random.default_rng(late)
    inputs = {
        "wind": 1e-4 * np.repeat(rng.choice([-1.0, 1.0], (steps // 20, 3)), 20, axis=0),
        "gyroscope": 1e-5 * rng.choice([-1.0, 1.0], (steps, 3)),
        "position": 1e-6 * rng.choice([-1.0, 1.0], (steps // SUBSTEPS, 3)),
        "attitude": 1e-4 * rng.choice([-1.0, 1.0], (steps // SUBSTEPS, 3)),
    }
    offset = np.array([1e-6, -2e-6, 1e-6])
    at = {name: partial(column_of, values) for name, values in inputs.items()}
    hovers = Hovers(
        1,
        wind=at["wind"],
        gyroscope=at["gyroscope"],
        place=at["position"],
        attitude=at["attitude"],
        late=late,
        offset=offset[:, None],
    )
    true, linear = hovers.fly(VEHICLE, autopilot, steps)[:, :, 0], flown_linearly(maps_of(course, slice(None)), inputs, offset)
    for mine, states in (
        (true[:, 0:6], linear[:, 0:6]), (2.0 * true[:, 7:10], linear[:, 6:9]), (true[:, 10:13], linear[:, 9:12]),
        (true[:, 13:19], linear[:, 23:29]), (2.0 * true[:, 20:23], linear[:, 29:32]),
    ):  # fmt: skip
        assert np.all(np.abs(mine - states).max(0) < 5e-3 * np.abs(states).max(0))


@few_of(1, "row", [0, 2, 6, 9, 26])
def test_the_worst_signal_reaches_its_sum(row):
    """Winds and errors of cameras that point as the response does, read backwards, reach the sum of its lengths, along a way too."""
    course, sums = summed(path=WAY[0], frames=EARLY)
    maps, last = maps_of(course, slice(None)), EARLY - 1
    steps = last * SUBSTEPS
    inputs = {"wind": np.zeros((steps, 3)), "gyroscope": np.zeros((steps, 3))}
    inputs |= {name: np.zeros((last, 3)) for name in ("position", "attitude")}
    back, reached = np.eye(LINKED)[row] @ maps.jumps[last - 1], 0.0
    for step in range(steps - 1, -1, -1):
        frame, inside = divmod(step, SUBSTEPS)
        answer = back @ maps.stepped[frame, inside][:, 25:28]
        inputs["wind"][step], reached = answer / np.linalg.norm(answer), reached + np.linalg.norm(answer)
        back = back @ maps.steps[frame, inside]
        if inside == 0 and step:
            answer = back @ maps.jumped[frame - 1][:, 9:12]
            inputs["position"][frame], reached = answer / np.linalg.norm(answer), reached + np.linalg.norm(answer)
            back = back @ maps.jumps[frame - 1]
    flown = maps.jumps[last - 1] @ flown_linearly(maps, inputs, np.zeros(3))[-1]
    assert flown[row] == pytest.approx(reached, rel=1e-9)
    unit = np.zeros((EARLY, SUBSTEPS, COUNT))
    unit[..., INPUT["wind"]], unit[:-1, :, INPUT["position"]] = 1.0, 1.0
    unit[last - 1, :, INPUT["position"]] = 0.0  # at the last jump
    most = sums.driven(unit[..., :STEPPED], unit[:, 0, STEPPED:])[last, row]
    assert 0.97 * most <= reached <= most


@few_of(1, "draws", [4, 40])
def test_laws_stay_within_what_they_may_be_beside_linear_ones(draws, loop):
    rng, instants = np.random.default_rng(3), 5
    sizes = {
        "filter": [np.full(3, 5e-4), np.full(3, 0.03), [0.01, 0.01, 0.005], [0.05, 0.05, 0.02, 0.02], [0.01, 0.01, 0.01],
                   np.full(3, 1e-4), np.full(3, 1e-3), np.full(3, 2e-5), np.full(45, 0.05)],
        "motion": [np.full(3, 0.05), np.full(3, 0.02), np.full(3, 0.1), np.full(4, 0.01), np.full(4, 0.02), np.full(3, 0.1), [0.01, 0.02]],
        "aim": [np.array([0.01, 0.01, 0.01, 0.02, 0.02, 0.01])], "lift": [np.array([0.01, 0.01, 0.01, 0.3, 0.3, 0.3])],
    }  # fmt: skip
    for name, parts in sizes.items():
        law, size = loop.laws[name], np.concatenate(parts)
        middles = rng.uniform(-8.0, 8.0, (len(size), instants)) * size[:, None]
        if name == "filter":  # what is dropped is no more than there is; covariances are near those that settle
            middles[22:25], middles[25:] = 0.0, 0.1 * middles[25:]
        slope, wide = slopes(law, middles, np.repeat(size[:, None], instants, axis=1))
        for k in range(instants):
            middle = middles[:, k]
            v = (
                np.concatenate(
                    [rng.choice([-1.0, 1.0], (len(size), draws)), rng.uniform(-1.0, 1.0, (len(size), draws))], axis=1
                )
                * size[:, None]
            )
            if name == "filter":
                v[22:25] = 0.0
            changed = number(law(Slopes.known(middle[:, None] + v))) - number(law(Slopes.known(middle[:, None])))
            assert np.all(np.abs(changed - slope[k] @ v) <= wide[k] @ np.abs(v) + 1e-13)


def test_set_points_are_the_commanders():
    path, times = line((0.5, -0.3, 0.2), 1.5), np.linspace(0.0, 1.5, 7)
    plan = derivatives_at(path, times)
    flat = np.zeros((5, 4, len(times)))
    flat[:, :3] = np.moveaxis(plan[:, :5], 0, 2)
    asked = onboard_controller.setpoint_of(flat, 0.0)
    mine = setpoints(plan).T
    assert np.allclose(mine, asked[[0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14]], atol=1e-12)


def test_thrusts_are_mixed_as_the_simulator_does(loop):
    rng, law = np.random.default_rng(4), loop.law
    asked = rng.normal(scale=[0.2, 0.1, 0.4, 0.4], size=(200, 4))
    hover, greatest = VEHICLE.mass * 9.80665 / 4.0, VEHICLE.rotor_thrust_max
    clipped = hover * np.clip(asked, -law.moments, law.moments).T
    # the simulator's rotors: front left comes last, and pitch counts against the rotors in front
    mixed = onboard_controller.mixed(hover + clipped[0], np.stack([clipped[2], clipped[3], clipped[1]]), np.full(200, greatest))
    mine = hover * (1.0 + law.mixed(asked) @ onboard_model.SIGNS.T).T
    assert np.allclose(np.sort(mine, axis=0), np.sort(mixed, axis=0), atol=1e-12)
    assert np.any(mixed.max(0) > 0.999 * greatest)
    assert np.any(mixed == 0.0)
