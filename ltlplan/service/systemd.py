"""Notices to systemd: that the service is ready, that it stops, and while its loop goes round that it is alive (`sd_notify`).

Where no unit started it there is nobody to notify, and nothing happens.
"""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import MutableMapping
from contextlib import suppress
from dataclasses import dataclass

_TIMES = 3
"""Signs of life in each of the unit's `WatchdogSec`."""


@dataclass(frozen=True, slots=True)
class Manager:
    """The manager that started the service.

    Attributes:
        address: Of its socket; empty where there is none.
        watchdog: s after which it ends a service that gave no sign of life; 0 for never.
    """

    address: str = ""
    watchdog: float = 0.0

    @classmethod
    def of(cls, environment: MutableMapping[str, str]) -> Manager:
        """Return the manager that an environment names.

        Args:
            environment: Of this process; what names it is taken out, so that no process that is started from here speaks to it.
        """
        address, usec = environment.pop("NOTIFY_SOCKET", ""), environment.pop("WATCHDOG_USEC", "")
        meant = environment.pop("WATCHDOG_PID", "") in ("", str(os.getpid()))
        return cls(address, int(usec) / 1e6 if usec.isdecimal() and meant else 0.0)

    def notify(self, *states: str) -> None:
        """Tell it how things are.

        Args:
            states: Such as "READY=1".
        """
        if not self.address:
            return
        place = "\0" + self.address[1:] if self.address.startswith("@") else self.address
        with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as line:
            line.setblocking(False)  # one that is gone, or hangs, holds nobody up
            line.sendto("\n".join(states).encode(), place)

    async def live(self) -> None:
        """Give signs of life until this is cancelled."""
        while self.watchdog > 0.0:
            self.notify("WATCHDOG=1")
            await asyncio.sleep(self.watchdog / _TIMES)
