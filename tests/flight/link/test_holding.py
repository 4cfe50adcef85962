"""A hold that is ordered over each kind of link: vehicles that keep the rules of the real ones hover where they come to rest until they are to land."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import pytest

from flight.link.link import Link
from flight.link.live_executive import LiveFlight, Operator, fly_live
from flight.link.observed_link import Observation, ObservedLink
from flight.link.phases import FLIGHT, Stage
from flight.link.record import Record
from flight.link.stop_orders import Level, StopOrders
from tests.helpers.live.patience import patient  # noqa: F401  # pytest finds the fixture by its name

pytestmark = pytest.mark.slow

LASTS = 5.0
"""s from the order to hold to the order to land."""
UNCHECKED = ("battery",)


@dataclass(frozen=True)
class Held:
    """A flight that was ordered to hold, and to land later.

    Attributes:
        done: How it ended.
        seen: What was seen.
        at: When it was to hold, s of the link's clock.
    """

    done: LiveFlight
    seen: list[Observation]
    at: float

    def require(self) -> None:
        """Assert that all acknowledged a hold within 2 s, stayed where they came to rest, and landed when they were to."""
        assert self.done.reason == "stopped by alice"
        assert self.done.unsafe == ()
        soon = [seen for seen in self.seen if self.at < seen.time < self.at + 2.0]
        assert any(all(robot.acknowledged == "hold" for robot in seen.robots.values()) for seen in soon)
        rest = [seen for seen in self.seen if self.at + 3.0 < seen.time < self.at + LASTS]
        for name in rest[0].robots:
            places = [seen.robots[name].pose.position for seen in rest if seen.robots[name].pose is not None]
            assert max(math.dist(places[0], place) for place in places) < 0.05
            assert all(place[2] > 0.2 for place in places)
        lands = next(seen.time for seen in self.seen if all(robot.acknowledged == "land" for robot in seen.robots.values()))
        assert self.at + LASTS < lands < self.at + LASTS + 2.0
        assert not any(event.sentence.startswith("the hold ends") for event in self.done.record.events)


def held(link: Link, stages: Sequence[Stage], grounds: dict[str, float]) -> Held:
    """Fly, order a hold 0.8 s into the flight, and a landing `LASTS` later."""
    orders, record, seen, at = StopOrders(), Record(), list[Observation](), [math.inf]

    def show(observation: Observation) -> None:
        seen.append(observation)
        if math.isinf(at[0]) and observation.time > record.starts.get(FLIGHT, math.inf) + 0.8:
            at[0] = observation.time
            orders.give(Level.HOLD, "stopped by alice")
        if observation.time > at[0] + LASTS:
            orders.give(Level.LAND, "stopped by bob")

    observed = ObservedLink(link, orders, record, show)
    operator = Operator(observed.see, orders, record)
    done = fly_live(observed, stages, grounds=grounds, operator=operator, unchecked=UNCHECKED)
    observed.observe()
    return Held(done, seen, at[0])


@pytest.mark.parametrize("kind", ["on board", "streamed"])
def test_crazyflies_hold_by_their_own_commander(mission, flown, kind: str) -> None:
    pytest.importorskip("cflib", reason="cflib is not installed")
    from flight.link.crazyflie.link import CrazyflieLink
    from flight.link.crazyflie.streamed import StreamedCrazyflies
    from tests.helpers.vehicles.crazyflie_peer import in_the_air
    from tests.helpers.vehicles.crazyflie_stages import GROUNDS, PLACES

    made, on_board = (CrazyflieLink, {}) if kind == "on board" else (StreamedCrazyflies, {"controller": "mellinger"})
    with in_the_air(mission, PLACES, **on_board) as (air, addresses):
        link = made(mission, addresses)
        found = held(link, flown, GROUNDS)
        link.close()
        assert air.spinning == []
        assert not any(vehicle.locked or vehicle.dropped for vehicle in air.vehicles.values()), "nobody was let fall"
    found.require()


def test_px4_holds_in_its_own_mode() -> None:
    pytest.importorskip("pymavlink", reason="pymavlink is not installed")
    import ltlplan
    from flight.link.mavlink import MavlinkLink
    from ltlplan.live_phases import stages
    from ltlplan.pipeline import certified_team
    from tests.helpers.live.live_missions import HOP
    from tests.helpers.vehicles.px4_peer import HOLD, LAND, Manner, Px4Peer, free_port

    mission = ltlplan.parse_mission(HOP)
    done = certified_team(ltlplan.plan(mission))
    x, y, z = place = (0.1, -0.4, 0.0)
    peer = Px4Peer(1, port := free_port(), (y, x, -z), Manner(armed=False))
    peer.start()
    try:
        link = MavlinkLink(mission, {"one": f"udpin:127.0.0.1:{port}"}, accuracy=0.005)
        found = held(link, stages(done.plan, done.team, done.certificate, {"one": place}), {"one": 0.0})
        link.close()
    finally:
        peer.ended.set()
        peer.join()
    found.require()
    assert (peer.asked[-2], peer.asked[-1]) == (HOLD, LAND)
    assert peer.failsafes == 0, "it holds without set-points"
    assert not peer.armed
