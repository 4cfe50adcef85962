"""The monitor: its verdict of the formula is the checker's, its tube is sound, and its alarms are acted on."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import strategies as st

import flight
from flight.logs.log import FlightLog
from flight.monitoring.alarm_response import LANDING_HEIGHT, Stop
from flight.monitoring.formula_state import FormulaState
from flight.monitoring.letters import PlannedAction, certified_actions, planned_actions
from flight.monitoring.monitor import Monitor
from flight.monitoring.tube import Tube, relative_acceleration
from tests.helpers.few import given_few
from tests.helpers.motion.flights import legs, small_mission
from tests.helpers.motion.stand_ins import flight as made_flight
from tests.helpers.motion.stand_ins import mission, rest_to_rest, stand_in
from verify.data import BadInput, Trajectory, load_vehicle, parse_formula
from verify.data.language.counting import written_out
from verify.data.sections import Spec
from verify.model_checking.timeline import Change, Enclosure, InternalChange, Relations, Timeline
from verify.model_checking.word_claims import judge_formula
from verify.recordings.planned_paths import planned_paths

FORMULAS = (
    "F left & F right & G(right -> carrying)", "G !left", "F(left & carrying)", "!left U right", "G(left -> F right)",
    "F left -> F right", "(left | right) R !carrying", "F(right & F left)", "G(left -> !right) & F G !left",
)  # fmt: skip


def checker(made, events, end):
    """The judge's verdict of the same letters as label timelines with exact times."""
    timelines = {}
    for robot in made.agents:
        inside, inner, changes, actions = {"left": False, "right": False}, frozenset(), [], []
        for time, _name, letter in [e for e in events if e[1] == robot]:
            at = Fraction(time)
            for region in ("left", "right"):
                if (region in letter) != inside[region]:
                    inside[region] = region in letter
                    changes.append(Change(Enclosure(at, at), region, "must" if inside[region] else "no"))
            if (letter & {"carrying"}) != inner:
                source, inner = inner, letter & {"carrying"}
                states = {frozenset(): "empty", frozenset({"carrying"}): "full"}
                actions.append(InternalChange(at, states[source], states[inner], "tank", 0, inner))
        timelines[robot] = Timeline(
            robot, {"left": "no", "right": "no", "tank": "no"}, tuple(changes), Fraction(end), frozenset(), tuple(actions)
        )
    relations = Relations(frozenset({("left", "right"), ("left", "tank"), ("right", "tank")}))
    return judge_formula(made, timelines, relations)


LETTERS = st.sampled_from(
    [frozenset(x) for x in ([], ["left"], ["right"], ["carrying"], ["left", "carrying"], ["right", "carrying"])]
)


@given_few(
    6,
    40,
    st.sampled_from(FORMULAS),
    st.sampled_from(["own", "joint"]),
    st.lists(st.tuples(st.integers(1, 4), st.sampled_from(["quad0", "quad1"]), LETTERS), max_size=6),
)
def test_the_monitors_verdict_is_the_checkers_on_the_whole_log(formula, reading, raw):
    made = mission().model_copy(update={"spec": Spec(formula=formula, team=reading)})
    events, held = [], {"quad0": frozenset(), "quad1": frozenset()}
    for time, robot, letter in sorted(raw, key=lambda e: e[0]):
        one_change = letter ^ held[robot]
        if len(one_change) == 1 and not any(t == time and r == robot for t, r, _ in events):
            events.append((time, robot, letter))
            held[robot] = letter
    state = FormulaState(made.formula, reading, [frozenset(), frozenset()])
    for _time, group in itertools.groupby(events, key=lambda e: e[0]):
        state.change({("quad0", "quad1").index(robot): letter for _, robot, letter in group})
    verdict = state.end(finite=True)
    judged = checker(made, events, 5)
    outcomes = {v.outcome for v in judged} if isinstance(judged, (list, tuple)) else {judged.outcome}
    assert (verdict == "satisfied") == (outcomes == {"holds"})


def test_a_verdict_comes_as_soon_as_nothing_can_change_it():
    made = mission()
    state = FormulaState(made.formula, "own", [frozenset(), frozenset()])
    assert state.verdict == "open"
    assert state.change({1: frozenset({"left"})}) == "open"
    assert state.change({0: frozenset({"right"})}) == "violated"
    assert "carrying" in state.broken
    seen = FormulaState(mission().formula.conjuncts()[0], "own", [frozenset(), frozenset({"left"})])
    assert seen.verdict in ("open", "satisfied")


def test_what_is_still_to_do_is_what_would_break_if_the_flight_ended_now():
    made = mission().model_copy(update={"spec": Spec(formula="F left & F right & G (left -> !right)")})
    state = FormulaState(made.formula, "joint", [frozenset(), frozenset()], ["quad0", "quad1"])
    assert state.to_do == ("F left", "F right")
    state.change({1: frozenset({"left"})})
    assert state.to_do == ("F right",)
    state.change({1: frozenset()})
    state.change({0: frozenset({"right"})})
    assert state.to_do == ()
    assert state.verdict == "open"
    state.change({1: frozenset({"left"})})
    assert state.verdict == "violated"
    assert state.to_do == ()


def test_over_infinite_traces_what_is_open_stays_open():
    state = FormulaState(mission().model_copy(update={"spec": Spec(formula="G F left")}).formula, "own", [frozenset()])
    assert state.end(finite=False) == "open"


def test_a_tube_is_sound_between_samples():
    """Random paths with bounded acceleration never stray further than the tube says, at any time."""
    rng = np.random.default_rng(3)
    fine, gap, most = 1e-4, 0.02, 20.0
    for _ in range(50):
        push = most * rng.choice([-1, 1], size=int(1 / fine / 40)).repeat(40) * rng.uniform(0.5, 1)
        path = np.cumsum(np.cumsum(push) * fine) * fine
        path = path - np.linspace(0, path[-1], len(path))
        tube = Tube(math.inf, 0.0, most)
        stride = int(gap / fine)
        for k in range(0, len(path), stride):
            tube.see(k * fine, abs(float(path[k])))
        assert np.max(np.abs(path[: k + 1])) <= tube.bound + 1e-12


def test_a_tube_says_unknown_then_outside_and_never_goes_back():
    tube = Tube(0.05, 0.004, 30.0)
    assert tube.see(0.0, 0.0) == "inside"
    assert tube.see(0.01, 0.045) == "inside"
    assert tube.see(0.02, 0.047) == "unknown"
    assert tube.see(0.03, 0.060) == "outside"
    assert tube.see(0.04, 0.0) == "outside"


def test_a_long_drop_out_is_noticed_while_it_lasts():
    tube = Tube(0.05, 0.0, 30.0)
    tube.see(0.0, 0.01)
    assert tube.see(0.05, math.nan) == "inside"
    assert tube.see(0.12, math.nan) == "unknown"  # 0.01 + 30 * 0.12^2 / 8 = 0.064
    assert Tube(0.05, 0.0, 30.0).see(0.0, math.nan) == "unknown"


def test_the_bound_on_acceleration_covers_what_the_rotors_can_do():
    vehicle = load_vehicle("crazyflie-2.1")
    assert relative_acceleration(vehicle, 3.0) > 4 * vehicle.rotor_thrust_max / vehicle.mass + 9.8 + 3.0


def test_a_calm_flight_is_covered_and_the_log_says_so():
    plan, team = made_flight()
    log = flight.fly(plan, team, stand_in(plan, team), noise=0.0005, seed=1)
    assert log.tube == "inside"
    assert log.satisfied is True
    assert any("the certificate covers this flight" in sentence for sentence in log.verdicts)
    assert any("came closest" in sentence for sentence in log.verdicts)


@pytest.fixture(scope="module")
def storm():
    plan, team = made_flight()
    return plan, team, stand_in(plan, team)


def test_a_storm_raises_the_alarm_at_once_and_the_team_carries_on(storm):
    log = flight.fly(*storm, wind="5+0.5", seed=1)
    first = next(event for event in log.events if event.kind == "tube")
    reached = float(log.times[np.argmax(np.max(log.error, axis=1) >= 0.05)])
    assert first.time <= reached
    assert log.tube == "outside"
    assert not any(event.kind == "reaction" for event in log.events)


def test_held_robots_stop_and_stay(storm):
    log = flight.fly(*storm, wind="5+0.5", seed=1, reaction="hold")
    begin = next(event.time for event in log.events if event.kind == "reaction")
    after = log.times > begin + 2.0
    assert after.any()
    spread = np.ptp(log.position[after], axis=0)
    assert np.max(spread) < 0.15
    assert log.satisfied is False


def test_landing_robots_end_near_the_ground_after_the_plan_is_over(storm):
    log = flight.fly(*storm, wind="5", seed=1, reaction="land")
    assert log.times[-1] >= 5.0
    assert np.all(np.abs(log.position[-1, :, 2] - LANDING_HEIGHT) < 0.05)
    assert np.max(np.abs(log.velocity[-1])) < 0.3


def test_an_unknown_reaction_is_refused(storm):
    with pytest.raises(BadInput, match="reaction"):
        flight.fly(*storm, reaction="panic")


def test_a_stop_begins_as_it_was_and_ends_at_rest():
    path = rest_to_rest([(0, 0, 1), (1, 0, 1)], [2.0])
    flat = np.stack([path.evaluate(1.0, order) for order in range(5)])[:, :, None]
    stop = Stop(flat, 1.0, mission(), "hold")
    assert np.allclose(stop.flat(1.0)[:4], flat[:4])
    assert np.allclose(stop.flat(stop.end)[1:4], 0.0, atol=1e-9)
    h = 1e-5
    for t in (1.2, 1.5, stop.end - 0.01):
        slope = (stop.flat(t + h)[:4] - stop.flat(t - h)[:4]) / (2 * h)
        assert np.allclose(slope, stop.flat(t)[1:5], atol=1e-4)


def test_robots_that_come_too_close_are_named():
    made = mission()
    monitor = Monitor(made, (), margin=0.05, measurement=0.0, planned_acceleration=1.0)
    near = np.array([[0.5, 0.5], [0.0, 0.2], [1.0, 1.0]])
    monitor.see(0.0, near, near)
    assert monitor.alarmed
    assert "0.200 m apart" in monitor.events[-1].sentence
    assert monitor.closest == (pytest.approx(0.2), "quad0", "quad1")


def test_planned_actions_come_from_the_certificate_or_the_middle_of_the_visit():
    plan, team = made_flight()
    (told,) = certified_actions(stand_in(plan, team), team)
    (found,) = planned_actions(plan, team)
    assert told.time == 2.5
    assert found.propositions == told.propositions == frozenset({"carrying"})
    place = team["quad0"].evaluate(found.time)[:3]
    assert plan.mission.regions["tank"].level(place) < 0.3


def test_the_logs_letters_are_those_of_the_true_path():
    plan, team = made_flight()
    log = flight.fly(plan, team, stand_in(plan, team), model="paper")
    assert isinstance(log, FlightLog)
    at = int(np.argmax(log.times >= 2.49))
    assert log.letters[at][0] == frozenset({"tank"})
    assert log.letters[at + 3][0] == frozenset({"tank", "carrying"})


def test_a_tube_that_no_sample_covers_at_the_start_or_the_end_is_unknown():
    late = Tube(0.05, 0.0, 30.0)
    late.see(0.4, 0.001)
    assert late.see(0.41, 0.001) == "unknown"
    early = Tube(0.05, 0.0, 30.0)
    for time in np.arange(0, 1.0, 0.01):
        early.see(float(time), 0.001)
    assert early.verdict == "inside"
    assert early.end(0.99 + 1e-5) == "inside"
    assert early.end(1.5) == "unknown"


def test_a_monitor_without_samples_at_the_end_does_not_say_that_the_certificate_covers_the_flight():
    made = mission()
    monitor = Monitor(made, (), margin=0.05, measurement=0.0, planned_acceleration=1.0)
    near = np.array([[0.5, -0.5], [0.0, 0.2], [1.0, 1.0]])
    for time in np.arange(0, 0.5, 0.01):
        monitor.see(float(time), near, near)
    assert monitor.tube == "inside"
    monitor.finish(1.0)
    assert monitor.tube == "unknown"
    assert not any("covers this flight" in event.sentence for event in monitor.events)


def test_a_tube_counts_what_the_plan_jumps_between_samples():
    """The robot rests; the plan is 99.99 mm away at every sample, and between two of them jumps 1e-4 m away before it comes back."""
    path = rest_to_rest([(0, 0, 1), (0, 0, 1), (0, 0, 1)], [0.5, 0.5])
    coefficients = np.array(path.coefficients)
    coefficients[1, 0, 0] = 1e-4
    jumping = Trajectory(path.durations, coefficients)
    one = mission().model_copy(update={"agents": {"quad0": mission().agents["quad0"].model_copy(update={"start": (0, 0, 1)})}})
    (planned,) = planned_paths(one, {"quad0": jumping}).values()
    plain, told = Tube(0.1, 0.0, 1.0), Tube(0.1, 0.0, 1.0, planned)
    for time in np.arange(0, 1.0, 0.01):
        plain.see(float(time), 0.0998)
        told.see(float(time), 0.0998)
    assert told.bound >= 0.0999
    assert told.verdict == plain.verdict == "inside"
    nearer = Tube(0.1, 0.0, 1.0, planned)
    for time in np.arange(0, 1.0, 0.01):
        nearer.see(float(time), 0.09995)
    assert nearer.verdict == "unknown"


def test_counts_and_names_are_followed_in_flight() -> None:
    formula = written_out(parse_formula("F(count(a) >= 2) & G(count(b) <= 1) & F quad1.b"), ("quad0", "quad1"))
    state = FormulaState(formula, "joint", [frozenset(), frozenset()], ["quad0", "quad1"])
    assert state.change({0: frozenset({"a"})}) == "open"
    assert state.change({1: frozenset({"a"})}) == "open"
    assert state.change({1: frozenset({"b"})}) == "open"
    assert state.change({0: frozenset({"b"})}) == "violated"
    assert "count(b) <= 1" in str(state.broken)


def test_a_pause_between_parts_is_a_hover_in_the_plan() -> None:
    """What is said of a flight whose clock stood still is what is said of the flight with a hover in it."""
    world = small_mission(
        "F a & F(a & lit)", regions="a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}", margin=0.05,
        extra="robot: {initial: dark, states: {dark: [], bright: [lit]}, actions: [{from: dark, to: bright, at: a}]}",
    )  # fmt: skip
    whole = legs([(0, 0, 1), (1, 0, 1), (1, 1, 1)])
    cut = Trajectory(whole.durations, whole.coefficients, cuts=(1,))
    at, pause = float(cut.knots[1]), 3.7
    paused = cut.paused([pause])
    lit = at + 0.3
    plans = {"clock": planned_paths(world, {"r0": cut}), "hover": planned_paths(world, {"r0": paused})}
    watching = {
        name: Monitor(
            world, [PlannedAction("r0", lit + (pause if name == "hover" else 0.0), "dark", "bright", frozenset({"lit"}))],
            margin=0.05, measurement=0.003, planned_acceleration=3.0, planned=plan,
        )
        for name, plan in plans.items()
    }  # fmt: skip
    rng, when = np.random.default_rng(3), dict.fromkeys(watching, np.inf)
    for time in np.arange(0.0, paused.duration, 0.02).tolist():
        planned = paused.evaluate(time)[:3, None]
        measured = planned + rng.uniform(-0.01, 0.01, (3, 1))
        stood = min(max(time - at, 0.0), pause)
        watching["clock"].pause(stood)
        for name, monitor in watching.items():
            monitor.see(time, measured, planned)
            if not monitor.to_do:
                when[name] = min(when[name], time)
    for monitor in watching.values():
        monitor.finish(paused.duration)
    assert when["clock"] == when["hover"] == pytest.approx(lit + pause, abs=0.02)
    assert watching["clock"].bounds["r0"] == pytest.approx(watching["hover"].bounds["r0"], abs=1e-5)
    assert watching["clock"].tube == watching["hover"].tube == "inside"
    assert [event.kind for event in watching["clock"].events] == [event.kind for event in watching["hover"].events]
