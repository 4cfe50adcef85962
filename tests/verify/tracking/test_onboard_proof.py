"""The proof of hovers under `mellinger` on its filter, against the simulator's own parts: laws, linear loop, bounds that no disturbed hover leaves."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from flight.control import mellinger, onboard_controller
from flight.model import ekf, timing
from flight.model.airframe import airframe_of
from flight.model.attitude import matrix, quaternion_rate, unit
from flight.model.dynamics import QuadcopterDynamics
from tests.helpers.few import few_of
from tests.helpers.vehicles.disturbed_hovers import Hovers
from verify.data.airframe import load_airframe
from verify.data.autopilot import load_autopilot
from verify.data.disturbance import Disturbance
from verify.data.trajectory import Trajectory
from verify.data.vehicle import load_vehicle
from verify.tracking.error_model import NotProved
from verify.tracking.on_board import onboard_filter, onboard_laws, onboard_loop, onboard_model, onboard_sums
from verify.tracking.on_board.onboard_course import maps_of, slopes
from verify.tracking.on_board.onboard_filter import Filter
from verify.tracking.on_board.onboard_loop import LINKED, SUBSTEPS
from verify.tracking.on_board.onboard_plan import follow, setpoints
from verify.tracking.on_board.onboard_proof import _Flight, loop_of, prove_on_board, summed_of
from verify.tracking.on_board.onboard_sums import COUNT, INPUT, STEPPED
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


WAY = line((0.25, -0.2, 0.08), 1.0, 0.2), SECONDS
"""A way on which a vehicle tilts by 0.2 rad."""
EARLY = 60
"""Frames of it that are flown, with its greatest tilts."""


def summed(autopilot=QUICK, late=7, path=STILL[0], frames=FRAMES):
    """Return what is linear about a flight, and its sums."""
    return summed_of(VEHICLE, AIRFRAME, autopilot, late, path, frames)


@pytest.fixture(scope="module")
def loop():
    return loop_of(VEHICLE, AIRFRAME, QUICK, 7, FRAMES)


@pytest.fixture(scope="module")
def hover():
    """Return a hover whose bounds close, with its bound."""
    made = _Flight(*summed(), SMALL, 0.0)
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


@pytest.mark.slow  # a proof for each; all together are flown by default, too
@pytest.mark.parametrize("name", [*ALONE])
def test_no_hover_leaves_its_bound_under_each_disturbance_alone(name):
    told, n = Disturbance(airframe=AIRFRAME, **{"sag": 0.0, "latency": (0.014, 0.014), name: ALONE[name]}), 30
    flight, rng, steps = _Flight(*summed(), told, 0.0), np.random.default_rng(len(name)), FRAMES * SUBSTEPS
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
        assert max(strays(found, flight._course, flight.kept)) <= 1.0
    assert worst <= proved.bound
    assert worst > 1e-8 or name in ("drag", "latency"), "it disturbs a hover that is at rest"


def tilts_of(q):
    """Return the tilts and headings of quaternions, as the proof has them. Shape (steps, 4, n) to (steps, 3, n)."""
    w, x, y, z = (q[:, k] for k in range(4))
    half = np.arctan2(z, w)
    across, along = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x)  # of the thrust's axis in the world
    cosine, sine = np.cos(2.0 * half), np.sin(2.0 * half)
    return np.stack([sine * across - cosine * along, cosine * across + sine * along, 2.0 * np.sin(half)], axis=1)


def strays(flown, course, kept):
    """Return the largest shares of their bounds that states of flights reach beside the undisturbed one, by frame."""
    values, frames = course.flight.values, course.frames
    tilts = tilts_of(flown[:, 6:10])
    states = np.concatenate([flown[:, :6], tilts, flown[:, 10:13]], axis=1).reshape(frames, SUBSTEPS, 12, -1)
    apart = np.abs(states - values[:, 1:, :12, None]).max((1, 3))
    known = flown[:, 13:19].reshape(frames, SUBSTEPS, 6, -1)[:, -1] - values[:, 1, 23:29, None]
    return float((apart / kept["between"][:, :12]).max()), float((np.abs(known).max(-1) / kept["states"][:, 23:29]).max())


@few_of(1, "seeds", [1, 3])
def test_no_disturbed_hover_leaves_the_bounds_of_any_state(seeds, hover):
    closed, proved = hover
    course, worst = closed._course, 0.0
    for seed in range(seeds):
        found = adversaries(SMALL, 60, seed).fly(VEHICLE, QUICK, FRAMES * SUBSTEPS)
        worst = max(worst, float(np.linalg.norm(found[:, :3], axis=1).max()))
        shares = strays(found, course, closed.kept)
        assert max(shares) <= 1.0
        assert min(shares) > 0.1
    assert worst <= proved.bound < 12.0 * worst


@pytest.mark.slow  # the worst signal reaches its sum, and no disturbed hover leaves its bounds, by default, too
def test_winds_with_the_signs_of_the_response_stay_within_the_bound_and_come_near():
    autopilot = STOCK.changed(ekf=STOCK.ekf.changed(least_turn=0.0))
    steps, maps = FRAMES * SUBSTEPS, maps_of(summed(autopilot)[0], slice(None))
    calm = Disturbance(airframe=AIRFRAME, wind=0.03, latency=(0.014, 0.014), sag=0.0)
    back, wind = np.eye(LINKED)[0], np.zeros((steps, 3))
    for step in range(steps - 1, -1, -1):
        frame, inside = divmod(step, SUBSTEPS)
        answer = back @ maps.stepped[frame, inside][:, 25:28]
        wind[step] = calm.wind * answer / np.linalg.norm(answer)
        back = back @ maps.steps[frame, inside]
        if inside == 0 and step:
            back = back @ maps.jumps[frame - 1]
    found = Hovers(1, wind=lambda k: wind[k][:, None], late=7).fly(VEHICLE, autopilot, steps)
    proved = prove_on_board(VEHICLE, autopilot, calm, STILL)
    worst = float(np.linalg.norm(found[:, :3, 0], axis=1).max())
    assert worst <= proved.bound <= 2.0 * worst


@pytest.mark.slow
def test_a_vehicle_that_lags_more_than_its_model_is_caught():
    calm = Disturbance(airframe=AIRFRAME, wind=0.03, latency=(0.014, 0.014), sag=0.0)
    hover = _Flight(*summed(), calm, 0.0)
    hover.proved()
    rates = hover.kept["between"][:, 9:12].max(0)
    for lag, within in ((1.0, True), (20.0, False)):
        flights = Hovers(1, wind=lambda k: np.array([[0.03 * (-1) ** (k // 150)], [0.0], [0.0]]), late=7, lag=lag)
        turning = np.abs(flights.fly(VEHICLE, QUICK, FRAMES * SUBSTEPS)[:, 10:13]).max((0, 2))
        assert bool(np.all(turning <= rates)) == within


MORE = (
    {"wind": 0.04}, {"position": 6e-5}, {"gyroscope": 0.002}, {"mass": 0.001}, {"thrust": 0.0025}, {"sag": 2e-4}, {"drag": 0.02},
    {"moment": 1e-8}, {"start": 2e-4}, {"attitude": 1e-4}, {"latency": (0.012, 0.016)},
)  # fmt: skip


@few_of(1, "changes", [MORE[::5], MORE], ids=["some", "each"])
def test_what_bounds_allow_grows_with_each_disturbance(changes, hover):
    closed, _ = hover
    bounds = {name: 1.01 * value for name, value in closed.kept.items()}

    def allowed(told):
        flight = _Flight(closed._course, closed._sums, told, 0.0)
        flight._after(bounds)  # the second one takes the rates that the first has found
        return flight._after(bounds)

    least = allowed(SMALL)
    for change in changes:
        more = allowed(SMALL.changed(**change))
        assert all(np.all(more[name] >= least[name] * (1.0 - 1e-12)) for name in least), change
        assert more["between"][:, :3].sum() > least["between"][:, :3].sum(), change


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
    assert plan.away.max() == pytest.approx(away, rel=2e-3)
    assert away > 0.004
    assert all(np.all(left < 1e-6) for left in plan.rest.values())


@pytest.mark.slow  # a hundred flights each, and the responses of loops for as long
@pytest.mark.parametrize(("seconds", "times"), [(1.2, 5.0), (3.0, 3.5)])
def test_no_disturbed_flight_along_a_way_leaves_its_bound(seconds, times):
    size, share, frames = (0.05, 0.4, 300) if seconds > 2.0 else (0.01, 0.2, FRAMES)
    told, path = SMALL.scaled(share).changed(latency=(0.004, 0.004)), line((size, 0.6 * size, 0.2 * size), seconds - 0.2, 0.2)
    proved = prove_on_board(VEHICLE, FIRM, told, (path, seconds))
    worst = flown_way(path, told, 100, 0, FIRM, frames).max()
    assert worst <= proved.bound < times * worst
    assert proved.costs["plan"] > 5e-4


@pytest.mark.slow  # proofs along ways, and flights
@pytest.mark.parametrize("away", [(0.19, -0.15, 0.06), (0.24, 0.08, 0.0)])
def test_no_state_leaves_its_bound_on_a_way_that_tilts(away):
    """Each state of each flight stays within its bound beside the undisturbed flight, frame by frame, where moments are clipped, too."""
    told, path = SMALL.scaled(0.15).changed(latency=(0.004, 0.004)), line(away, 0.9, 0.3)
    autopilot = FIRM.changed(ekf=FIRM.ekf.changed(least_turn=1e-5))
    made = _Flight(*summed(autopilot, 2, path), told, 0.0)
    proved, plan = made.proved(), derivatives_at(path, 0.002 * np.arange(FRAMES * SUBSTEPS + 1))
    plan[:, 0] -= plan[0, 0]
    for seed in range(3):
        flights = adversaries(told, 60, seed)
        flights.plan = lambda tick: plan[SUBSTEPS * tick, :5]
        found = flights.fly(VEHICLE, autopilot, FRAMES * SUBSTEPS)
        shares = strays(found, made._course, made.kept)
        assert max(shares) <= 1.0
        assert min(shares) > 0.1
        assert np.linalg.norm(found[:, :3] - plan[1:, 0][:, :, None], axis=1).max() <= proved.bound
    assert np.abs(made._course.flight.values[..., 6:8]).max() > 0.1, "it tilts"


@pytest.mark.slow  # a proof of a longer flight
def test_what_is_long_ago_acts_by_the_states_that_it_left(monkeypatch):
    """A flight of which little is summed one by one has wider bounds, which hold."""
    whole = _Flight(*summed(), SMALL, 0.0)
    bound = whole.proved().bound
    monkeypatch.setattr(onboard_sums, "KEPT", 80)
    course, _ = summed()
    cut = _Flight(course, onboard_sums.sums_of(course), SMALL.scaled(0.5), 0.0)
    assert cut._sums.older.max() > 0
    wider, narrow = cut.proved().bound, _Flight(*summed(), SMALL.scaled(0.5), 0.0).proved().bound
    assert narrow < wider
    assert bound > narrow


def test_errors_of_attitudes_count_as_much_as_their_numbers_change():
    """The numbers of an attitude that tilts change by more than it turns."""
    course, sums = summed(path=WAY[0], frames=EARLY)
    told = Disturbance(airframe=AIRFRAME, attitude=1e-3, sag=0.0, latency=(0.014, 0.014))
    flight = _Flight(course, sums, told, 0.0)
    bounds = flight._first()
    allowed, _ = flight._beside.allowed(bounds["states"], bounds["between"], bounds["spread"])
    rng, seen = np.random.default_rng(6), course.flight.values[:, 1:, 6:9]
    frame = int(np.abs(seen[..., :2]).max((1, 2)).argmax())
    q = number(flown(exact(seen[frame, 0])))[:, None]
    error = rng.normal(size=(3, 4000))
    error *= told.attitude / np.linalg.norm(error, axis=0)
    turned_by = unit(q + quaternion_rate(np.repeat(q, 4000, axis=1), error))
    changed = np.linalg.norm(tilts_of(turned_by[None])[0] - seen[frame, 0][:, None], axis=0)
    most = float(np.ravel(allowed["attitude"])[frame])
    assert 1.02 * told.attitude < changed.max() <= most < 1.1 * changed.max()


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


def test_disturbances_that_are_too_much_are_refused():
    with pytest.raises(NotProved, match="corrections of the attitude that the filter drops"):
        _Flight(*summed(frames=40), SMALL.changed(wind=2.0), 0.0).proved()


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
