"""Short flights of three simulated Crazyflies over real cflib in which something fails, each by its number."""

from __future__ import annotations

import functools
import signal
import time

import numpy as np

from flight.link.crazyflie.link import CrazyflieLink
from flight.link.crazyflie.streamed import StreamedCrazyflies
from flight.link.link import LinkLost
from flight.link.live_executive import LiveFlight, fly_live
from ltlplan.commands.support.live_view import interrupts_land
from tests.helpers.live.failed_flights import NEAR, STALL, End, Ended, Stalls, Truth, faults_of, lies_of, outcome_of, was_late
from tests.helpers.live.failure_draws import HOST, Draw, Failing, Host, drawn, interrupt
from tests.helpers.vehicles.crazyflie_firmware import Firmware
from tests.helpers.vehicles.crazyflie_peer import Air, in_the_air
from tests.helpers.vehicles.crazyflie_stages import GROUNDS, PLACES, UNCHECKED, short_flight

VEHICLES = ("silent", "frozen", "astray", "blocked", "flat")
"""What fails of one: it is switched off as the radio notices, or does not; it takes itself to be elsewhere; its supervisor, its battery."""
GRACE = 3.5
"""s in which what acts on board has acted."""

UNFED = 0.6
"""s for which a host may hang before watchdogs on board act: 1 s after the last sign of life, which may be 0.2 s old, and late."""
FRAME = 0.01
"""s between two places of the simulation."""

stages = functools.cache(short_flight)


def fly_stored(number: int) -> Ended:
    """Fly by trajectories that lie on board."""
    return _fly(drawn(1, number, VEHICLES + HOST, tuple(PLACES)), streamed=False)


def fly_streamed(number: int) -> Ended:
    """Fly by set-points from here."""
    return _fly(drawn(2, number, VEHICLES + HOST, tuple(PLACES)), streamed=True)


def _fly(draw: Draw, *, streamed: bool) -> Ended:
    flown, failsafe = stages(), ("fly on", "stop")[draw.choice]
    mission = flown[0].plan.mission
    trouble = 0.01 if draw.number % 4 == 0 else 0.0
    conditions = {"controller": "mellinger"} if streamed else {"noise": 0.001}
    with (
        Stalls() as stalls,
        in_the_air(
            mission, PLACES, may_fall=draw.again is not None, loss=trouble, disorder=trouble, seed=draw.number, **conditions
        ) as (air, addresses),
    ):
        make = StreamedCrazyflies if streamed else CrazyflieLink
        try:
            link = make(mission, addresses, failsafe=failsafe)
        except LinkLost as error:  # nothing has failed yet: the machine is late
            return Ended(draw, "refused", ("ground",) * len(PLACES), (), (str(error),), max(stalls.longest, air.behind) > STALL)
        host = Host(link, draw.lasts)
        failing = Failing(
            draw, link, flown, lambda: _fail(draw, air, host), lead=0.0 if streamed else 0.4, before=0.5 if streamed else 2.0
        )
        done = _flown(link, failing)
        late = air.clock() - link.now()
        turning = set(air.spinning)
        link.close()
        end = air.clock() + GRACE
        while air.clock() < end and air.spinning:
            time.sleep(0.05)
        with air.lock:
            times = np.array([when for when, _ in air.truth]) - late
            places = {name: np.array([at[:, k] for _, at in air.truth]) for k, name in enumerate(PLACES)}
            truth = Truth(times, places)
            for vehicle in air.vehicles.values():
                vehicle.dropped &= not vehicle.manner.blocks  # by its own supervisor, at a set-point
            ends = [_end(vehicle, vehicle.name in turning, truth, late) for vehicle in air.vehicles.values()]
    holds = not streamed and failsafe == "fly on"

    def alone(state: str) -> bool:
        """Who cannot be told holds or stops, as the failsafe says; a supervisor stops motors for itself."""
        if draw.kind == "blocked":
            return state == "stopped"
        gone = draw.kind in ("silent", "frozen", "unplugged") or (draw.kind in ("hangs", "outage") and draw.lasts > UNFED)
        return gone and (
            state == ("holding" if holds else "stopped") or (streamed and failsafe == "fly on" and state == "holding")
        )

    misplaced = draw.robot if draw.kind == "astray" else ""
    faults = done and faults_of(draw, done, flown, ends, truth, failing=failing, alone=alone, misplaced=misplaced)
    states, late = tuple(end.state for end in ends), was_late(done, failing, max(stalls.longest, air.behind))
    return Ended(draw, outcome_of(done), states, tuple(lies_of(done, ends)), tuple(faults or ()), late)


def _flown(link: CrazyflieLink, failing: Failing) -> LiveFlight | None:
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


def _fail(draw: Draw, air: Air, host: Host) -> None:
    manner, now = air.vehicles[draw.robot].manner, air.clock()
    match draw.kind:
        case "silent":
            manner.silent_since = now
        case "frozen":
            manner.frozen_since = now
        case "astray":
            manner.off = 0.3
        case "blocked":
            manner.blocks = True
        case "flat":
            manner.battery = 0.0
        case "interrupted":
            interrupt(signal.SIGINT)
        case "terminated":
            interrupt(signal.SIGTERM)
        case "error":
            host.err()
        case "unplugged":
            for vehicle in air.vehicles.values():
                vehicle.manner.silent_since = now
        case _:
            lost, air.loss = air.loss, 1.0
            if draw.kind == "hangs":
                host.hang()
            time.sleep(draw.lasts)
            air.loss = lost


def _end(vehicle: Firmware, turning: bool, truth: Truth, late: float) -> End:
    """Say what became of a vehicle, by its motors and where it was in the last half second; how it falls once they stand still is no flight."""
    if not vehicle.starts and not vehicle.streamed.kept:
        state = "flying" if vehicle.spinning else "ground"
    elif not vehicle.spinning:
        state = "landed" if vehicle.stopped_at < GROUNDS[vehicle.name] + NEAR else "stopped"
    else:
        last = truth.places[vehicle.name][-50:]
        state = "holding" if np.ptp(last, axis=0).max() < 0.02 else "flying"
    until = np.inf if vehicle.spinning else vehicle.stopped_since - late
    flown = truth.places[vehicle.name][: int(truth.times.searchsorted(until))]
    steps = np.linalg.norm(flown[5:] - flown[:-5], axis=1)
    return End(vehicle.name, turning, state, vehicle.dropped, float(steps.max(initial=0.0) / (5 * FRAME)))
