"""Online flight in real time over MAVLink, to vehicles that keep PX4's rules, with processes that compute beside it."""

from contextlib import ExitStack

import numpy as np
import pytest

from flight.link.live_executive import fly_live
from flight.link.mavlink import MavlinkLink
from ltlplan.online.event_queue import Happenings, no_news
from ltlplan.online.live.live_online_flight import OnlineCourse
from ltlplan.online.live.measured_result import flown_live
from ltlplan.online.segments.certified_team import CertifiedTeam
from ltlplan.service.execution.background_executor import Beside
from ltlplan.transfers import to_starts
from tests.helpers.vehicles.px4_peer import Manner, Px4Peer, free_port
from tests.ltlplan.online.live.test_live_online_flight import BACK, PAIR, PLACES, nothing_flown_that_was_not_proved
from verify.data import parse_mission
from verify.data.events import NewFormula, RobotLeaves

pytestmark = pytest.mark.slow


SLOW = PAIR + "margin: 0.09\nlimits: {speed: 0.5}\nplanner: {speed: 0.4}\n"
"""A vehicle of these is where its last set-point was, and a busy machine sends one some milliseconds late."""


@pytest.fixture(scope="module")
def beside():
    return Beside()


@pytest.mark.parametrize("event", [NewFormula(time=1.0, formula=BACK), RobotLeaves(time=0.6, robot="two")])
def test_what_is_proved_in_flight_is_streamed(beside, event):
    team = CertifiedTeam(parse_mission(SLOW), seed=1)
    before = [transfer.stage for transfer in to_starts(team.mission, team.present.team, PLACES)]
    course = OnlineCourse(team, beside, PLACES, Happenings((event,), no_news))
    with ExitStack() as stack:
        ports = {name: free_port() for name in PLACES}
        peers = {
            name: Px4Peer(number + 1, ports[name], (y, x, -z), Manner(armed=False))
            for number, (name, (x, y, z)) in enumerate(PLACES.items())
        }
        for peer in peers.values():
            peer.start()
            stack.callback(peer.join)
            stack.callback(peer.ended.set)
        addresses = {name: f"udpin:127.0.0.1:{port}" for name, port in ports.items()}
        link = MavlinkLink(team.mission, addresses, accuracy=0.005)
        stack.callback(link.close)
        done = fly_live(link, before, grounds=dict.fromkeys(PLACES, 0.0), onwards=course, unchecked=("battery",))
    assert done.flown, done.reason
    assert not any(peer.armed for peer in peers.values())
    assert all(peer.failsafes == 0 for peer in peers.values())
    nothing_flown_that_was_not_proved(course, done)
    flown = flown_live(course, done, planned_cost=1.0)
    assert flown.certified
    assert flown.verdict.outcome == "holds"
    for peer in peers.values():  # no set-point is far from the one before: what is replaced goes on from where it was
        rows = np.array(peer.flown)
        assert np.abs(np.diff(rows[:, 1:], axis=0)).max() < 0.15
