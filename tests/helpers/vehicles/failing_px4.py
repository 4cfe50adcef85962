"""Short flights of PX4 vehicles over real MAVLink in which something fails, each by its number: in this process, and in one that is killed."""

from __future__ import annotations

import functools
import signal
import time
from collections.abc import Generator, Sequence
from contextlib import contextmanager

import numpy as np

from flight.link.live_executive import LiveFlight, fly_live
from flight.link.mavlink import MavlinkLink
from ltlplan.commands.support.live_view import interrupts_land
from tests.helpers.live.failed_flights import NEAR, End, Ended, Stalls, Truth, faults_of, lies_of, outcome_of, was_late
from tests.helpers.live.failure_draws import HOST, Draw, Failing, Host, drawn, interrupt
from tests.helpers.vehicles.crazyflie_stages import GROUNDS, PLACES, UNCHECKED, wide_flight
from tests.helpers.vehicles.px4_peer import HOLD, LAND, POSITION, Manner, Px4Peer, free_port
from verify.data import BadInput

VEHICLES = ("silent", "unplugged vehicle", "drifting", "taken over", "deaf to hold", "deaf to land")
"""What fails of one: it says nothing, or hears nothing either; wind; its pilot; it drifts, and does not take the mode that it is asked for then."""
GRACE = 6.0
"""s in which what acts on board has acted."""

stages = functools.cache(wide_flight)


def fly_px4(number: int) -> Ended:
    """Fly three vehicles from here, by other ports where one was taken by another process meanwhile."""
    try:
        return _fly(number)
    except BadInput:
        return _fly(number)


def _fly(number: int) -> Ended:
    draw, flown = drawn(3, number, VEHICLES + HOST, tuple(PLACES)), stages()
    with Stalls() as stalls, _vehicles() as (peers, addresses):
        link = MavlinkLink(flown[0].plan.mission, addresses, accuracy=0.005)
        host = Host(link, draw.lasts)
        failing = Failing(draw, link, flown, lambda: _fail(draw, peers, host), lead=2.0, before=0.5)
        done = _flown(link, failing)
        turning = {name for name, peer in peers.items() if peer.armed}
        link.close()
        settle(list(peers.values()))
        truth = _truth(peers)
        ends = [
            End(name, name in turning, state_of(peer, GROUNDS[name]), jump=fastest_asked(peer)) for name, peer in peers.items()
        ]
    faults = done and faults_of(draw, done, flown, ends, truth, failing=failing, alone=lambda state: state == "holding")
    states, late = tuple(end.state for end in ends), was_late(done, failing, stalls.longest)
    return Ended(draw, outcome_of(done), states, tuple(lies_of(done, ends)), tuple(faults or ()), late)


@contextmanager
def _vehicles() -> Generator[tuple[dict[str, Px4Peer], dict[str, str]]]:
    """Vehicles that stand where they are put, disarmed, and their addresses."""
    ports = {name: free_port() for name in PLACES}
    peers = {
        name: Px4Peer(index + 1, ports[name], (y, x, -z), Manner(armed=False))
        for index, (name, (x, y, z)) in enumerate(PLACES.items())
    }
    for peer in peers.values():
        peer.start()
    try:
        yield peers, {name: f"udpin:127.0.0.1:{port}" for name, port in ports.items()}
    finally:
        for peer in peers.values():
            peer.ended.set()
        for peer in peers.values():
            peer.join()


def _flown(link: MavlinkLink, failing: Failing) -> LiveFlight | None:
    """Fly; None where it was interrupted before it was said to be flown, which must be before anything spins."""
    done = None
    try:
        with interrupts_land():
            failing.start()
            done = fly_live(link, stages(), grounds=GROUNDS, unchecked=UNCHECKED)
            failing.ended.set()
            failing.join()
    except (KeyboardInterrupt, ZeroDivisionError):
        failing.ended.set()
    return done


def _fail(draw: Draw, peers: dict[str, Px4Peer], host: Host) -> None:
    manner = peers[draw.robot].manner
    match draw.kind:
        case "silent":
            manner.silent = True
        case "unplugged vehicle":
            manner.unplugged = True
        case "drifting" | "deaf to hold" | "deaf to land":
            manner.drifts = 0.6
            manner.deaf_to = {"drifting": (), "deaf to hold": (HOLD,), "deaf to land": (LAND,)}[draw.kind]
        case "taken over":
            manner.leaves_after = 0
        case "interrupted":
            interrupt(signal.SIGINT)
        case "terminated":
            interrupt(signal.SIGTERM)
        case "error":
            host.err()
        case "hangs":
            host.hang()
        case _:
            for peer in peers.values():
                peer.manner.unplugged = True
            if draw.kind == "outage":
                time.sleep(draw.lasts)
                for peer in peers.values():
                    peer.manner.unplugged = False


def settle(peers: Sequence[Px4Peer]) -> None:
    """Wait until all have come to where they end."""
    end = time.monotonic() + GRACE
    while time.monotonic() < end and any(peer.armed for peer in peers):
        if all(not peer.armed or peer.mode in (HOLD, POSITION) for peer in peers):
            time.sleep(1.5)  # longer than any failsafe waits: it stays so
            return
        time.sleep(0.05)


def _truth(peers: dict[str, Px4Peer]) -> Truth:
    """Say where they were, in the mission's frame, at common instants."""
    tracks = {name: list(peer.track) for name, peer in peers.items()}
    begin = max(track[0][0] for track in tracks.values())
    end = min(track[-1][0] for track in tracks.values())
    times = np.arange(begin, end, 0.005)
    places = {}
    for name, track in tracks.items():
        rows = np.array([where for _, where in track])[np.searchsorted([at for at, _ in track], times, side="right") - 1]
        places[name] = np.stack([rows[:, 1], rows[:, 0], -rows[:, 2]], axis=1)
    return Truth(times, places)


def state_of(peer: Px4Peer, ground: float) -> str:
    """Return what became of a vehicle, by its motors and where it is; its ground is so high, in m."""
    if peer.armed:
        return "holding" if peer.mode in (HOLD, POSITION) else "flying"
    if not peer.flown:
        return "ground"
    return "landed" if -peer.place[2] < ground + NEAR else "stopped"


def fastest_asked(peer: Px4Peer) -> float:
    """Return the greatest speed from one set-point to the next, m/s: where one is for much later than the last, or begins another flight, as if it were 0.1 s."""
    rows = np.array(peer.flown).reshape(-1, 4)
    steps, times = np.linalg.norm(np.diff(rows[:, 1:], axis=0), axis=1), np.diff(rows[:, 0]) / 1000.0
    return float(np.max((steps - 0.005) / np.where((times > 0.0) & (times < 0.6), np.maximum(times, 0.02), 0.1), initial=0.0))
