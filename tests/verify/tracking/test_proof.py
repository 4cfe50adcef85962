"""The tracking proof against flights: the linear loops step by step, and bounds that no disturbed flight leaves."""

from __future__ import annotations

import numpy as np
import pytest

from flight.control import controller
from flight.control.flatness import feed_forward
from flight.model import timing
from flight.model.attitude import from_matrix, quaternion_product, quaternion_rate, unit
from tests.benchmarks.tracking import step_of
from tests.helpers.few import few_of
from tests.helpers.vehicles.disturbed_flights import Disturbed
from verify.data import BadInput, Trajectory
from verify.data.airframe import load_airframe
from verify.data.disturbance import Disturbance
from verify.data.vehicle import load_vehicle
from verify.tracking import error_model, sampled_loop
from verify.tracking.circumstances import Circumstances, led_root, within_a_step
from verify.tracking.error_model import NotProved, fed_of, feeds_alone
from verify.tracking.loops import LoopChoice, heading_loop, lateral_loop, vertical_loop
from verify.tracking.nominal import turned_at_commands
from verify.tracking.proof import _Loops, cells_of, model_of, prove
from verify.tracking.sampled_loop import SUBSTEPS
from verify.tracking.tilts import Attitudes

VEHICLE, AIRFRAME = load_vehicle("crazyflie-2.1"), load_airframe("crazyflie-2.1")
MODEST = Disturbance(
    airframe=AIRFRAME, wind=0.1, position=0.0001, latency=(0.002, 0.002), gyroscope=0.005, mass=0.002, thrust=0.005, start=0.001
)


def hover(duration: float = 4.0) -> Trajectory:
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, 2, 0] = 1.0
    return Trajectory([duration], coefficients)


def line(length: float = 0.5, duration: float = 4.0) -> Trajectory:
    """Return a smooth way along x and up, from rest to rest (minimum snap)."""
    shape = np.array([0, 0, 0, 0, 35.0, -84.0, 70.0, -20.0]) / duration ** np.arange(8)
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, 0], coefficients[0, 2] = length * shape, 0.2 * length * shape
    coefficients[0, 2, 0] += 1.0
    return Trajectory([duration], coefficients)


def bend(duration: float = 3.0) -> Trajectory:
    """Return a way along x that swings out along y, so that the rates that are fed forward are about all three axes."""
    path = line(0.4, duration)
    coefficients = path.coefficients.copy()
    coefficients[0, 1, 4:] = 12.0 * np.array([1.0, -3.0, 3.0, -1.0]) / duration ** np.arange(4, 8)  # 12 u^4 (1 - u)^3
    return Trajectory([duration], coefficients)


def bound_of(path: Trajectory, told: Disturbance = MODEST):
    start = tuple(float(x) for x in path.coefficients[0, :3, 0])
    return prove(model_of(path, path.duration, start, VEHICLE, told))


def test_what_both_sides_take_for_granted_is_the_same():
    assert error_model.NEAR == controller.NEAR
    assert sampled_loop.TICK == timing.CONTROL_STEP
    assert SUBSTEPS == timing.SUBSTEPS
    assert float(sampled_loop.STEP.p) / float(sampled_loop.STEP.q) == pytest.approx(timing.STEP, rel=1e-15)


def flown_linearly(loop, accelerations, offset):
    x = np.zeros(len(loop.states))
    x[0] = x[loop.states.index("xi_seen")] = offset
    found = []
    for tick in range(len(accelerations) // SUBSTEPS):
        x = loop.jump.mid @ x
        if loop.seen == 0:
            x[[t for _, t in loop.recorded]] = x[[s for s, _ in loop.recorded]]
        for sub in range(SUBSTEPS):
            x = loop.step.mid @ x + loop.stepped["acc"].mid[:, 0] * accelerations[tick * SUBSTEPS + sub]
            if sub + 1 == loop.seen:
                x[[t for _, t in loop.recorded]] = x[[s for s, _ in loop.recorded]]
            found.append(x[0])
    return np.array(found)


@few_of(1, "late", [0, 4, 7])
@pytest.mark.parametrize("axis", [0, 2])
def test_linear_loops_fly_as_the_simulator_does_step_by_step(axis, late):
    make, drag = (lateral_loop, 0) if axis == 0 else (vertical_loop, 1)
    loop = make(VEHICLE, AIRFRAME, LoopChoice(1.0, 1.0, late, 1.0))
    small, rng = 1e-3, np.random.default_rng(axis + late)
    winds = small * np.repeat(rng.choice([-1.0, 1.0], 60), 15)
    pushed = error_model.drag_of(VEHICLE, AIRFRAME)[drag] * winds
    wind = np.zeros((900, 3))
    wind[:, axis] = winds
    offset = np.zeros((3, 1))
    offset[axis] = 1e-4
    flights = Disturbed(1, wind=lambda t: wind[round(t / 0.002)][:, None], late=late, offset=offset)
    flown = flights.fly(VEHICLE, hover(), 1.8)[:, axis, 0]
    linear = flown_linearly(loop, pushed, 1e-4)
    assert np.abs(flown - linear).max() < 2e-3 * np.abs(linear).max()


@pytest.mark.parametrize(("make", "axis"), [(lateral_loop, 0), (vertical_loop, 2)])
def test_answers_to_a_step_are_the_simulators(make, axis):
    offset = np.zeros((3, 1))
    offset[axis] = 1e-3
    left = Disturbed(1, offset=offset).fly(VEHICLE, hover(), 3.6)[:, axis, 0] / 1e-3
    overshoot, rise, settled = step_of(make, Disturbance(airframe=AIRFRAME))
    assert overshoot == pytest.approx(-100.0 * left.min(), rel=0.02)
    assert rise == pytest.approx(0.002 * (np.argmax(left < 0.1) - np.argmax(left < 0.9)), abs=0.005)
    assert settled == pytest.approx(0.002 * (1 + np.flatnonzero(np.abs(left) > 0.05)[-1]), abs=0.02)


def adversaries(told: Disturbance, duration: float, seeds: range, late: int):
    """Return flights with winds, gyroscope errors and positions that jump between their ends, and corners of mass, thrust and start."""
    n, steps = len(seeds), int(duration / 0.002) + 30
    rng = np.random.default_rng(seeds.start)

    def jumping(size, hold):
        ways = rng.normal(size=(steps // hold + 2, 3, n))
        ways[:, 2] *= rng.choice([0.0, 1.0], n)
        return size * ways / np.linalg.norm(ways, axis=1, keepdims=True), hold

    periods = rng.choice([20, 40, 80, 150, 300], 3)
    tables = [jumping(size, int(hold)) for size, hold in zip((told.wind, told.gyroscope, told.position), periods, strict=True)]

    def at(index):
        table, hold = tables[index]
        return lambda t: table[round(t / 0.002) // hold]

    away = rng.normal(size=(3, n))
    return Disturbed(
        n, wind=at(0), gyroscope=at(1), place=at(2), late=late, mass=1 + told.mass * rng.choice([-1, 1], n),
        thrust=1 + told.thrust * rng.choice([-1, 1], n), offset=told.start * away / np.linalg.norm(away, axis=0),
    )  # fmt: skip


@few_of(1, ("path", "many"), [(hover(), 1), (hover(), 2), (line(), 2)], ids=["hover", "hover, more", "line"])
def test_no_disturbed_flight_leaves_its_bound(path, many):
    proved, worst = bound_of(path), 0.0
    for k in range(many):
        flown = adversaries(MODEST, path.duration, range(100 * k, 100 * k + 60), 1).fly(VEHICLE, path, path.duration)
        away = np.linalg.norm(flown, axis=1).reshape(len(proved.course), SUBSTEPS, -1).max((1, 2))
        assert np.all(away <= proved.course), path
        worst = max(worst, float(away.max()))
    assert proved.bound < 12.0 * worst


@few_of(2, "path", [hover(1.5), hover(), line(), line(0.6, 3.2), bend()], ids=["short hover", "hover", "line", "fast", "bend"])
def test_every_state_stays_within_its_bound(path):
    """Feedback, and the errors of attitude, rates and thrust, as they are in flight, against the bounds that close on each other."""
    told = Disturbance(airframe=AIRFRAME, wind=0.06, position=5e-5, gyroscope=0.003, start=5e-4, sag=0.0)
    model = model_of(path, path.duration, tuple(path.coefficients[0, :3, 0]), VEHICLE, told)
    (cell,) = cells_of(model)
    bounds, _ = _Loops(model, cell).kept()
    flights = adversaries(told, path.duration, range(300, 340), 0)
    flights.watch = True
    flights.fly(VEHICLE, path, path.duration)
    proved = {"p": bounds.lateral["p"], "p_up": bounds.vertical["p"], "d": bounds.lateral["d"], "e": bounds.lateral["e"]}
    proved |= {"mu": bounds.lateral["mu"], "b": bounds.vertical["b"], "f": bounds.heading["f"], "o": bounds.heading["o"]}
    for name, bound in proved.items():
        flown = np.array([step[name] for step in flights.log]).max(1).reshape(len(bound), SUBSTEPS).max(1)
        assert np.all(flown <= bound + 1e-9), (name, float((flown / bound).max()))


@few_of(1, "path", [bend(), line(0.6, 3.2)], ids=["bend", "fast"])
def test_rotors_have_to_change_by_no_more_than_is_counted_with(path):
    """What the law asks of rotors beside what they give, about x and y together and about z, and the attitude's error about z."""
    told = Disturbance(airframe=AIRFRAME, wind=0.06, position=5e-5, start=5e-4, sag=0.0)
    model = model_of(path, path.duration, tuple(path.coefficients[0, :3, 0]), VEHICLE, told)
    (cell,) = cells_of(model)
    proof = _Loops(model, cell)
    bounds, _ = proof.kept()
    fed = fed_of(model, bounds, proof._alone, cell.choice.thrust)
    found = Circumstances(model, cell, bounds, Attitudes.of(model, bounds, fed, cell.choice.thrust), fed)
    flights = adversaries(told, path.duration, range(700, 740), 0)
    flights.watch = True
    flights.fly(VEHICLE, path, path.duration)
    counted = {"twist": found.tilts.twist, "ahead": found.ahead[0], "ahead_spin": found.ahead[1]}
    for name, bound in counted.items():
        flown = np.array([step[name] for step in flights.begun]).max(1).reshape(len(bound), SUBSTEPS).max(1)
        assert np.all(flown <= bound + 1e-9), (name, float((flown / bound).max()))
        assert np.max(flown / bound) > 0.03, name


def test_the_lead_asks_no_more_than_its_bound_and_comes_near():
    """Thrusts and what they are to be, densely sampled, against the bound on the speed that the lead asks."""
    rng, lead, closest = np.random.default_rng(5), 3.6, 0.0
    for _ in range(60):
        least = rng.uniform(0.02, 0.08)
        most, sooner = least + rng.uniform(0.001, 0.06), rng.uniform(0.0001, 0.015)
        led = rng.uniform(least, most + lead * sooner)
        now, apart = np.meshgrid(np.linspace(least, most, 300), np.linspace(-sooner, sooner, 301))
        wanted = now + apart
        may = (wanted > 0.0) & (now + lead * apart <= led)
        asked = (np.sqrt(now) + lead * (np.sqrt(np.where(may, wanted, 0.0)) - np.sqrt(now)))[may]
        bound = float(led_root(*(np.array([x]) for x in (least, most, led, lead * sooner)))[0])
        assert asked.max() <= bound
        closest = max(closest, float(asked.max()) / bound)
    assert closest > 0.99


def test_thrusts_and_moments_within_a_step_are_between_its_ends_but_for_their_bound():
    """Four rotors that approach other speeds, at many instants of a step: each thrust, and each sum of signs, over the number of rotors."""
    rng, lag, lead, found = np.random.default_rng(8), AIRFRAME.rotor_lag, 3.6, []
    signs = np.array([[1, 1, 1, 1], [1, -1, -1, 1], [1, 1, -1, -1], [1, -1, 1, -1]]) / 4.0
    for _ in range(200):
        least, sooner = rng.uniform(0.03, 0.08), rng.uniform(0.0005, 0.015)
        now = least + rng.uniform(0.0, 0.02, 4)
        asked = now + sooner * rng.choice([-1.0, 1.0], 4) * rng.uniform(0.3, 1.0, 4)
        roots, led = np.sqrt(now), lead * (np.sqrt(asked) - np.sqrt(now))
        share = -np.expm1(-np.linspace(0.0, 0.002, 41) / lag)
        thrusts = (roots[:, None] + led[:, None] * share) ** 2
        least = min(least, float(thrusts.min()))
        for row in (*np.eye(4), *signs):
            moment = row @ thrusts
            straight = moment[0] + (moment[-1] - moment[0]) * share / share[-1]
            found.append(np.abs(moment - straight).max() / float(within_a_step(least, lead * share[-1] * sooner)))
    assert 0.03 < max(found) <= 1.0


def test_a_plans_attitude_turns_at_commands_by_what_is_known():
    """Rates that are held, turned on in steps of a microsecond's order, against the closed form; and attitudes against the controller's own."""
    path = bend(2.0)
    model = model_of(path, path.duration, tuple(path.coefficients[0, :3, 0]), VEHICLE, Disturbance(airframe=AIRFRAME, sag=0.0))
    known, flat = turned_at_commands(feeds_alone(model, 1.0)[0]), np.stack(model.force())
    zero = np.zeros(len(model.plan))
    ahead = feed_forward(*flat.transpose(0, 2, 1), zero, zero, zero)
    quaternions, steps = from_matrix(ahead.turn), 2000
    held = np.concatenate([np.array([[1.0], [0.0], [0.0], [0.0]]), quaternions[:, :-1]], axis=1)
    rates, changes = (np.concatenate([np.zeros((3, 1)), each[:, :-1]], axis=1) for each in (ahead.rates, ahead.rates_change))
    for step in range(steps):
        turned = sampled_loop.TICK / steps * (rates + sampled_loop.TICK * (step + 0.5) / steps * changes)
        held = unit(held + quaternion_rate(held, turned))
    inverse = quaternions * np.array([[1.0], [-1.0], [-1.0], [-1.0]])
    apart = quaternion_product(inverse, held)
    assert np.abs(known).max() > 1e-5
    assert np.abs(2.0 * apart[1:] * np.sign(apart[:1]) - known.T).max() < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize("path", [line(0.6, 3.2), hover(2.0), bend()], ids=["fast", "hover", "bend"])
def test_each_step_leaves_no_more_than_its_inputs_allow(path):
    """The linear maps against the simulator, step by step and far from rest: what is left is within the bounded inputs of that step."""
    told = Disturbance(airframe=AIRFRAME, wind=0.06, position=5e-5, gyroscope=0.003, start=5e-4, sag=0.0)
    require_steps_within_inputs(path, told, adversaries(told, path.duration, range(500, 512), 0))


def require_steps_within_inputs(path: Trajectory, told: Disturbance, flights: Disturbed) -> None:
    """Hold each step of flights against what the bounded inputs of that step allow."""
    model = model_of(path, path.duration, tuple(path.coefficients[0, :3, 0]), VEHICLE, told)
    (cell,) = cells_of(model)
    proof = _Loops(model, cell)
    _, inputs = proof.kept()
    flights.watch = True
    flights.fly(VEHICLE, path, path.duration)
    known = proof._forcing(proof._alone[0])
    for kind, make in {"lateral": lateral_loop, "vertical": vertical_loop, "heading": heading_loop}.items():
        loop = make(VEHICLE, AIRFRAME, cell.choice)
        rows = [*flights.log[0][kind]]
        for tick in range(0, len(model.plan), 4):
            own = {name: known.get(kind, {}).get(name, np.zeros((len(model.plan), 1)))[tick] for name in loop.stepped}
            most = {
                name: sum(float(b[min(tick, len(b) - 1)]) for (k, n, _), b in inputs.items() if (k, n) == (kind, name))
                for name in loop.stepped
            }
            pulled = sum(float(b[tick]) for (k, n, _), b in inputs.items() if (k, n) == (kind, "pullj"))
            for sub in range(SUBSTEPS):
                begun, after = flights.begun[tick * SUBSTEPS + sub][kind], flights.log[tick * SUBSTEPS + sub][kind]
                for name in rows:
                    at = loop.states.index(name)
                    made = sum(loop.step.mid[at, loop.states.index(other)] * begun[other] for other in rows)
                    made = made + sum(loop.stepped[n].mid[at, 0] * own[n][:, None] for n in loop.stepped)
                    left = np.linalg.norm(after[name] - made, axis=0).max()
                    allowed = sum(abs(loop.stepped[n].mid[at, 0]) * most[n] for n in loop.stepped)
                    if kind == "lateral":
                        allowed += abs(loop.step.mid[at, loop.states.index("pull")]) * pulled
                    assert left <= allowed + 1e-9, (kind, name, tick, sub, left, allowed)


def test_a_thrust_that_is_off_moves_what_cameras_see_late():
    """Velocities age most where thrust is off from the first instant: its whole push is in the bound on what changes meanwhile."""
    path = hover(0.16)
    told = Disturbance(airframe=AIRFRAME, thrust=0.003, latency=(0.0, 0.02), sag=0.0)
    thrust = np.array([1.0 - told.thrust, 1.0 + told.thrust])
    flown = Disturbed(2, late=10, thrust=thrust).fly(VEHICLE, path, path.duration)
    away = np.linalg.norm(flown, axis=1).reshape(-1, SUBSTEPS, 2).max((1, 2))
    assert np.all(away <= bound_of(path, told).course)


@few_of(1, "drags", [(1.3,), (0.7, 1.3)], ids=["most drag", "both"])
def test_no_flight_with_other_errors_leaves_its_bound(drags):
    """Latency that is another one at each command, velocities and attitudes that are off, drag and moments of inertia at their ends."""
    told = Disturbance(airframe=AIRFRAME, wind=0.03, velocity=0.001, latency=(0.0, 0.004), attitude=5e-4, drag=0.3, sag=0.0)
    told = told.changed(inertia=0.08)
    path, n, rng = line(0.3), 40, np.random.default_rng(11)
    proved = bound_of(path, told)

    def jumping(size, hold):
        ways = rng.normal(size=(3000 // hold, 3, n))
        table = size * ways / np.linalg.norm(ways, axis=1, keepdims=True)
        return lambda t: table[round(t / 0.002) // hold]

    ages = rng.integers(0, 3, 400)
    for drag in drags:
        flights = Disturbed(n, wind=jumping(0.03, 100), speed=jumping(0.001, 50), attitude=jumping(5e-4, 30), drag=drag)
        flights.late = lambda tick: int(ages[tick])
        flown = flights.fly(VEHICLE, path, path.duration)
        away = np.linalg.norm(flown, axis=1).reshape(len(proved.course), SUBSTEPS, -1).max((1, 2))
        assert np.all(away <= proved.course)


def test_a_path_that_begins_at_some_speed_is_not_taken_for_one_at_rest():
    """A speed as small as what joints may leave is in the bound: the robot hovers there."""
    path, still = hover(1.0), Disturbance(airframe=AIRFRAME, sag=0.0)
    moving = path.coefficients.copy()
    moving[0, 0, :7] = 9e-4 * np.array([0.0, 1.0, 0.0, 0.0, -5.0, 6.0, -2.0])  # from 0.9 mm/s to rest
    path = Trajectory(path.durations, moving)
    flown = Disturbed(1).fly(VEHICLE, path, path.duration)
    away = np.linalg.norm(flown, axis=1).reshape(-1, SUBSTEPS).max(1)
    assert away.max() > 1e-4
    assert np.all(away <= bound_of(path, still).course)


@pytest.mark.slow
def test_a_bound_holds_where_wind_is_aimed():
    """Winds that turn as the loop's response does, read backwards, along an axis of the room."""
    path, told = hover(), Disturbance(airframe=AIRFRAME, wind=0.2, sag=0.0)
    loop = lateral_loop(VEHICLE, AIRFRAME, LoopChoice(1.0, 1.0, 0, 1.0))
    answer = np.diff(flown_linearly(loop, np.ones(1900), 0.0), prepend=0.0)[::-1]
    winds = np.zeros((2100, 3, 2))
    winds[:1900, 0, 0] = winds[:1900, 1, 1] = told.wind * np.sign(answer)
    flown = Disturbed(2, wind=lambda t: winds[min(round(t / 0.002), 2099)]).fly(VEHICLE, path, path.duration)
    worst, proved = np.linalg.norm(flown, axis=1).max(), bound_of(path, told)
    assert worst <= proved.bound <= 2.0 * worst


@few_of(
    1,
    "name",
    [
        "wind",
        "position",
        "velocity",
        "attitude",
        "gyroscope",
        "mass",
        "thrust",
        "sag",
        "drag",
        "moment",
        "inertia",
        "centre",
        "start",
    ],
)
def test_more_of_a_disturbance_is_never_a_smaller_bound(name):
    path = line(0.3)
    sizes = {
        "wind": 0.1,
        "position": 2e-4,
        "velocity": 2e-3,
        "attitude": 2e-3,
        "gyroscope": 0.02,
        "mass": 0.01,
        "thrust": 0.02,
        "sag": 0.01,
    }
    sizes |= {"drag": 0.2, "moment": 1e-7, "inertia": 0.1, "centre": 1e-6, "start": 2e-3}
    still = Disturbance(airframe=AIRFRAME, wind=0.02)
    bounds = [bound_of(path, still.changed(**{name: share * sizes[name]})).bound for share in (0.1, 0.5, 1.0)]
    assert bounds == sorted(bounds)


ALONE = {
    "wind": {"wind": 0.1}, "position": {"position": 2e-4}, "velocity": {"velocity": 2e-3}, "attitude": {"attitude": 1e-3}, "gyroscope": {"gyroscope": 0.01},
    "latency": {"latency": (0.0, 0.004)}, "mass": {"mass": 0.004}, "thrust": {"thrust": 0.006}, "drag": {"drag": 0.3}, "inertia": {"inertia": 0.08},
    "start": {"start": 1e-3}, "sag": {"sag": 0.006}, "moment": {"moment": 5e-7}, "centre": {"centre": 1e-6}, "battery": {"battery": 0.97},
}  # fmt: skip
TOGETHER = {
    key: 0.2 * value for changes in ALONE.values() for key, value in changes.items() if key not in ("latency", "battery")
} | {"latency": (0.0, 0.002), "battery": 0.99}  # fmt: skip


@few_of(2, "changes", [TOGETHER, *ALONE.values()], ids=["all together", *ALONE])
def test_each_disturbance_alone_and_all_together_stay_within_the_bound(changes):
    path, told, n = line(0.3, 2.0), Disturbance(airframe=AIRFRAME, **{"sag": 0.0, **changes}), 24
    rng = np.random.default_rng(len(changes) + len(next(iter(changes))))

    def jumping(name):
        size = getattr(told, name)
        hold = int(rng.choice([15, 40, 100]))
        ways = rng.normal(size=(1100 // hold + 2, 3, n))
        table = size * ways / np.linalg.norm(ways, axis=1, keepdims=True)
        return (lambda t: table[round(t / 0.002) // hold]) if size else None

    weaker = told.sag * rng.choice([-1.0, 1.0], n) * rng.choice([0.0, 1.0], (12, n))  # up and down from the start's thrust
    centre = rng.normal(size=(3, n))
    away, ages = rng.normal(size=(3, n)), rng.integers(0, round(told.latency[1] / 0.002) + 1, 110)
    flights = Disturbed(
        n, wind=jumping("wind"), place=jumping("position"), speed=jumping("velocity"), attitude=jumping("attitude"), gyroscope=jumping("gyroscope"),
        late=lambda tick: int(ages[tick]), mass=1 + told.mass * rng.choice([-1, 1], n), thrust=1 + told.thrust * rng.choice([-1, 1], n),
        moment=jumping("moment"), sag=lambda t: weaker[round(t / 0.002) // 100], centre=told.centre * centre / np.linalg.norm(centre, axis=0),
        battery=told.battery, drag=1.0 + told.drag, inertia=tuple(1.0 + told.inertia * rng.choice([-1, 1], 3)), offset=told.start * away / np.linalg.norm(away, axis=0),
    )  # fmt: skip
    off = np.linalg.norm(flights.fly(VEHICLE, path, path.duration), axis=1)
    assert off.max() > 1e-5, "it disturbs"
    assert np.all(off.reshape(-1, SUBSTEPS, n).max((1, 2)) <= bound_of(path, told).course)


@pytest.mark.parametrize(("behind", "within"), [(0.0, True), (0.1, False)])
def test_a_plant_with_one_more_lag_is_caught_outside_the_model(behind, within):
    """Rotors whose commands come through one more lag than the model has leave what is proved, in winds that the others stay within."""
    path, told = hover(2.0), MODEST.changed(latency=(0.0, 0.0))
    flights = adversaries(told, path.duration, range(40), 0)
    flights.behind = behind
    away = np.linalg.norm(flights.fly(VEHICLE, path, path.duration), axis=1).reshape(-1, SUBSTEPS, 40).max((1, 2))
    assert bool(np.all(away <= bound_of(path, told).course)) is within


@pytest.mark.slow
def test_latency_and_battery_are_monotone_too():
    path, still = line(0.3), Disturbance(airframe=AIRFRAME, wind=0.02)
    late = [bound_of(path, still.changed(latency=(0.0, latest))).bound for latest in (0.0, 0.002, 0.006)]
    assert late == sorted(late)
    known = [bound_of(path, still.changed(latency=(age, age))).bound for age in (0.0, 0.018, 0.02)]
    assert known == sorted(known)
    with pytest.raises(NotProved):
        bound_of(path, still.changed(battery=0.8))


def test_disturbances_that_are_too_much_are_not_proved():
    for told in (
        MODEST.changed(wind=3.0),
        MODEST.changed(thrust=0.3),
        MODEST.changed(gyroscope=1.0),
        MODEST.changed(moment=0.01),
    ):
        with pytest.raises(NotProved):
            bound_of(hover(2.0), told)


def test_what_is_nearly_known_proves_nothing(monkeypatch):
    bound = bound_of(hover(2.0)).bound
    monkeypatch.setattr(
        sampled_loop.Kernels, "near_response", lambda self, _, ticks: {name: np.zeros(ticks) for name in self.outputs}
    )
    assert bound_of(hover(2.0)).bound == pytest.approx(bound, rel=0.03)


def test_gains_that_do_not_stabilise_are_not_proved():
    gains = AIRFRAME.gains.changed(position=(2000.0, 2000.0))
    with pytest.raises(NotProved, match="stabilise"):
        bound_of(hover(2.0), MODEST.changed(airframe=AIRFRAME.changed(gains=gains)))


def test_leads_that_leave_no_lag_are_not_proved():
    gains = AIRFRAME.gains.changed(quickened_lag=0.001)
    with pytest.raises(NotProved, match="lead"):
        bound_of(hover(2.0), MODEST.changed(airframe=AIRFRAME.changed(gains=gains)))


def test_the_last_instant_is_covered():
    path = hover(2.0)
    told = model_of(path, 2.0000001, (0.0, 0.0, 1.0), VEHICLE, MODEST)
    assert told.plan.times[-1] + sampled_loop.TICK > 2.0000001


def test_headings_that_turn_are_not_proved():
    path = hover()
    turning = path.coefficients.copy()
    turning[0, 3, 1] = 0.1
    with pytest.raises(NotProved, match="heading"):
        bound_of(Trajectory(path.durations, turning))


def test_a_fixed_heading_makes_no_difference():
    path, told = line(), MODEST
    turned = path.coefficients.copy()
    turned[0, 3, 0] = 0.7
    assert bound_of(Trajectory(path.durations, turned), told).bound == pytest.approx(bound_of(path, told).bound, rel=0.05)


@pytest.mark.parametrize(
    "wrong", [{"wind": -1.0}, {"wind": float("nan")}, {"latency": (0.01, 0.0)}, {"battery": 0.1}, {"mass": 0.9}, {"gust": 1.0}]
)
def test_absurd_disturbances_are_rejected(wrong):
    with pytest.raises(BadInput):
        MODEST.changed(**wrong)


@pytest.mark.slow
def test_thousands_of_adversarial_flights_stay_within_their_bound():
    path = line()
    proved = bound_of(path)
    for k in range(10):
        flown = adversaries(MODEST, path.duration, range(1000 * k, 1000 * k + 1000), 1).fly(VEHICLE, path, path.duration)
        away = np.linalg.norm(flown, axis=1).reshape(len(proved.course), SUBSTEPS, -1).max((1, 2))
        assert np.all(away <= proved.course)
