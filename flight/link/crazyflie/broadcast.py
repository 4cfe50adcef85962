"""A common start: one packet to all vehicles of a radio channel, or to each in turn where they are not reached by Crazyradio."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Any

from flight.exports.scripts.flying.supervisor import State
from flight.link.crazyflie.vehicle import EBUSY, Vehicle
from flight.link.link import LinkLost

WITHIN = 0.02
"""s within which a common start that was not answered is sent again: what a certificate allows clocks to differ by."""
STARTING = 0.4
"""s that vehicles have to answer to a common start."""
_SETTLES = 0.15
"""s after which a supervisor's report is of the new flight."""
_EVERYBODY = (0xFF, 0xE7, 0xE7, 0xE7, 0xE7)
"""The address that every Crazyflie listens to beside its own."""
_TIMES = 3
"""How often a broadcast is sent: nobody acknowledges it. Each one restarts the trajectory, within `_TIMES` ms."""


class Broadcast:
    """Starts stored trajectories of all vehicles at once."""

    def __init__(self, vehicles: Iterable[Vehicle]) -> None:
        """Open one more line of each radio that is in use.

        Args:
            vehicles: Connected.
        """
        self._vehicles = tuple(vehicles)
        self._alone: list[Vehicle] = []
        self._first: dict[tuple[int, int, int], Vehicle] = {}
        self._lines: dict[tuple[int, int, int], Any] = {}  # cflib has no types
        for vehicle in self._vehicles:
            if not vehicle.uri.startswith("radio://"):
                self._alone.append(vehicle)
                continue
            from cflib.crtp.radiodriver import RadioDriver, RadioManager

            radio, channel, rate = RadioDriver.parse_uri(vehicle.uri)[:3]
            if (key := (radio, channel, rate)) not in self._lines:
                line = RadioManager.open(radio)
                line.set_channel(channel)
                line.set_data_rate(rate)
                line.set_address(_EVERYBODY)
                self._first[key], self._lines[key] = vehicle, line

    def start(self, number: int, sleep: Callable[[float], None]) -> None:
        """Start a stored trajectory of everybody, and wait for all to answer.

        Args:
            number: Its id on board.
            sleep: Waits for so many s.

        Raises:
            LinkLost: Somebody did not start with the others.
        """
        vehicles = self._vehicles
        for vehicle in vehicles:
            vehicle.expect_start()
        begin, repeated = time.monotonic(), False
        said = {vehicle.name: vehicle.now() for vehicle in vehicles}
        self._send(number)
        while not all(vehicle.started == 0 for vehicle in vehicles) and time.monotonic() < begin + STARTING:
            if not repeated and time.monotonic() >= begin + WITHIN / 2:
                repeated = True
                for vehicle in self._alone:
                    if vehicle.started is None:
                        vehicle.start(number)
            sleep(0.002)
        late = [vehicle for vehicle in vehicles if vehicle.started != 0 and not _flies(vehicle, said[vehicle.name])]
        if late:
            why = (f"{v.name} {'is not let fly by its supervisor' if v.started == EBUSY else 'has not answered'}" for v in late)
            raise LinkLost(f"not all robots started together: {', '.join(why)}.")

    def close(self) -> None:
        """Let go of the radios."""
        for line in self._lines.values():
            line.close()
        self._lines = {}

    def _send(self, number: int) -> None:
        packets = {key: vehicle.start_packet(number) for key, vehicle in self._first.items()}
        for turn in range(_TIMES if packets else 0):
            if turn:
                time.sleep(0.001)
            for key, packet in packets.items():
                self._lines[key].send_packet((packet.header, *packet.data))
        for vehicle in self._alone:
            vehicle.start(number)


def _flies(vehicle: Vehicle, begin: float) -> bool:
    """Return whether a vehicle whose answer was lost says that it flies something since."""
    state, told = vehicle.reports.state, vehicle.reports.state_at
    told_since = vehicle.started is None and state is not None and told > begin + _SETTLES
    return told_since and State.ACTIVE in (state or State(0)) and State.FINISHED not in (state or State.FINISHED)
