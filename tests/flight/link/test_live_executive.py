"""Live flights over the simulated link: they fly, they are watched, and every way out ends on the ground."""

from __future__ import annotations

import os
import signal
import threading
from dataclasses import replace

import numpy as np
import pytest

import flight
import ltlplan
from flight.link.live_executive import Operator, fly_live
from flight.link.phases import Stage
from flight.link.preflight_checks import before_take_off
from flight.link.simulated import Faults, SimulatedLink
from flight.monitoring.alarm_response import LANDING_HEIGHT
from flight.monitoring.thresholds import NEAR
from ltlplan.commands.support.live_view import interrupts_land
from ltlplan.live_phases import stages
from ltlplan.pipeline import certified_team
from tests.helpers.few import few_of
from tests.helpers.live.live_failures import KINDS, Remembers, disturb, fault, on_the_ground, require_whole_logs
from tests.helpers.live.live_missions import PAIR
from verify.data import BadInput

PLACES = {"one": (1.05, -0.5, 0.02), "two": (-1.0, -0.55, 0.0)}
GROUNDS = {name: place[2] for name, place in PLACES.items()}


@pytest.fixture(scope="module")
def ready():
    """A mission, and its stages for robots that stand below each other's starts."""
    mission = ltlplan.parse_mission(PAIR)
    done = certified_team(ltlplan.plan(mission, pace="nominal"))
    return mission, stages(done.plan, done.team, done.certificate, PLACES)


def link_to(mission, faults: Faults | None = None, **conditions) -> SimulatedLink:
    return SimulatedLink(mission, PLACES, faults=faults, conditions=flight.Conditions(**conditions))


def instants(flown: tuple[Stage, ...]) -> dict[str, float]:
    """When each stage begins in an undisturbed flight, s."""
    begin, found = 0.52, {}
    for stage in flown:
        found[stage.name] = begin
        begin += stage.duration + 1.02
    return {**found, "end": begin}


@pytest.mark.slow
def test_a_team_that_stands_the_wrong_way_round_flies_all_stages_and_lands(ready) -> None:
    mission, flown = ready
    link, looks = link_to(mission, noise=0.001), []
    done = fly_live(link, flown, grounds=GROUNDS, operator=Operator(looks.append))
    assert done.flown, done.reason
    covered = [event.sentence for event in done.record.events if event.kind == "tube"]
    assert len(covered) == len(flown), covered
    assert all(sentence.startswith("every robot stayed within") for sentence in covered)
    assert done.unsafe == ()
    assert list(done.record.starts) == ["climb", "way", "flight", "landing"]
    assert not link.spinning
    ends = {name: link.pose(name).position for name in PLACES}
    assert all(ends[name][2] < 0.1 for name in PLACES)
    assert max(max(worst.values()) for worst in done.record.worst.values()) < 0.04
    assert {look.stage for look in looks} == set(done.record.starts)
    rows = [row for row in done.record.poses if row[1] == "one"]
    other = {row[0]: np.array(row[2:]) for row in done.record.poses if row[1] == "two"}
    assert min(np.linalg.norm(np.array(row[2:]) - other[row[0]]) for row in rows if row[0] in other) > mission.separation


@pytest.mark.slow
@pytest.mark.parametrize(("controller", "near"), [("mellinger", 3e-3), ("geometric", 5e-4)])
def test_over_the_link_robots_are_as_far_from_their_plan_as_in_a_flight_alone(ready, controller, near) -> None:
    """But for sums of errors that Mellinger's controller takes along from the stage before."""
    mission, flown = ready
    claimed = next(stage for stage in flown if stage.name == "flight")
    alone = flight.fly(claimed.plan, claimed.team, claimed.certificate, controller=controller)
    done = fly_live(link_to(mission, controller=controller), flown, grounds=GROUNDS)
    assert done.flown, done.reason
    assert {name: alone.worst_error(name) for name in alone.robots} == pytest.approx(done.record.worst["flight"], abs=near)


@pytest.mark.parametrize(
    ("faults", "says"),
    [
        (Faults(pushed={"two": (-1.0, 0.04)}), "put it at"),
        (Faults(unseen={"one": -1.0}), "motion capture"),
        (Faults(flat={"two": -1.0}), "charge or change it"),
    ],
)
def test_what_is_wrong_before_take_off_is_said_and_nothing_spins(ready, faults, says) -> None:
    mission, flown = ready
    link = link_to(mission, faults)
    done = fly_live(link, flown, grounds=GROUNDS)
    assert not done.flown
    assert says in done.reason
    assert link.spinning == ()
    assert done.record.poses == []


@pytest.mark.slow
def test_a_battery_of_which_nothing_is_known_is_said_not_to_be_checked(ready) -> None:
    mission, flown = ready

    class Unknown(SimulatedLink):
        def health(self, robot):
            return replace(super().health(robot), endurance=None)

    link = Unknown(mission, PLACES)
    checks = [check for check in before_take_off(link, flown[0], 50.0) if check.name == "battery"]
    assert [(check.robot, check.passed) for check in checks] == [("one", None), ("two", None)]
    assert checks[0].sentence.startswith("not checked: whether one's battery lasts for 60 s: ")
    refused = fly_live(link, flown, grounds=GROUNDS)
    assert not refused.flown
    assert refused.reason.endswith("; add --unchecked battery to fly without that")
    assert link.spinning == ()
    done = fly_live(link, flown, grounds=GROUNDS, unchecked=("battery",))
    assert done.flown, done.reason


def test_swapped_bodies_are_refused_before_anything_spins(ready) -> None:
    mission, flown = ready
    link = SimulatedLink(mission, {"one": PLACES["two"], "two": PLACES["one"]})
    done = fly_live(link, flown, grounds=GROUNDS)
    assert "m from where the climb begins" in done.reason
    assert link.spinning == ()


@few_of(
    1, "kind", ["unseen", "pushed", "lost", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("flat", "deaf", "both"))]
)
def test_the_team_ends_on_the_ground_whatever_fails_in_flight(ready, kind) -> None:
    mission, flown = ready
    when = instants(flown)["flight"] + 2.0
    link = link_to(mission, fault(kind, "one", when, ("two",)))
    done = fly_live(link, flown, grounds=GROUNDS)
    assert not done.flown
    assert done.reason or done.unsafe
    assert on_the_ground(link)
    if kind not in ("deaf", "lost", "both"):
        assert done.unsafe == ()
        assert "landing" not in done.record.starts, "it did not go on as if nothing had been"


@few_of(1, "when", [0.2, 7.5, *(pytest.param(when, marks=pytest.mark.slow) for when in (2.0, 13.0))])
@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_interruptions_and_errors_land_the_team(ready, when, error) -> None:
    mission, flown = ready
    link = link_to(mission)
    slept = link.sleep

    def sleep(seconds: float) -> None:
        if link.now() >= when and link.sleep is not slept:
            link.sleep = slept
            raise error("somebody stopped it")
        slept(seconds)

    link.sleep = sleep
    if when < 0.5:
        with pytest.raises(error):
            fly_live(link, flown, grounds=GROUNDS)
    else:
        done = fly_live(link, flown, grounds=GROUNDS)
        assert done.reason.startswith("interrupted" if error is KeyboardInterrupt else "ValueError: somebody")
        assert done.unsafe == ()
        last = {robot: z for _, robot, _, _, z in done.record.poses}
        assert all(abs(last[name] - GROUNDS[name]) < 0.2 for name in PLACES), "it is recorded how they landed"
        if "flight" in done.record.starts and "flight" not in done.record.ends:
            times = [float(row.split(",")[0]) for row in done.record.files()["live.csv"].splitlines()[1:]]
            assert 0.5 < max(times) <= done.record.broken_off - done.record.starts["flight"], "what is judged ends there"
    assert not link.spinning


def test_a_second_interruption_stops_motors_at_once(ready) -> None:
    mission, flown = ready
    link = link_to(mission)
    slept, times = link.sleep, [12.0, 12.5]

    def sleep(seconds: float) -> None:
        if times and link.now() >= times[0]:
            times.pop(0)
            raise KeyboardInterrupt
        slept(min(seconds, 0.1))

    link.sleep = sleep
    done = fly_live(link, flown, grounds=GROUNDS)
    assert done.unsafe == ()
    assert not link.spinning
    assert link.now() < 12.8
    assert any("interrupted again" in event.sentence for event in done.record.events)


@pytest.mark.slow
def test_however_often_it_is_interrupted_all_that_hear_stop_and_the_others_are_named(ready) -> None:
    mission, flown = ready
    link = link_to(mission, Faults(deaf={"two": 11.0}))
    slept, times = link.sleep, [12.0, 12.5, 12.6, 12.7, 12.8]

    def sleep(seconds: float) -> None:
        if times and link.now() >= times[0]:
            times.pop(0)
            raise KeyboardInterrupt
        slept(min(seconds, 0.05))

    link.sleep = sleep
    done = fly_live(link, flown, grounds=GROUNDS)
    assert times == []
    assert done.unsafe == ("two",)
    assert "one" not in link.spinning
    require_whole_logs(done)


@pytest.mark.slow
def test_two_signals_at_once_land_the_team_as_one_does(ready) -> None:
    mission, flown = ready
    link = link_to(mission)
    slept, both = link.sleep, {signal.SIGINT, signal.SIGTERM}

    def sleep(seconds: float) -> None:
        if link.now() >= 12.0 and link.sleep is not slept:
            link.sleep = slept
            signal.pthread_sigmask(signal.SIG_BLOCK, both)
            for number in both:
                signal.pthread_kill(threading.get_ident(), number)  # to no other thread, which would take it at once
            signal.pthread_sigmask(signal.SIG_UNBLOCK, both)
        slept(min(seconds, 0.05))

    link.sleep = sleep
    with interrupts_land() as heard:
        done = fly_live(link, flown, grounds=GROUNDS)
    assert heard.code(done) in (130, 143)
    assert done.unsafe == ()
    assert not link.spinning
    assert all(abs(link.pose(name).position[2] - GROUNDS[name]) < 0.2 for name in PLACES)


def test_stages_that_do_not_join_are_refused(ready) -> None:
    mission, flown = ready
    with pytest.raises(BadInput, match=r"begins .* m from where its climb ends"):
        fly_live(link_to(mission), (flown[0], flown[2]), grounds=GROUNDS)
    with pytest.raises(BadInput, match="nothing to fly"):
        fly_live(link_to(mission), (), grounds=GROUNDS)
    with pytest.raises(BadInput, match="how high is the ground below two"):
        fly_live(link_to(mission), flown, grounds={"one": 0.0})


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind", ["flown", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("interrupted", "flat", "pushed"))]
)
def test_motors_stop_where_robots_stand(ready, kind) -> None:
    """Neither while they still sink, nor above: from 0.15 m the ground is met at 1.7 m/s."""
    mission, flown = ready
    rng = np.random.default_rng(7)
    for when in [np.inf] if kind == "flown" else rng.uniform(1.0, instants(flown)["landing"], 6):
        link = Remembers(mission, PLACES, conditions=flight.Conditions(noise=0.001))
        if kind != "flown":
            disturb(link, kind, "one", float(when), 0.0)
        done = fly_live(link, flown, grounds=GROUNDS)
        assert done.flown is (kind == "flown"), done.reason
        assert set(link.stops) == set(PLACES)
        for name, (height, change) in link.stops.items():
            assert height < GROUNDS[name] + LANDING_HEIGHT + NEAR, (when, name)
            assert change < 0.03, (when, name)


def test_ctrl_c_never_ends_the_simulation_itself(ready) -> None:
    mission, _ = ready
    link, heard = link_to(mission), 0
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        for number in range(20):
            pressed = threading.Timer(0.001 + 0.0007 * number, os.kill, (os.getpid(), signal.SIGINT))
            try:
                pressed.start()  # in here: it may be heard before anything else is done
                for _ in range(10_000):
                    link.sleep(0.05)
            except KeyboardInterrupt:
                heard += 1
            pressed.join()
            time = link.now()
            link.sleep(0.05)
            assert link.now() > time
    finally:
        signal.signal(signal.SIGINT, before)
    assert heard == 20


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_two_hundred_random_failures_end_on_the_ground(ready, seed) -> None:
    mission, flown = ready
    rng = np.random.default_rng(seed)
    last, kinds = instants(flown)["end"], (*KINDS, "hangs", "interrupted", "error")
    for _ in range(50):
        kind, robot = kinds[rng.integers(len(kinds))], ("one", "two")[rng.integers(2)]
        when, lasts = float(rng.uniform(0.6, last)), float(rng.uniform(0.05, 4.0))
        link, case = link_to(mission, noise=0.001, wind="0.2+0.1"), (kind, robot, when, lasts)
        disturb(link, kind, robot, when, lasts)
        done = fly_live(link, flown, grounds=GROUNDS)
        assert on_the_ground(link), case
        assert done.flown is (not done.reason and not done.unsafe), case
        assert done.flown or any(event.kind in ("alarm", "reaction") for event in done.record.events), case
        assert not done.unsafe or kind in ("deaf", "lost", "both"), case
        assert all(
            abs(link.pose(name).position[2] - GROUNDS[name]) < 0.2
            for name in PLACES
            if kind in ("flat", "hangs", "interrupted", "error")
        ), case
        require_whole_logs(done)
