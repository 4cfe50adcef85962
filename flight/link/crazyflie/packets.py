"""Packets that cflib has no call for in every version: to the supervisor, and a start that everybody hears."""

from __future__ import annotations

import struct
from typing import Any

STOP, GO_TO, START, DEFINE, LAND = 3, 12, 13, 6, 8
"""Commands of the high-level commander, as its answers name them."""
_OLDER = {GO_TO: 4, START: 5}
"""What older firmware calls the same."""
COMMANDER = 8
"""Port of the high-level commander."""
ARM, EMERGENCY, WATCHDOG = (1, 1), (3,), (4,)
"""Commands to the supervisor."""
_SUPERVISOR, _PLATFORM, _LOCALIZATION, _SETPOINTS = 9, 13, 6, 7
_BEFORE: dict[tuple[int, ...], tuple[int, int, tuple[int, ...]]] = {
    ARM: (_PLATFORM, 0, (1, 1)),
    EMERGENCY: (_LOCALIZATION, 1, (3,)),
    WATCHDOG: (_LOCALIZATION, 1, (4,)),
}
"""Port, channel and data of the same before the supervisor had a port."""
_OWN_PORT, _RELATIVE_YAW = 12, 10
"""Versions of the protocol from which on the supervisor has a port, and a start says how headings are meant."""


def supervise(version: int, command: tuple[int, ...]) -> Any:  # cflib's packets have no types
    """Return a command to a vehicle's supervisor.

    Args:
        version: Of the protocol that it speaks.
        command: `ARM`, `EMERGENCY` or `WATCHDOG`.
    """
    port, channel, data = (_SUPERVISOR, 1, command) if version >= _OWN_PORT else _BEFORE[command]
    return _packet(port, channel, bytes(data))


def start(version: int, number: int) -> Any:  # cflib's packets have no types
    """Return the start of a stored trajectory, at its own speed and where it lies.

    Args:
        version: Of the protocol.
        number: The trajectory's id.
    """
    if version < _RELATIVE_YAW:
        return _packet(COMMANDER, 0, struct.pack("<BBBBBf", _OLDER[START], 0, 0, 0, number, 1.0))
    return _packet(COMMANDER, 0, struct.pack("<BBBBBBf", START, 0, 0, 0, 0, number, 1.0))


def setpoint(data: bytes) -> Any:  # cflib's packets have no types
    """Return a packet with a set-point.

    Args:
        data: Its kind and its numbers.
    """
    return _packet(_SETPOINTS, 0, data)


def answered(packet: Any) -> tuple[int, int] | None:  # cflib's packets have no types
    """Return which command the high-level commander answers to, and 0 or why not; None where it is no answer.

    Args:
        packet: From its port.
    """
    data = bytes(packet.data)
    if len(data) < 4:
        return None
    return next((command for command, older in _OLDER.items() if older == data[0]), data[0]), data[3]


def _packet(port: int, channel: int, data: bytes) -> Any:
    from cflib.crtp.crtpstack import CRTPPacket

    packet = CRTPPacket()
    packet.set_header(port, channel)
    packet.data = data
    return packet
