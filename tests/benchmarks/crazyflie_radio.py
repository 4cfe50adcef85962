"""How many set-points a second reach Crazyflies on one radio channel, by cflib's own radio driver and a radio of ours in the place of its dongle.

    python tests/benchmarks/crazyflie_radio.py [ROBOTS ...]

The radio acknowledges everything and has nothing to say, at once or after 1 ms, as long as a packet each way takes by air and USB. Robots are
sent as many packets as they take, and then `RATE` a second.
"""

from __future__ import annotations

import collections
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
from cflib.crtp import radiodriver

sys.path.insert(0, str(Path(__file__).parents[2]))

from flight.link.crazyflie.packets import setpoint
from flight.link.crazyflie.setpoints import full_state
from flight.link.crazyflie.streamed import RATE
from tests.helpers.benchmarks import run_benchmark

LASTS = 4.0
"""s that each case lasts."""


class Radio:
    """What the driver takes for a dongle."""

    version, DR_250KPS, DR_1MPS, DR_2MPS = 0.53, 0, 1, 2
    takes = 0.0
    exchanged: ClassVar[collections.Counter[object]] = collections.Counter()

    def __init__(self, devid: int = 0) -> None:
        self._address: object = None

    def set_address(self, address: Sequence[int]) -> None:
        """Say to whom."""
        self._address = tuple(address)

    def __getattr__(self, name: str):
        return lambda *_: None

    def send_packet(self, data: Sequence[int]):
        """Count a packet, and acknowledge it."""
        if self.takes:
            time.sleep(self.takes)
        self.exchanged["all"] += 1
        self.exchanged[self._address] += data[0] != 0xFF
        return SimpleNamespace(ack=True, powerDet=False, retry=0, data=())


def measured(robots: int, takes: float, rate: float) -> tuple[float, float]:
    """Return packets a second of all together, and set-points a second of the robot that got the fewest."""
    Radio.takes = takes
    radiodriver.Crazyradio = Radio
    radiodriver.RadioManager._radios = []  # pyright: ignore[reportPrivateUsage]  # a new one each time
    links = [radiodriver.RadioDriver() for _ in range(robots)]
    for index, link in enumerate(links):
        link.connect(f"radio://0/80/2M/E7E7E7E7{index:02X}", None, print)
    packet = setpoint(full_state(np.eye(4)))
    Radio.exchanged.clear()
    end = time.monotonic() + LASTS

    def stream(link: radiodriver.RadioDriver) -> None:
        due = time.monotonic()
        while time.monotonic() < end:
            link.send_packet(packet)
            due += 1.0 / rate
            time.sleep(max(due - time.monotonic(), 0.0))

    threads = [threading.Thread(target=stream, args=(link,)) for link in links]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    each = [count for key, count in Radio.exchanged.items() if key != "all"]
    found = Radio.exchanged["all"] / LASTS, min(each) / LASTS
    for link in links:
        link.close()
    return found


def main() -> None:
    """Print a line a case."""
    for robots in map(int, sys.argv[1:] or ("3", "10")):
        for takes in (0.0, 1e-3):
            most, _ = measured(robots, takes, np.inf)
            _, least = measured(robots, takes, RATE)
            print(
                f"{robots} robots, {1000 * takes:g} ms a packet: {most:.0f} packets/s at the most; at {RATE:g} a second each gets {least:.1f} or more"
            )


if __name__ == "__main__":
    run_benchmark(main, ["1"])
