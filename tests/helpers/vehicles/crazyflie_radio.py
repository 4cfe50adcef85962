"""A Crazyradio that is simulated: what cflib's own radio driver speaks to, with channels, addresses, acknowledgements and broadcasts."""

from __future__ import annotations

import collections
from types import SimpleNamespace

from tests.helpers.vehicles.crazyflie_peer import Air

EVERYBODY = (0xFF, 0xE7, 0xE7, 0xE7, 0xE7)


class Antenna:
    """Where a vehicle puts what it says, until the radio asks for it."""

    def __init__(self) -> None:
        self.waiting: collections.deque = collections.deque(maxlen=64)

    def hear(self, reply) -> None:
        self.waiting.append(reply)


def crazyradio(air: Air, where: dict[str, tuple[int, str]]):
    """Return a class in the place of cflib's own, for vehicles at (channel, address).

    Attributes of the class:
        broadcasts: Channel and data of every packet to everybody.
    """
    antennas = {name: Antenna() for name in where}
    air.drivers.update(antennas)
    names = {(channel, tuple(bytes.fromhex(address))): name for name, (channel, address) in where.items()}

    class Radio:
        version, broadcasts = 0.53, []
        DR_250KPS, DR_1MPS, DR_2MPS = 0, 1, 2

        def __init__(self, devid: int = 0) -> None:
            if devid != 0:
                raise Exception("Cannot find a Crazyradio Dongle")

        def set_channel(self, channel) -> None:
            self.channel = channel

        def set_address(self, address) -> None:
            self.address = tuple(address)

        def set_data_rate(self, rate) -> None:
            pass

        def set_arc(self, arc) -> None:
            pass

        def close(self) -> None:
            pass

        def send_packet(self, data):
            header, content = data[0], bytes(data[1:])
            if self.address == EVERYBODY:
                self.broadcasts.append((self.channel, header, content))
                for (channel, _), name in names.items():
                    if channel == self.channel:
                        self.deliver(name, header, content)
                return SimpleNamespace(ack=False, powerDet=False, retry=3, data=())
            name = names.get((self.channel, self.address))
            if name is None:
                return SimpleNamespace(ack=False, powerDet=False, retry=3, data=())
            if header != 0xFF:
                self.deliver(name, header, content)
            reply = antennas[name].waiting.popleft() if antennas[name].waiting else None
            answer = () if reply is None else (reply[0] << 4 | 0x0C | reply[1], *reply[2])
            return SimpleNamespace(ack=True, powerDet=False, retry=0, data=answer)

        def deliver(self, name, header, content) -> None:
            with air.lock:
                for reply in air.vehicles[name].receive(header >> 4, header & 3, content):
                    antennas[name].hear(reply)

    return Radio
