"""A common start: one packet to all vehicles of a radio channel, or to each in turn where they are not reached by Crazyradio."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

from flight.link.crazyflie.vehicle import Vehicle

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
        self._alone: list[Vehicle] = []
        self._first: dict[tuple[int, int, int], Vehicle] = {}
        self._lines: dict[tuple[int, int, int], Any] = {}  # cflib has no types
        for vehicle in vehicles:
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

    def start(self, number: int) -> None:
        """Send the start of a stored trajectory to everybody.

        Args:
            number: Its id on board.
        """
        packets = {key: vehicle.start_packet(number) for key, vehicle in self._first.items()}
        for turn in range(_TIMES if packets else 1):
            for key, packet in packets.items():
                self._lines[key].send_packet((packet.header, *packet.data))
            if turn + 1 < _TIMES and packets:
                time.sleep(0.001)
        for vehicle in self._alone:
            vehicle.start(number)

    def again(self, number: int, vehicle: Vehicle) -> None:
        """Send it once more to somebody who is reached alone and has not answered.

        Args:
            number: Its id on board.
            vehicle: Whom.
        """
        if vehicle in self._alone:
            vehicle.start(number)

    def close(self) -> None:
        """Let go of the radios."""
        for line in self._lines.values():
            line.close()
        self._lines = {}
