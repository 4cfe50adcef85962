"""The proof under `mellinger` on its filter: bounds that no disturbed hover and no disturbed flight along a way leaves."""

from __future__ import annotations

import numpy as np
import pytest

from flight.control import mellinger
from flight.model.attitude import quaternion_rate, unit
from tests.helpers.few import few_of
from tests.helpers.vehicles.board_flights import (
    AIRFRAME,
    EARLY,
    FIRM,
    FRAMES,
    QUICK,
    SECONDS,
    SMALL,
    STILL,
    STOCK,
    VEHICLE,
    WAY,
    exact,
    line,
    number,
    summed,
    tilts_of,
)
from tests.helpers.vehicles.disturbed_hovers import Hovers
from verify.data.disturbance import Disturbance
from verify.tracking.error_model import NotProved
from verify.tracking.on_board import onboard_laws, onboard_sums
from verify.tracking.on_board.onboard_course import maps_of
from verify.tracking.on_board.onboard_loop import LINKED, SUBSTEPS
from verify.tracking.on_board.onboard_plan import follow
from verify.tracking.on_board.onboard_proof import _Flight, loop_of, prove_on_board
from verify.tracking.on_board.rotations import flown
from verify.tracking.plan_samples import derivatives_at


@pytest.fixture(scope="module")
def hover():
    """Return a hover whose bounds close, with its bound."""
    made = _Flight(*summed(frames=EARLY), SMALL, 0.0)
    return made, made.proved()


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
        found = adversaries(SMALL, 60, seed, EARLY).fly(VEHICLE, QUICK, EARLY * SUBSTEPS)
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


def flown_way(path, told, n, seed, autopilot, frames):
    """Return how far flights along a way are from it after every step, under disturbances that jump. Shape (steps, n)."""
    plan = derivatives_at(path, 0.002 * np.arange(frames * SUBSTEPS + 1))
    plan[:, 0] -= plan[0, 0]
    flights = adversaries(told, n, seed, frames)
    flights.plan = lambda tick: plan[SUBSTEPS * tick, :5]
    found = flights.fly(VEHICLE, autopilot, frames * SUBSTEPS)
    return np.linalg.norm(found[:, :3] - plan[1:, 0][:, :, None], axis=1)


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
