"""Orders to stop a live flight: heard in every phase, only escalating, and motors in the air only by a second one."""

from __future__ import annotations

import itertools
import math

import pytest

import ltlplan
from flight.link.live_executive import LiveFlight, Operator, fly_live
from flight.link.observed_link import Observation, ObservedLink
from flight.link.record import Record
from flight.link.simulated import Faults, SimulatedLink
from flight.link.stop_orders import Level, StopOrders
from ltlplan.live_phases import stages
from ltlplan.pipeline import certified_team
from tests.helpers.few import few_of
from tests.helpers.live.live_failures import on_the_ground
from tests.helpers.live.live_missions import PAIR

PLACES = {"one": (1.05, -0.5, 0.02), "two": (-1.0, -0.55, 0.0)}
GROUNDS = {name: place[2] for name, place in PLACES.items()}


@pytest.fixture(scope="module")
def ready():
    mission = ltlplan.parse_mission(PAIR)
    done = certified_team(ltlplan.plan(mission, pace="nominal"))
    return mission, stages(done.plan, done.team, done.certificate, PLACES)


@pytest.fixture(scope="module")
def undisturbed(ready):
    return Flown(ready, {})


class Flown:
    """A flight that is ordered to stop at instants of the link's clock."""

    def __init__(self, ready, orders: dict[float, Level], faults: Faults | None = None) -> None:
        mission, flown = ready
        self.link, self.orders, self.seen = SimulatedLink(mission, PLACES, faults=faults), StopOrders(), list[Observation]()
        self._times = sorted(orders.items())
        self.heights: dict[str, float] = {}
        record = Record()
        observed = ObservedLink(self.link, self.orders, record, self._show)
        inner, stop = self.link.sleep, self.link.stop

        def sleep(seconds: float) -> None:
            while self._times and self.link.now() >= self._times[0][0]:
                self.orders.give(self._times.pop(0)[1], "stopped by alice")
            inner(seconds)

        def stopped(robot: str) -> bool:
            self.heights.setdefault(robot, self.link.pose(robot).position[2])
            return stop(robot)

        self.link.sleep, self.link.stop = sleep, stopped
        self.done: LiveFlight = fly_live(observed, flown, grounds=GROUNDS, operator=Operator(observed.see, self.orders, record))
        observed.observe()

    def _show(self, seen: Observation) -> None:
        self.seen.append(seen)


def test_an_undisturbed_flight_is_seen_ten_times_a_second_with_all_that_is_flown(undisturbed) -> None:
    flown = undisturbed
    assert flown.done.flown, flown.done.reason
    times = [seen.time for seen in flown.seen]
    gaps = [after - before for before, after in itertools.pairwise(times)]
    assert max(gaps) < 0.13
    assert len(times) == pytest.approx(times[-1] / 0.1, rel=0.1)
    assert {seen.look.stage for seen in flown.seen if seen.look} == {"climb", "way", "flight", "landing"}
    assert all(set(seen.robots) == set(PLACES) for seen in flown.seen)
    states = [dict(seen.look.parts) for seen in flown.seen if seen.look and seen.look.stage == "flight"]
    assert states[0] == {"F left": "to do", "F right": "to do"}
    assert set(states[-1].values()) <= {"done", "kept"}
    assert [event for seen in flown.seen for event in seen.said] == flown.done.record.events
    last = flown.seen[-1]
    assert last.ending
    assert {name: robot.acknowledged for name, robot in last.robots.items()} == dict.fromkeys(PLACES, "stop")


@few_of(1, "when", [9.0, 1.0, 0.1, 3.0, 6.5, 10.7, 12.0, 14.0, 16.0, 17.5])
def test_a_first_order_lands_the_team_in_every_phase_and_stops_no_motor_in_the_air(ready, when: float) -> None:
    flown = Flown(ready, {when: Level.LAND})
    assert flown.done.reason in ("stopped by alice", ""), "the landing may have been over"
    assert on_the_ground(flown.link)
    assert flown.done.unsafe == ()
    assert all(height < 0.1 for height in flown.heights.values())
    if flown.done.reason and when > 0.6:
        first = next(seen for seen in flown.seen if all(robot.acknowledged for robot in seen.robots.values()))
        assert first.time - when < 0.5
        assert {robot.acknowledged for robot in first.robots.values()} == {"hold"}


def test_an_order_before_take_off_keeps_all_on_the_ground(ready) -> None:
    flown = Flown(ready, {0.05: Level.LAND})
    assert flown.done.reason == "stopped by alice"
    assert flown.link.spinning == ()
    assert flown.done.record.starts == {}


@few_of(1, "failed", [Faults(pushed={"one": (9.0, 0.5)}), Faults(unseen={"two": 9.0})])
def test_a_first_order_while_the_team_lands_for_an_alarm_changes_nothing(ready, failed: Faults) -> None:
    flown = Flown(ready, {9.3: Level.LAND, 10.0: Level.LAND, 12.5: Level.LAND}, failed)
    assert flown.done.reason != "stopped by alice"
    assert on_the_ground(flown.link)
    assert not any("interrupted" in event.sentence for event in flown.done.record.events)
    assert all(height < 0.15 for name, height in flown.heights.items() if name != "two")


@few_of(1, "when", [2.0, 5.0, 8.0, 11.0])
def test_a_second_order_stops_all_motors_at_once(ready, when: float) -> None:
    flown = Flown(ready, {when: Level.LAND, when + 0.7: Level.MOTORS})
    assert flown.link.spinning == ()
    assert flown.link.now() < when + 1.0
    assert {robot.acknowledged for robot in flown.seen[-1].robots.values()} == {"stop"}
    assert flown.done.unsafe == ()


def test_motors_that_are_ordered_to_stop_while_the_team_is_set_down_stop(ready, undisturbed) -> None:
    ends = undisturbed.link.now()
    flown = Flown(ready, {ends - 0.5: Level.MOTORS})
    assert flown.link.spinning == ()
    assert flown.link.now() < ends + 0.3


def test_what_is_shown_ends_no_flight(ready) -> None:
    mission, flown = ready
    link, orders = SimulatedLink(mission, PLACES), StopOrders()

    def broken(_: Observation) -> None:
        raise RuntimeError("a bug")

    observed = ObservedLink(link, orders, Record(), broken)
    done = fly_live(observed, flown, grounds=GROUNDS, operator=Operator(observed.see, orders))
    assert done.flown, done.reason


@few_of(1, "when", [2.0, 5.0, 8.0])
def test_a_hold_lasts_until_the_team_is_ordered_to_land(ready, when: float) -> None:
    flown = Flown(ready, {when: Level.HOLD, when + 12.0: Level.LAND})
    assert flown.done.reason == "stopped by alice"
    resting = [seen for seen in flown.seen if when + 4.0 < seen.time < when + 12.0]
    for robot in PLACES:
        places = [seen.robots[robot].pose.position for seen in resting]
        assert max(math.dist(places[0], place) for place in places) < 0.03
        assert {seen.robots[robot].acknowledged for seen in resting} == {"hold"}
    landing = next(seen.time for seen in flown.seen if all(robot.acknowledged == "land" for robot in seen.robots.values()))
    assert landing < when + 12.5, "those who hold already land at once"
    assert on_the_ground(flown.link)
    assert flown.done.unsafe == ()
    assert flown.link.spinning == ()


@pytest.mark.slow
def test_a_hold_is_a_landing_by_itself_after_its_longest_time(ready) -> None:
    flown = Flown(ready, {5.0: Level.HOLD})
    sentences = [event.sentence for event in flown.done.record.events]
    assert "the hold ends: it has lasted 60 s." in sentences
    landing = next(seen.time for seen in flown.seen if all(robot.acknowledged == "land" for robot in seen.robots.values()))
    assert 65.0 < landing < 68.0
    assert on_the_ground(flown.link)


@few_of(
    1,
    ("faults", "why"),
    [
        (Faults(unseen={"two": 12.0}), "two is not seen"),
        (Faults(flat={"one": 12.0}), "one's battery lasts for 0 s"),
        (Faults(deaf={"two": 5.0}), "two has not acknowledged it"),
    ],
    ids=["pose", "battery", "answer"],
)
def test_a_hold_that_cannot_last_is_a_landing(ready, faults: Faults, why: str) -> None:
    flown = Flown(ready, {5.2: Level.HOLD}, faults)
    events = flown.done.record.events
    ended = next(event for event in events if event.sentence.startswith("the hold ends"))
    assert why in ended.sentence
    assert ended.time < 12.5
    assert any(event.sentence == "all robots land." for event in events if event.time >= ended.time)
    assert on_the_ground(flown.link)


def test_motors_that_are_ordered_off_in_a_hold_stop_at_once(ready) -> None:
    flown = Flown(ready, {5.0: Level.HOLD, 9.0: Level.MOTORS})
    assert flown.link.spinning == ()
    assert flown.link.now() < 9.4


@pytest.mark.slow
def test_a_hold_that_is_ordered_while_the_team_lands_changes_nothing(ready) -> None:
    plain, flown = (Flown(ready, {5.0: Level.LAND, **more}) for more in ({}, {8.5: Level.HOLD}))
    assert flown.link.now() == plain.link.now()
    assert flown.orders.give(Level.HOLD, "") is False


@pytest.mark.slow
def test_an_interrupt_in_a_hold_lands_and_a_second_one_stops_motors(ready) -> None:
    mission, flown = ready
    for interrupts in (1, 2):
        link, orders, record = SimulatedLink(mission, PLACES), StopOrders(), Record()
        observed, inner, left = ObservedLink(link, orders, record, lambda _: None), link.sleep, [9.0, 9.5][:interrupts]

        def sleep(seconds: float, link=link, orders=orders, inner=inner, left=left) -> None:
            if link.now() >= 5.0:
                orders.give(Level.HOLD, "stopped by alice")
            if left and link.now() >= left[0]:
                left.pop(0)
                raise KeyboardInterrupt
            inner(seconds)

        link.sleep = sleep
        done = fly_live(observed, flown, grounds=GROUNDS, operator=Operator(observed.see, orders, record))
        assert done.unsafe == ()
        assert link.spinning == ()
        assert (link.now() < 10.0) == (interrupts == 2)
        assert interrupts == 2 or on_the_ground(link)
