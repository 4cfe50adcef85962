"""The proof of hovers under `mellinger` on its filter, against the simulator's own parts: laws, linear loop, bounds that no disturbed hover leaves."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from flight.control import mellinger, onboard_controller
from flight.model import ekf, timing
from flight.model.airframe import airframe_of
from flight.model.attitude import matrix
from flight.model.dynamics import QuadcopterDynamics
from tests.helpers.few import few_of
from tests.helpers.vehicles.disturbed_hovers import Hovers
from verify.data.airframe import load_airframe
from verify.data.autopilot import load_autopilot
from verify.data.disturbance import Disturbance
from verify.data.trajectory import Trajectory
from verify.data.vehicle import load_vehicle
from verify.tracking.error_model import NotProved
from verify.tracking.on_board import onboard_filter, onboard_laws, onboard_loop, onboard_model
from verify.tracking.on_board.onboard_filter import Filter
from verify.tracking.on_board.onboard_loop import SUBSTEPS, N
from verify.tracking.on_board.onboard_plan import follow, setpoints
from verify.tracking.on_board.onboard_proof import _Flight, loop_of, prove_on_board
from verify.tracking.on_board.rotations import estimated, flown, turned
from verify.tracking.on_board.slopes import Slopes, root, stacked
from verify.tracking.plan_samples import derivatives_at

VEHICLE, AIRFRAME, STOCK = load_vehicle("crazyflie-2.1"), load_airframe("crazyflie-2.1"), load_autopilot("crazyflie-2")
QUICK = STOCK.changed(ekf=STOCK.ekf.changed(least_turn=2e-5))
"""A filter that drops less."""
SMALL = Disturbance(
    airframe=AIRFRAME,
    wind=0.03,
    position=4e-5,
    latency=(0.014, 0.014),
    gyroscope=0.0015,
    mass=0.0008,
    thrust=0.002,
    sag=1e-4,
    start=1e-4,
)
SECONDS = 1.2
FRAMES = 120


def line(away, seconds, rest=0.0):
    """Return a way from rest to rest, and a hover behind it."""
    s = np.array([0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0]) / seconds ** np.arange(8)
    way, end = np.zeros((4, 8)), np.zeros((4, 8))
    way[:3], end[:3, 0] = np.outer(away, s), away
    way[2, 0], end[2, 0] = 1.0, 1.0 + away[2]
    return Trajectory([seconds, rest] if rest else [seconds], np.stack([way, end]) if rest else way[None])


STILL = line((0.0, 0.0, 0.0), SECONDS), SECONDS


def still(loop):
    """Return what a hover makes of the loop."""
    return follow(loop, STILL[0], FRAMES)


@pytest.fixture(scope="module")
def loop():
    return loop_of(VEHICLE, AIRFRAME, QUICK, 7, FRAMES)


@pytest.fixture(scope="module")
def hover(loop):
    """Return a hover whose bounds close, with its bound."""
    made = _Flight(loop, SMALL, still(loop), 0.0)
    return made, made.proved()


def exact(values):
    """Return numbers that are known, as a law takes them."""
    values = np.asarray(values, dtype=np.float64)
    return Slopes.variables(np.zeros(values.size))[: values.size] + values


def number(value: Slopes):
    return 0.5 * (value.centre.low + value.centre.high)


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
        middle, spread = 0.5 * (found.slope.low + found.slope.high), 0.5 * (found.slope.high - found.slope.low)
        assert np.all(np.abs(moved - middle @ v) <= spread @ np.abs(v) + 1e-12)


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
    none = Interval(np.zeros((*shape, n)), np.zeros((*shape, n)))
    centre = Interval(values.centre.low.reshape(shape), values.centre.high.reshape(shape))
    return centre, centre, none, like.size


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
    assert np.allclose(found[6:], change[10:13], rtol=1e-3, atol=2e-3)
    moved = number(turned(flown(exact(attitude + tiny * found[3:6]))))
    assert np.allclose(moved, matrix(after[6:10])[:, :, 0], atol=1e-11)


def column_of(values, k):
    return values[k][:, None]


def flown_linearly(loop, inputs, offset):
    """Return states of the linear loop after every step, under inputs by name: of every step, or of every frame. Shape (steps, N)."""
    frame, z, found = loop.frame, np.zeros(N), []
    for rows in (slice(0, 3), slice(23, 26), slice(36, 39), slice(42, 45)):
        z[rows] = offset
    for step in range(len(inputs["wind"])):
        if step and step % SUBSTEPS == 0:
            z = frame.jump.mid @ z
            for name in ("position", "attitude"):
                z = z + frame.jumped[name].mid @ inputs[name][step // SUBSTEPS]
        z = frame.step.mid @ z
        for name in ("wind", "gyroscope"):
            z = z + frame.stepped[name].mid @ inputs[name][step]
        if step % SUBSTEPS + 1 == frame.recorded:
            z[36:39], z[39:42] = z[0:3], z[6:9]
        found.append(z.copy())
    return np.array(found)


@pytest.mark.slow  # sums responses of other loops
@pytest.mark.parametrize("late", [0, 3, 5, 7, 9])
def test_the_linear_loop_flies_as_the_simulator_does_step_by_step(late):
    autopilot = STOCK.changed(ekf=STOCK.ekf.changed(least_turn=0.0))
    loop, steps = loop_of(VEHICLE, AIRFRAME, autopilot, late, 80), 400
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
    true, linear = hovers.fly(VEHICLE, autopilot, steps)[:, :, 0], flown_linearly(loop, inputs, offset)
    for mine, states in (
        (true[:, 0:6], linear[:, 0:6]), (2.0 * true[:, 7:10], linear[:, 6:9]), (true[:, 10:13], linear[:, 9:12]),
        (true[:, 13:19], linear[:, 23:29]), (2.0 * true[:, 20:23], linear[:, 29:32]),
    ):  # fmt: skip
        assert np.all(np.abs(mine - states).max(0) < 5e-3 * np.abs(states).max(0))


def before_recorded(back):
    """Return a response, read backwards, from before the cameras' records were taken of position and attitude."""
    before = back.copy()
    before[0:3], before[6:9] = back[0:3] + back[36:39], back[6:9] + back[39:42]
    before[36:42] = 0.0
    return before


@few_of(2, "row", [0, 2, 6, 9, 26])
def test_the_worst_signal_reaches_its_sum(row, loop):
    """Winds and errors of cameras with the signs of the response, read backwards, reach the sum of its magnitudes."""
    frame, responses = loop.frame, loop.responses
    steps = FRAMES * SUBSTEPS
    inputs = {"wind": np.zeros((steps, 3)), "gyroscope": np.zeros((steps, 3))}
    inputs |= {name: np.zeros((FRAMES, 3)) for name in ("position", "attitude")}
    back, reached = np.eye(N)[row], 0.0
    for step in range(steps - 1, -1, -1):
        if step % SUBSTEPS + 1 == frame.recorded:
            back = before_recorded(back)
        answer = back @ frame.stepped["wind"].mid
        inputs["wind"][step], reached = np.sign(answer), reached + np.abs(answer).sum()
        back = back @ frame.step.mid
        if step % SUBSTEPS == 0 and step:
            answer = back @ frame.jumped["position"].mid
            inputs["position"][step // SUBSTEPS], reached = np.sign(answer), reached + np.abs(answer).sum()
            back = back @ frame.jump.mid
    assert flown_linearly(loop, inputs, np.zeros(3))[-1, row] == pytest.approx(reached, rel=1e-9)
    most = responses.peaks["wind"][row].sum() + responses.peaks["position"][row].sum()
    assert 0.97 * most <= reached <= most * (1.0 + 1e-9)


@few_of(1, "draws", [4, 40])
def test_laws_stay_within_what_they_may_be_beside_linear_ones(draws, loop):
    rng = np.random.default_rng(3)
    sizes = np.concatenate([np.full(3, 5e-4), np.full(3, 0.03), [0.01, 0.01, 0.005], [0.05, 0.05, 0.02, 0.02], [0.01, 0.01, 0.01],
                            np.full(3, 1e-4), np.full(3, 1e-3), np.full(3, 2e-5), np.full(45, 0.05)])  # fmt: skip
    motion = np.concatenate([np.full(3, 0.05), np.full(3, 0.02), np.full(3, 0.1), np.full(4, 0.01), np.full(4, 0.02), np.full(3, 0.1),
                             [0.01, 0.02]])  # fmt: skip
    for law, linear, bound, size in (
        (loop._estimate, loop.filtered, loop.beside_filter, sizes), (loop._motion, loop.motion, loop.beside_motion, motion),
        (loop._aimed, loop._aim, loop.beside_aim, np.array([0.01, 0.01, 0.01, 0.02, 0.02, 0.01])),
    ):  # fmt: skip
        around = 0.5 * size * (rng.uniform(size=len(size)) > 0.5)
        if len(size) == 70:  # what is dropped is no more than there is
            around[22:25] = 0.0
        most = bound(size, around)
        v, middle = (
            np.concatenate([rng.choice([-1.0, 1.0], (len(size), draws)), rng.uniform(-1.0, 1.0, (len(size), draws))], axis=1)
            * most_of[:, None]
            for most_of in (size, around)
        )
        if len(v) == 70:
            v[22:25] = 0.0
        changed = number(law(Slopes.known(middle + v))) - number(law(Slopes.known(middle)))
        assert np.all(np.abs(changed - linear @ v) <= most[:, None] + 1e-13)


def adversaries(told, n, seed, frames=FRAMES):
    """Return hovers with winds and errors that jump between their ends, and corners of mass, thrust and start."""
    rng, steps = np.random.default_rng(seed), frames * SUBSTEPS

    def jumping(size, hold, count):
        ways = rng.normal(size=(count // hold + 2, 3, n))
        return size * np.repeat(ways / np.linalg.norm(ways, axis=1, keepdims=True), hold, axis=0)

    wind, gyro = (
        jumping(told.wind, int(rng.choice([25, 60, 150])), steps),
        jumping(told.gyroscope, int(rng.choice([1, 25, 150])), steps),
    )
    place = jumping(told.position, int(rng.choice([1, 5, 30])), frames)
    away = rng.normal(size=(3, n))
    return Hovers(
        n, wind=lambda k: wind[k], gyroscope=lambda k: gyro[k], place=lambda k: place[k], late=round(told.latency[1] / 0.002),
        mass=1 + told.mass * rng.choice([-1, 1], n), thrust=1 + told.thrust * rng.choice([-1, 1], n),
        offset=told.start * away / np.linalg.norm(away, axis=0),
    )  # fmt: skip


ALONE = {
    "wind": 0.03, "position": 4e-5, "gyroscope": 0.0015, "mass": 0.0008, "thrust": 0.002, "start": 1e-4, "attitude": 1e-4, "drag": 0.02, "moment": 1e-8,
    "sag": 2e-4, "latency": (0.012, 0.016),
}  # fmt: skip


@few_of(1, "name", [*ALONE])
def test_no_hover_leaves_its_bound_under_each_disturbance_alone(name, loop):
    told, n = Disturbance(airframe=AIRFRAME, **{"sag": 0.0, "latency": (0.014, 0.014), name: ALONE[name]}), 30
    flight, rng, steps = _Flight(loop, told, still(loop), 0.0), np.random.default_rng(len(name)), FRAMES * SUBSTEPS
    flights = adversaries(told, n, 3)

    def jumping(size, hold, count):
        ways = rng.normal(size=(count // hold + 2, 3, n))
        return size * np.repeat(ways / np.linalg.norm(ways, axis=1, keepdims=True), hold, axis=0)

    turned, pushed = jumping(told.attitude, 5, FRAMES), jumping(told.moment, 75, steps)
    ages, weaker = rng.integers(6, 9, FRAMES), told.sag * rng.choice([-1.0, 1.0], n) * rng.choice([0.0, 1.0], (12, n))
    flights.attitude, flights.moment, flights.sag = lambda k: turned[k], lambda k: pushed[k], lambda k: weaker[k // 60]
    flights.late = (lambda k: int(ages[k])) if name == "latency" else flights.late
    proved, worst = flight.proved(), 0.0
    for drag in (1.0 - told.drag, 1.0 + told.drag):
        flights.drag = drag
        found = flights.fly(VEHICLE, QUICK, steps)
        worst = max(worst, float(np.linalg.norm(found[:, :3], axis=1).max()))
        bounds = flight.kept["between"]
        for rows, most in ((slice(0, 6), bounds[:6]), (slice(10, 13), bounds[9:12])):
            assert np.all(np.abs(found[:, rows]).max((0, 2)) <= most)
    assert worst <= proved.bound
    assert worst > 1e-8 or name in ("drag", "latency"), "it disturbs a hover that is at rest"


@few_of(1, "seeds", [1, 3])
def test_no_disturbed_hover_leaves_the_bounds_of_any_state(seeds, hover):
    closed, proved = hover
    bounds = closed.kept["between"], closed.kept["states"]
    worst = 0.0
    for seed in range(seeds):
        found = adversaries(SMALL, 60, seed).fly(VEHICLE, QUICK, FRAMES * SUBSTEPS)
        worst = max(worst, float(np.linalg.norm(found[:, :3], axis=1).max()))
        for rows, most in ((slice(0, 6), bounds[0][:6]), (slice(10, 13), bounds[0][9:12]), (slice(13, 19), bounds[1][23:29])):
            assert np.all(np.abs(found[:, rows]).max((0, 2)) <= most)
        q = found[:, 6:10]
        tilt = np.abs(2.0 * (q[:, 2] * q[:, 3] - q[:, 0] * q[:, 1])), np.abs(2.0 * (q[:, 1] * q[:, 3] + q[:, 0] * q[:, 2]))
        assert max(float(one.max()) for one in tilt) <= bounds[0][6:8].min()
    assert worst <= proved.bound < 12.0 * worst


@pytest.mark.slow  # the worst signal reaches its sum, and no disturbed hover leaves its bounds, by default, too
def test_winds_with_the_signs_of_the_response_stay_within_the_bound_and_come_near(loop):
    steps, frame = FRAMES * SUBSTEPS, loop.frame
    calm = Disturbance(airframe=AIRFRAME, wind=0.03, latency=(0.014, 0.014), sag=0.0)
    back, wind = np.eye(N)[0], np.zeros((steps, 3))
    for step in range(steps - 1, -1, -1):
        if step % SUBSTEPS + 1 == frame.recorded:
            back = before_recorded(back)
        answer = back @ frame.stepped["wind"].mid
        wind[step] = calm.wind * answer / np.linalg.norm(answer)
        back = back @ frame.step.mid
        if step % SUBSTEPS == 0 and step:
            back = back @ frame.jump.mid
    autopilot = STOCK.changed(ekf=STOCK.ekf.changed(least_turn=0.0))
    found = Hovers(1, wind=lambda k: wind[k][:, None], late=7).fly(VEHICLE, autopilot, steps)
    proved = prove_on_board(VEHICLE, autopilot, calm, STILL)
    worst = float(np.linalg.norm(found[:, :3, 0], axis=1).max())
    assert worst <= proved.bound <= 2.0 * worst


@pytest.mark.slow
def test_a_vehicle_that_lags_more_than_its_model_is_caught(loop):
    calm = Disturbance(airframe=AIRFRAME, wind=0.03, latency=(0.014, 0.014), sag=0.0)
    hover = _Flight(loop, calm, still(loop), 0.0)
    hover.proved()
    rates = hover.kept["between"][9:12]
    for lag, within in ((1.0, True), (20.0, False)):
        flights = Hovers(1, wind=lambda k: np.array([[0.03 * (-1) ** (k // 150)], [0.0], [0.0]]), late=7, lag=lag)
        turning = np.abs(flights.fly(VEHICLE, QUICK, FRAMES * SUBSTEPS)[:, 10:13]).max((0, 2))
        assert bool(np.all(turning <= rates)) == within


MORE = (
    {"wind": 0.04}, {"position": 6e-5}, {"gyroscope": 0.002}, {"mass": 0.001}, {"thrust": 0.0025}, {"sag": 2e-4}, {"drag": 0.02},
    {"moment": 1e-8}, {"start": 2e-4}, {"attitude": 1e-4}, {"latency": (0.012, 0.016)},
)  # fmt: skip


@few_of(1, "changes", [MORE[::5], MORE], ids=["some", "each"])
def test_what_bounds_allow_grows_with_each_disturbance(changes, hover, loop):
    closed, _ = hover
    bounds = {name: 1.01 * value for name, value in closed.kept.items()}
    least = closed._after(bounds)
    for change in changes:
        more = _Flight(loop, SMALL.changed(**change), closed._plan, 0.0)._after(bounds)
        assert all(np.all(more[name] >= least[name] * (1.0 - 1e-12)) for name in least), change
        assert more["between"][:3].sum() > least["between"][:3].sum(), change


def test_set_points_are_the_commanders():
    path, times = line((0.5, -0.3, 0.2), 1.5), np.linspace(0.0, 1.5, 7)
    plan = derivatives_at(path, times)
    flat = np.zeros((5, 4, len(times)))
    flat[:, :3] = np.moveaxis(plan[:, :5], 0, 2)
    asked = onboard_controller.setpoint_of(flat, 0.0)
    mine = setpoints(plan).T
    assert np.allclose(mine, asked[[0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14]], atol=1e-12)


def flown_way(path, told, n, seed, autopilot, frames):
    """Return how far flights along a way are from it after every step, under disturbances that jump. Shape (steps, n)."""
    plan = derivatives_at(path, 0.002 * np.arange(frames * SUBSTEPS + 1))
    plan[:, 0] -= plan[0, 0]
    flights = adversaries(told, n, seed, frames)
    flights.plan = lambda tick: plan[SUBSTEPS * tick, :5]
    found = flights.fly(VEHICLE, autopilot, frames * SUBSTEPS)
    return np.linalg.norm(found[:, :3] - plan[1:, 0][:, :, None], axis=1)


FIRM = STOCK.changed(ekf=STOCK.ekf.changed(attitude_noise=0.0045))
"""A filter that trusts attitudes as the firmware does where nobody says otherwise; its dead zone is the firmware's."""


@pytest.mark.slow  # sums responses of loops for as long
def test_set_points_alone_are_followed_as_the_simulator_does():
    """What the linear loop and the laws beside it make of a way is the simulator's flight, far more exactly than the way is long."""
    exact_filter = STOCK.changed(ekf=STOCK.ekf.changed(least_turn=0.0))
    path, calm = line((0.1, 0.05, 0.02), 1.0, 0.2), Disturbance(airframe=AIRFRAME, latency=(0.014, 0.014), sag=0.0)
    loop = loop_of(VEHICLE, AIRFRAME, exact_filter, 7, FRAMES)
    plan = follow(loop, path, FRAMES)
    away = flown_way(path, calm, 1, 0, exact_filter, FRAMES).max()
    assert plan.away == pytest.approx(away, rel=2e-3)
    assert away > 0.004
    assert all(np.all(left < 1e-6) for left in plan.rest.values())


@pytest.mark.slow  # a hundred flights each, and the responses of loops for as long
@pytest.mark.parametrize(("seconds", "times"), [(1.2, 9.0), (3.0, 5.0)])
def test_no_disturbed_flight_along_a_way_leaves_its_bound(seconds, times):
    size, share, frames = (0.05, 0.4, 300) if seconds > 2.0 else (0.01, 0.2, FRAMES)
    told, path = SMALL.scaled(share).changed(latency=(0.004, 0.004)), line((size, 0.6 * size, 0.2 * size), seconds - 0.2, 0.2)
    proved = prove_on_board(VEHICLE, FIRM, told, (path, seconds))
    worst = flown_way(path, told, 100, 0, FIRM, frames).max()
    assert worst <= proved.bound < times * worst
    assert proved.costs["plan"] > 5e-4


def test_disturbances_that_are_too_much_are_refused(loop):
    with pytest.raises(NotProved, match="corrections of the attitude that the filter drops"):
        _Flight(loop, SMALL.changed(wind=2.0), still(loop), 0.0).proved()


def test_what_is_not_in_the_model_is_refused():
    with pytest.raises(NotProved, match="velocity"):
        prove_on_board(VEHICLE, QUICK, SMALL.changed(velocity=0.1), STILL)
    with pytest.raises(NotProved, match="late"):
        prove_on_board(VEHICLE, QUICK, SMALL.changed(latency=(0.02, 0.02)), STILL)
    with pytest.raises(NotProved, match="accelerates"):
        prove_on_board(VEHICLE, QUICK, SMALL, (line((2.0, 0.0, 0.0), SECONDS), SECONDS))
    with pytest.raises(NotProved, match="no gains"):
        prove_on_board(VEHICLE, STOCK.changed(mellinger=None), SMALL, STILL)
    assert mellinger.MELLINGER.settled
    assert onboard_laws.COVARIANCES == 45


@pytest.mark.slow  # sums responses of another loop
def test_gains_that_are_weak_are_refused():
    weak = STOCK.changed(mellinger=STOCK.mellinger.changed(attitude=(7.0, 7.0, 6.0)))
    with pytest.raises(NotProved):
        prove_on_board(VEHICLE, weak, SMALL, (line((0.0, 0.0, 0.0), 2.0), 2.0))  # in less time they do not come far
