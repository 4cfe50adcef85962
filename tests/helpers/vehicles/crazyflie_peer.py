"""Crazyflies that are simulated, behind a driver of cflib's own kind: addresses `peer://NAME`, packets lost and out of order."""

from __future__ import annotations

import contextlib
import itertools
import queue
import random
import threading
import time
from types import SimpleNamespace

import numpy as np
from cflib.crtp.crtpdriver import CRTPDriver
from cflib.crtp.crtpstack import CRTPPacket
from cflib.crtp.exceptions import WrongUriType

import flight
from flight.closed_loop import steps
from flight.link.crazyflie.vehicle import cflib_drivers
from flight.link.simulated_commander import Fleet
from flight.mixed_fleet import kinds_of
from flight.model.airframe import airframes_of
from flight.model.timing import CONTROL_STEP, FRAME_STEPS, STEP
from flight.onboard_simulation.fleet import Differences
from flight.onboard_simulation.fleet import Fleet as OnBoard
from flight.simulation_setup import Setup
from tests.helpers.vehicles.crazyflie_firmware import Firmware, Manner

ONCE = (13, 15)
"""Ports that cflib asks once on a link's first packets: radios send those until they are acknowledged."""


class Air(threading.Thread):
    """All vehicles, flown by our simulation in real time, and the air between them and a radio.

    Attributes:
        vehicles: By name.
        loss: Share of packets that are lost, each way.
        disorder: Share of packets that come after the next one.
        behind: s that the simulation was late at the most.
    """

    def __init__(self, mission, places, manners=None, *, loss=0.0, disorder=0.0, seed=0, **conditions) -> None:
        super().__init__(daemon=True, name="simulated Crazyflies")
        self._began, self.lock, self.loss, self.disorder = time.monotonic(), threading.RLock(), loss, disorder
        self.random, self.drivers, self.ended = random.Random(seed), {}, threading.Event()
        self.vehicles = {
            name: Firmware(name, np.array([*places[name], agent.yaw]), self.clock, (manners or {}).get(name, Manner()))
            for name, agent in mission.agents.items()
        }
        fleet = Fleet(self.vehicles, CONTROL_STEP)
        told = flight.Conditions(**conditions)
        airframes = airframes_of(mission, mission.agents)
        self._entries = self._on_board(airframes, told) if told.on_board else steps(Setup(airframes, fleet, told), [seed])
        self.truth: list[tuple[float, np.ndarray]] = []
        self.behind = 0.0

    def _on_board(self, airframes, conditions):
        """Fly by a controller on board that is asked for the set-point 100 times a second: one that was streamed stays until the next."""
        vehicles = self.vehicles.values()
        crew = OnBoard(
            kinds_of(airframes, 1), conditions.controller, np.stack([v.place for v in vehicles], axis=-1), Differences()
        )
        for frame in itertools.count():
            step = FRAME_STEPS * frame
            yield SimpleNamespace(step=step, position=crew.state[:3], velocity=crew.state[3:6])
            crew.fly(np.stack([vehicle.wanted(step * STEP) for vehicle in vehicles], axis=-1), 0, 0.0)

    def clock(self) -> float:
        """Return s since all were switched on."""
        return time.monotonic() - self._began

    def run(self) -> None:
        """Fly until `ended` is set."""
        entry = next(self._entries)
        places = self.places(entry.position)
        while not self.ended.is_set():
            for _ in range(5):  # a machine that is late flies on, and is heard meanwhile
                late = self.clock() - entry.step * STEP
                self.behind = max(self.behind, late)
                if late <= 0.0:
                    break
                with self.lock:
                    entry = next(self._entries)
                    places = self.places(entry.position)
                    self.truth.append((entry.step * STEP, places))
            with self.lock:
                for index, vehicle in enumerate(self.vehicles.values()):
                    vehicle.measured, vehicle.measured_at = (
                        np.array([*places[:, index], vehicle.place[3]]),
                        entry.step * STEP,
                    )
                    vehicle.velocity = entry.velocity[:, index]
                    vehicle.tick()
                    if (driver := self.drivers.get(vehicle.name)) is not None:
                        for reply in vehicle.due():
                            driver.hear(reply)
            time.sleep(0.005 if entry.step * STEP >= self.clock() else 0.0)

    def places(self, flown: np.ndarray) -> np.ndarray:
        """Return where all are, m: where the simulation has them, but for those that fall. Shape (3, n)."""
        return np.stack([vehicle.true_place(flown[:, k]) for k, vehicle in enumerate(self.vehicles.values())], axis=-1)

    @property
    def spinning(self) -> list[str]:
        """Whose motors turn."""
        return [name for name, vehicle in self.vehicles.items() if vehicle.spinning]


class PeerDriver(CRTPDriver):
    """A link of cflib to one simulated vehicle."""

    air: Air | None = None

    def connect(self, uri, radio_link_statistics_callback, link_error_callback) -> None:
        if not uri.startswith("peer://"):
            raise WrongUriType("no simulated vehicle")
        self.fail, self.arrived, self.held = link_error_callback, queue.Queue(), None
        self.vehicle, self.unheard = self.air.vehicles.get(uri.removeprefix("peer://")), 0
        if self.vehicle is not None:
            self.air.drivers[self.vehicle.name] = self
        if self.vehicle is None or self.vehicle.manner.silent_since == 0.0:
            threading.Timer(0.1, self.fail, ("Too many packets lost",)).start()

    def send_packet(self, packet) -> None:
        air, vehicle = self.air, self.vehicle
        if vehicle is None or air.clock() > vehicle.manner.silent_since:
            self.unheard += 1
            if self.unheard == 5:  # a radio gives up after so many packets that nobody acknowledged
                threading.Timer(0.05, self.fail, ("Too many packets lost",)).start()
            return
        with air.lock:
            if self._lost(packet.port):
                return
            for reply in vehicle.receive(packet.port, packet.channel, bytes(packet.data)):
                self.hear(reply)

    def hear(self, reply) -> None:
        """Have a packet arrive, or be lost, or come late."""
        if self._lost(reply[0]) or self.air.clock() > self.vehicle.manner.silent_since:
            return
        packet = CRTPPacket()
        packet.set_header(reply[0], reply[1])
        packet.data = reply[2]
        if self.held is None and reply[0] not in ONCE and self.air.random.random() < self.air.disorder:
            self.held = packet
            return
        self.arrived.put(packet)
        if self.held is not None:
            self.arrived.put(self.held)
            self.held = None

    def _lost(self, port: int) -> bool:
        frozen = self.air.clock() > self.vehicle.manner.frozen_since
        return frozen or (port not in ONCE and self.air.random.random() < self.air.loss)

    def receive_packet(self, wait=0):
        with contextlib.suppress(queue.Empty):
            return self.arrived.get(timeout=min(max(wait, 0.001), 0.1))

    def get_name(self) -> str:
        return "peer"

    def scan_interface(self, address=None) -> list:
        return []

    def close(self) -> None:
        if self.vehicle is not None:
            self.air.drivers.pop(self.vehicle.name, None)


@contextlib.contextmanager
def in_the_air(mission, places, manners=None, *, may_fall=False, **more):
    """Simulated vehicles that stand where they are put, and their addresses.

    Where the motors of one are cut in the air by who flies it, and that was no emergency stop, it falls, and what flew it has failed.
    """
    air = PeerDriver.air = Air(mission, places, manners, **more)
    drivers = cflib_drivers().CLASSES
    drivers.append(PeerDriver)
    air.start()
    try:
        yield air, {name: f"peer://{name}" for name in mission.agents}
    finally:
        air.ended.set()
        air.join()
        drivers.remove(PeerDriver)
        PeerDriver.air = None
    fell = {name: vehicle.fell for name, vehicle in air.vehicles.items() if vehicle.fell}
    assert may_fall or not fell, f"motors were cut in the air: {fell}"
