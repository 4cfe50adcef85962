"""Live flights over the simulated link: they fly, they are watched, and every way out ends on the ground."""

from __future__ import annotations

import json
import os
import signal
import threading

import numpy as np
import pytest

import flight
import ltlplan
from flight.link.live import LiveFlight, fly_live
from flight.link.simulated import Faults, SimulatedLink
from flight.link.stages import Stage
from ltlplan.live import stages
from ltlplan.pipeline import certified_team
from tests.helpers.live_missions import PAIR
from verify.data import BadInput

PLACES = {"one": (1.05, -0.5, 0.02), "two": (-1.0, -0.55, 0.0)}
GROUNDS = {name: place[2] for name, place in PLACES.items()}


@pytest.fixture(scope="module")
def ready():
    """A mission, and its stages for robots that stand below each other's starts."""
    mission = ltlplan.parse_mission(PAIR)
    done = certified_team(ltlplan.plan(mission))
    return mission, stages(done.plan, done.team, done.certificate, PLACES)


def link_to(mission, faults: Faults | None = None, **conditions) -> SimulatedLink:
    return SimulatedLink(mission, PLACES, faults=faults, conditions=flight.Conditions(**conditions))


def on_the_ground(link: SimulatedLink, seconds: float = 30.0) -> bool:
    """Whether all come to stand still with motors off, on their own where nobody could tell them."""
    end = link.now() + seconds
    while link.spinning and link.now() < end:
        link.sleep(0.5)
    return not link.spinning


def instants(flown: tuple[Stage, ...]) -> dict[str, float]:
    """When each stage begins in an undisturbed flight, s."""
    begin, found = 0.52, {}
    for stage in flown:
        found[stage.name] = begin
        begin += stage.duration + 1.02
    return {**found, "end": begin}


def test_a_team_that_stands_the_wrong_way_round_flies_all_stages_and_lands(ready) -> None:
    mission, flown = ready
    link, looks = link_to(mission, noise=0.001), []
    done = fly_live(link, flown, grounds=GROUNDS, show=looks.append)
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


def test_swapped_bodies_are_refused_before_anything_spins(ready) -> None:
    mission, flown = ready
    link = SimulatedLink(mission, {"one": PLACES["two"], "two": PLACES["one"]})
    done = fly_live(link, flown, grounds=GROUNDS)
    assert "m from where the climb begins" in done.reason
    assert link.spinning == ()


def test_parameters_that_are_not_on_board_are_named(ready) -> None:
    mission, flown = ready
    link = link_to(mission)
    done = fly_live(link, flown, grounds=GROUNDS, parameters={"one": {"mass": 0.029}})
    assert "one: mass is 0.033, not 0.029" in done.reason
    assert link.spinning == ()


def fault(kind: str, robot: str, when: float) -> Faults:
    return {
        "unseen": Faults(unseen={robot: when}),
        "pushed": Faults(pushed={robot: (when, 0.07)}),
        "flat": Faults(flat={robot: when}),
        "deaf": Faults(deaf={robot: when}),
        "lost": Faults(lost=when),
        "both": Faults(unseen={"one": when}, deaf={"two": when}),
    }[kind]


KINDS = ("unseen", "pushed", "flat", "deaf", "lost", "both")


@pytest.mark.parametrize(
    "kind", ["unseen", "pushed", "lost", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("flat", "deaf", "both"))]
)
def test_the_team_ends_on_the_ground_whatever_fails_in_flight(ready, kind) -> None:
    mission, flown = ready
    when = instants(flown)["flight"] + 2.0
    link = link_to(mission, fault(kind, "one", when))
    done = fly_live(link, flown, grounds=GROUNDS)
    assert not done.flown
    assert done.reason or done.unsafe
    assert on_the_ground(link)
    if kind not in ("deaf", "lost", "both"):
        assert done.unsafe == ()
        assert "landing" not in done.record.starts, "it did not go on as if nothing had been"


@pytest.mark.parametrize("when", [0.2, 7.5, *(pytest.param(when, marks=pytest.mark.slow) for when in (2.0, 12.0))])
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


def test_stages_that_do_not_join_are_refused(ready) -> None:
    mission, flown = ready
    with pytest.raises(BadInput, match=r"begins .* m from where its climb ends"):
        fly_live(link_to(mission), (flown[0], flown[2]), grounds=GROUNDS)
    with pytest.raises(BadInput, match="nothing to fly"):
        fly_live(link_to(mission), (), grounds=GROUNDS)
    with pytest.raises(BadInput, match="how high is the ground below two"):
        fly_live(link_to(mission), flown, grounds={"one": 0.0})


def disturbed(mission, kind: str, robot: str, when: float, lasts: float) -> SimulatedLink:
    """A link in wind and noise on which something fails: a robot, the link, or the host (it hangs, is interrupted, or is in error)."""
    link = link_to(mission, fault(kind, robot, when) if kind in KINDS else None, noise=0.001, wind="0.2+0.1")
    if kind in KINDS:
        return link
    slept = link.sleep

    def sleep(seconds: float) -> None:
        if link.now() < when:
            slept(seconds)
            return
        link.sleep = slept
        if kind != "hangs":
            raise {"interrupted": KeyboardInterrupt, "error": ZeroDivisionError}[kind]("somebody stopped it")
        link.faults.lost = link.now()  # nobody hears of a host that hangs
        slept(lasts)
        link.faults.lost = None

    link.sleep = sleep
    return link


def require_whole_logs(done: LiveFlight) -> None:
    """Hold what is kept of a flight to itself: readable, in order of time, and with all that its answer says."""
    files = done.record.files()
    data = json.loads(files["live.json"])
    assert list(data["starts"]) == [name for name in ("climb", "way", "flight", "landing") if name in data["starts"]]
    assert set(data["ends"]) >= set(list(data["starts"])[:-1]), "a stage began only where the one before had ended"
    for name in ("poses.csv", "setpoints.csv"):
        head, *rows = files[name].splitlines()
        times = [float(row.split(",")[0]) for row in rows]
        assert head == "t,robot,x,y,z"
        assert all(len(row.split(",")) == 5 for row in rows)
        assert times == sorted(times)
        assert len(set(times)) * 2 >= len(times), "at most one row of each robot at a time"
    sentences = [event["sentence"] for event in data["events"]]
    assert not done.reason or done.reason in sentences
    assert all(any(s.startswith(f"{robot} has not acknowledged") for s in sentences) for robot in done.unsafe)


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
        link, case = disturbed(mission, kind, robot, when, lasts), (kind, robot, when, lasts)
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
