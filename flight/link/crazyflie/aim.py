"""Set-points for one Crazyflie: the newest goes out, and once they have ended its high-level commander is let go before them."""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Callable
from typing import Any

from flight.link.crazyflie import packets

LANDS = 1
"""What the high-level commander answers to a landing where it lands already."""


class Aim:
    """Sends set-points, until there are to be no more."""

    def __init__(self, cf: Any, send: Callable[[Callable[[], object]], object]) -> None:  # cflib has no types
        """Send none.

        Args:
            cf: cflib's Crazyflie.
            send: Has something sent after what waits already.
        """
        self._cf, self._send = cf, send
        self._newest: deque[bytes] = deque(maxlen=1)
        self._ended = False

    def at(self, setpoint: bytes) -> None:
        """Send a set-point, in the place of one that waits for the radio still.

        Args:
            setpoint: Its kind and its numbers.
        """
        self._newest.append(setpoint)
        self._send(self._out)

    def end(self) -> None:
        """Send no more set-points; where a command to the high-level commander is acknowledged from now on, tell the vehicle so."""
        self._newest.clear()
        self._ended = True

    def relax(self) -> None:
        """Tell it that set-points have ended; nobody answers to that."""
        self._send(self._cf.commander.send_notify_setpoint_stop)

    def acknowledged(self, command: int, answer: int) -> None:
        """Take in what the high-level commander answered: it has something to follow now, or stops motors.

        Args:
            command: To what.
            answer: 0, or why not.
        """
        if self._ended and command in (packets.GO_TO, packets.LAND, packets.STOP) and answer in (0, LANDS):
            self.relax()

    def _out(self) -> None:
        with contextlib.suppress(IndexError):  # it is sent already, or not to be sent any more
            self._cf.send_packet(packets.setpoint(self._newest.pop()))
